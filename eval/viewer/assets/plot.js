// Mean values over frames, one line a side, with a cursor that can be dragged.

class Plot {
  // seek: called with a frame of the sequence, a real number
  constructor(seek) {
    this.svg = drawing("svg", { class: "mv-plot", role: "img" });
    this.seek = seek;
    const follow = (event) => {
      const place = (event.clientX - this.svg.getBoundingClientRect().left - this.left) / this.width;
      seek(Math.max(0, Math.min(1, place)) * this.last);
    };
    this.svg.addEventListener("pointerdown", (event) => {
      this.svg.setPointerCapture(event.pointerId);
      follow(event);
    });
    this.svg.addEventListener("pointermove", (event) => event.buttons && follow(event));
  }

  // lines: [{name, colour, means}]; fps: frames per second or null
  open(lines, unit, fps) {
    Object.assign(this, { lines, unit, fps });
    this.last = Math.max(1, Math.max(...lines.map((line) => line.means.length)) - 1);
    this.high = 1.08 * Math.max(...lines.flatMap((line) => line.means)) || 1;
    this.svg.setAttribute("aria-label", `mean error of each frame in ${unit}: ${lines.map((line) => line.name).join(", ")}`);
  }

  x(frame) {
    return this.left + (frame / this.last) * this.width;
  }

  y(value) {
    return this.bottom - (value / this.high) * (this.bottom - this.top);
  }

  layout() {
    const whole = this.svg.clientWidth || 600;
    this.left = 46;
    this.top = 10;
    this.bottom = 122;
    this.width = whole - this.left - 14;
    this.svg.setAttribute("viewBox", `0 0 ${whole} 156`);
    const label = (x, y, text, anchor) => drawing("text", { x, y, "text-anchor": anchor }, text);
    const grid = drawing("g", { class: "mv-grid" });
    for (const value of ticks(this.high, 4)) {
      const y = this.y(value);
      grid.append(drawing("line", { x1: this.left, x2: this.left + this.width, y1: y, y2: y }));
      grid.append(label(this.left - 7, y + 4, String(value), "end"));
    }
    const rate = this.fps ?? 1;
    for (const value of ticks(this.last / rate, Math.max(2, Math.min(8, this.width / 90))))
      grid.append(label(this.x(value * rate), this.bottom + 17, String(value), "middle"));
    grid.append(label(this.left + this.width, this.bottom + 32, this.fps ? "time, s" : "frame", "end"));
    grid.append(label(this.left, this.bottom + 32, `mean over the vertices, ${this.unit}`, "start"));
    const curves = this.lines.map((line) =>
      drawing("polyline", { stroke: line.colour, fill: "none", "stroke-width": 1.8, "stroke-linejoin": "round",
        points: line.means.map((value, t) => `${this.x(t).toFixed(1)},${this.y(value).toFixed(1)}`).join(" ") }),
    );
    this.cursor = drawing("line", { class: "mv-cursor", y1: this.top - 6, y2: this.bottom });
    this.dots = this.lines.map((line) => drawing("circle", { r: 4, fill: line.colour, class: "mv-dot" }));
    this.svg.replaceChildren(grid, ...curves, this.cursor, ...this.dots);
  }

  show(frame) {
    if (!this.cursor) this.layout();
    const x = this.x(frame);
    this.cursor.setAttribute("x1", x);
    this.cursor.setAttribute("x2", x);
    this.lines.forEach((line, i) => {
      this.dots[i].setAttribute("cx", x);
      this.dots[i].setAttribute("cy", this.y(line.means[frame]));
    });
  }
}
