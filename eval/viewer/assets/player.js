// A viewer: panes side by side, what plays them, and what can be set.

const MOUSE = "Drag turns, with shift it moves, double click resets; space plays, arrows step.";
const KEYS = "space plays, arrows step, home and end; with shift arrows turn, + and - zoom, 0 resets the view";

class Player {
  constructor(root, data) {
    Object.assign(this, { root, data, frame: 0, speed: 1, panes: [], place: null, follow: false });
    this.looks = { heat: true, lines: false, body: true };
    this.orbit = new Orbit(() => this.invalidate());
    this.stage = Stage.shared();
    if (this.stage) this.shades = materials(data.colours);
    this.build();
    this.ready = this.open(0);
  }

  build() {
    const names = this.data.scenes.map((scene, i) => [i, scene.name]);
    this.chooser = names.length > 1
      ? select("scene", names, 0, (index) => (this.ready = this.open(Number(index))))
      : element("b", { class: "mv-title" }, names[0][1]);
    const set = (name) => (value) => {
      this.looks[name] = value;
      this.invalidate();
    };
    this.heat = choice("colours", { heat: "Heat map", cloth: "Cloth" }, "heat", (value) => {
      this.looks.heat = value === "heat";
      this.bar.root.classList.toggle("mv-off", !this.looks.heat);
      this.invalidate();
    });
    this.bodyToggle = toggle("Body", "show what wears the cloth", true, set("body"));
    this.followToggle = toggle("Follow", "let the camera walk along", false, (value) => {
      this.follow = value;
      this.invalidate();
    });
    const lines = toggle("Triangles", "show the triangles' sides", false, set("lines"));
    const reset = element("button", { type: "button", class: "mv-button", title: "the view of the beginning (double click)",
      onclick: () => this.orbit.reset() }, "Reset view");
    this.grid = element("div", { class: "mv-panes" });
    this.bar = new ColourBar(this.data.colours, (high) => this.range(high));
    this.play = element("button", { type: "button", class: "mv-button mv-go", onclick: () => this.toggle() });
    this.slider = element("input", { type: "range", min: "0", step: "1", value: "0", class: "mv-slider", "aria-label": "frame",
      oninput: () => this.seek(Number(this.slider.value)) });
    this.label = element("output", { class: "mv-label" });
    const speeds = [[0.1, "0.1×"], [0.25, "0.25×"], [0.5, "0.5×"], [1, "1×"], [2, "2×"]];
    const speed = select("speed", speeds, 1, (value) => (this.speed = Number(value)));
    this.timeline = element("div", { class: "mv-time" }, this.play, this.slider, this.label, speed);
    this.plot = new Plot((frame) => this.seek(frame / this.scene.stride));
    this.note = element("p", { class: "mv-note" });
    this.root.append(
      element("div", { class: "mv-top" }, this.chooser, this.heat, lines, this.bodyToggle, this.followToggle, reset),
      this.grid, this.bar.root, this.timeline, this.plot.svg, this.note);
    this.root.setAttribute("role", "group");
    this.root.setAttribute("aria-label", `frames side by side; ${KEYS}`);
    this.root.addEventListener("keydown", (event) => this.key(event));
    new ResizeObserver(() => this.resized()).observe(this.root);
    this.face();
  }

  async open(index) {
    this.pause();
    const turn = (this.turn = (this.turn ?? 0) + 1);
    const scene = this.data.scenes[index];
    this.root.setAttribute("aria-busy", "true");
    const tracks = await Promise.all(scene.sides.map((side) => Track.open(side.mesh)));
    const body = scene.body && (await Track.open(scene.body));
    if (turn !== this.turn) return; // another scene was chosen meanwhile
    for (const old of [...this.panes.map((pane) => pane.surface), this.body]) old?.dispose();
    Object.assign(this, { scene, tracks, frame: 0, high: scene.high });
    this.body = body && new Surface(body);
    this.frames = tracks[0].length;
    this.chooser.value = index;
    this.survey(tracks[0], body);
    this.fill(scene, tracks);
    this.orbit.home = scene.azimuth;
    this.orbit.reset();
    this.root.removeAttribute("aria-busy");
    this.resized();
    this.seek(0);
  }

  // Where the camera has to look: at the truth in all its frames.
  survey(truth, body) {
    this.boxes = Array.from({ length: truth.length }, (_, t) => truth.box(t));
    const low = [0, 1, 2].map((axis) => Math.min(...this.boxes.map((box) => box.low[axis])));
    const high = [0, 1, 2].map((axis) => Math.max(...this.boxes.map((box) => box.high[axis])));
    this.middle = low.map((value, axis) => (value + high[axis]) / 2);
    this.half = (high[1] - low[1]) / 2 || 0.01;
    const around = (box, centre) =>
      Math.max(...[0, 2].flatMap((axis) => [box.high[axis] - centre[axis], centre[axis] - box.low[axis]]));
    this.still = around({ low, high }, this.middle) || 0.01;
    this.walking = Math.max(...this.boxes.map((box) => around(box, box.centre))) || 0.01;
    this.follow = this.still > 1.25 * this.walking;
    this.floor = body ? Math.min(low[1], ...Array.from({ length: body.length }, (_, t) => body.box(t).low[1])) : null;
  }

  fill(scene, tracks) {
    let used = 0;
    const lines = [];
    this.panes = scene.sides.map((side, i) => {
      const colour = side.means && this.data.series[used++ % this.data.series.length];
      if (side.means) lines.push({ name: side.name, colour, means: side.means });
      const pane = new Pane(side.name, colour, this);
      pane.surface = new Surface(tracks[i]);
      pane.means = side.means;
      return pane;
    });
    this.grid.replaceChildren(...this.panes.map((pane) => pane.root));
    if (!this.stage)
      this.grid.replaceChildren(element("p", { class: "mv-missing", role: "alert" },
        "The frames cannot be drawn: this browser gives the page no WebGL. Another browser, or its hardware acceleration switched on, shows them."));
    this.heat.hidden = this.bar.root.hidden = !lines.length;
    this.bodyToggle.hidden = !this.body;
    this.followToggle.hidden = this.still <= 1.25 * this.walking;
    this.followToggle.setAttribute("aria-pressed", this.follow);
    this.timeline.hidden = this.frames < 2;
    this.slider.max = this.frames - 1;
    this.plot.svg.style.display = lines.length && this.frames > 1 ? "" : "none";
    if (lines.length) this.plot.open(lines, scene.unit, scene.fps);
    this.bar.show(this.high, scene.unit);
    const error = 500 * Math.max(...tracks.map((track) => track.step));
    const kept = scene.stride > 1 ? `One frame in ${scene.stride} of ${scene.frames} is in this page; the plot has all. ` : "";
    this.note.textContent = `${kept}Positions are within ${error.toPrecision(2)} mm of the data. ${MOUSE}`;
    this.note.title = KEYS;
  }

  view(aspect) {
    const centre = this.follow ? this.boxes[this.frame].centre : this.middle;
    const at = new THREE.Vector3(centre[0], this.middle[1], centre[2]);
    return this.orbit.view(at, this.half, this.follow ? this.walking : this.still, aspect, this.floor);
  }

  range(high) {
    this.high = high;
    this.bar.show(high, this.scene.unit);
    this.invalidate();
  }

  seek(frame) {
    this.frame = Math.max(0, Math.min(this.frames - 1, Math.round(frame)));
    const number = this.frame * this.scene.stride;
    const { fps, frames } = this.scene;
    const seconds = fps ? ` · ${(number / fps).toFixed(2)} s` : "";
    this.label.textContent = `frame ${number} / ${frames - 1}${seconds}`;
    this.slider.value = this.frame;
    this.slider.setAttribute("aria-valuetext", this.label.textContent);
    for (const pane of this.panes)
      pane.figure.textContent = pane.means ? `${short(pane.means[number])} ${this.scene.unit}` : "";
    if (this.frames > 1 && this.plot.lines && this.panes.some((pane) => pane.means)) this.plot.show(number);
    this.invalidate();
  }

  // place: {x, y} in [0, 1] of a pane under the mouse; all panes show their value there
  point(x, y) {
    this.place = x === null ? null : { x, y };
    this.reading ??= requestAnimationFrame(() => this.read());
  }

  read() {
    this.reading = null;
    if (this.stage && !this.drawing) for (const pane of this.panes) pane.read(this.stage, this.place);
  }

  resized() {
    if (!this.scene) return;
    const changed = this.panes.map((pane) => pane.fit()).some(Boolean);
    if (this.plot.lines) {
      this.plot.layout();
      if (this.frames > 1) this.plot.show(this.frame * this.scene.stride);
    }
    if (changed) this.draw(); // now: a canvas of a new size is empty
  }

  invalidate() {
    this.drawing ??= requestAnimationFrame(() => this.draw());
  }

  draw() {
    if (this.drawing) cancelAnimationFrame(this.drawing);
    this.drawing = null;
    if (!this.stage || !this.scene) return;
    this.body?.show(this.frame, 1);
    for (const pane of this.panes) pane.draw(this.stage);
    if (this.place) this.read();
  }

  toggle() {
    if (this.running) return this.pause();
    let last = performance.now();
    let clock = this.frame === this.frames - 1 ? 0 : this.frame;
    const step = (now) => {
      if (this.frame !== Math.floor(clock)) clock = this.frame; // someone else moved it
      clock += ((now - last) / 1000) * this.speed * ((this.scene.fps ?? 30) / this.scene.stride);
      last = now;
      if (clock >= this.frames) clock = 0;
      if (Math.floor(clock) !== this.frame) this.seek(Math.floor(clock));
      this.running = requestAnimationFrame(step);
    };
    this.seek(clock);
    this.running = requestAnimationFrame(step);
    this.face();
  }

  pause() {
    if (this.running) cancelAnimationFrame(this.running);
    this.running = null;
    this.face();
  }

  face() {
    this.play.replaceChildren(icon(this.running ? "pause" : "play"));
    this.play.setAttribute("aria-label", this.running ? "pause" : "play");
  }

  key(event) {
    const tag = event.target.tagName;
    if (event.ctrlKey || event.metaKey || event.altKey || tag === "SELECT" || event.target.type === "number") return;
    const steps = { ArrowLeft: -1, ArrowRight: 1, Home: -Infinity, End: Infinity };
    if (this.orbit.key(event)) event.preventDefault();
    else if (event.key in steps && this.frames > 1) {
      event.preventDefault();
      this.pause();
      this.seek(this.frame + steps[event.key]);
    } else if (event.key === " " && tag !== "BUTTON" && this.frames > 1) {
      event.preventDefault();
      this.toggle();
    }
  }

  // For tests and for whoever wants the numbers of a page; side: its place or its name, frame: one that the page has.
  async track(side) {
    await this.ready;
    return this.tracks[typeof side === "string" ? this.scene.sides.findIndex(({ name }) => name === side) : side];
  }

  async positions(side, frame) {
    return (await this.track(side)).positions(frame);
  }

  async values(side, frame) {
    return (await this.track(side)).values(frame);
  }

  async faces(side, frame) {
    const track = await this.track(side);
    return track.faces[track.frames[frame]];
  }
}
