// One side: its name, its figure of the frame, its picture.

class Pane {
  constructor(name, colour, player) {
    this.player = player;
    this.canvas = element("canvas", { class: "mv-canvas", tabindex: "0", role: "img", "aria-label": `${name}; drag to turn` });
    this.figure = element("span", { class: "mv-figure" });
    this.probe = element("span", { class: "mv-probe", hidden: "" });
    this.hint = element("span", { class: "mv-hint", hidden: "" }, "click first, then the wheel zooms");
    const dot = element("i", { class: "mv-swatch", style: `background: ${colour ?? "transparent"}` });
    this.root = element("div", { class: "mv-pane" },
      element("div", { class: "mv-name" }, dot, element("b", {}, name), this.figure),
      element("div", { class: "mv-picture" }, this.canvas, this.probe, this.hint));
    player.orbit.attach(this.canvas, () => this.remind());
    this.canvas.addEventListener("pointermove", (event) => {
      if (event.pointerType === "mouse") player.point(event.offsetX / this.canvas.clientWidth, event.offsetY / this.canvas.clientHeight);
    });
    this.canvas.addEventListener("pointerleave", () => player.point(null));
  }

  remind() {
    this.hint.hidden = false;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => (this.hint.hidden = true), 1400);
  }

  // Whether the picture has another size than before.
  fit() {
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    const width = Math.round(this.canvas.clientWidth * ratio), height = Math.round(this.canvas.clientHeight * ratio);
    if (this.canvas.width === width && this.canvas.height === height) return false;
    this.canvas.width = width;
    this.canvas.height = height;
    return true;
  }

  get aspect() {
    return this.canvas.width / Math.max(1, this.canvas.height);
  }

  draw(stage) {
    const { player, surface } = this;
    const { looks, body, shades } = player;
    surface.show(player.frame, player.high);
    const group = new THREE.Group();
    const view = player.view(this.aspect);
    const heat = looks.heat && surface.track.levels;
    group.add(surface.mesh(heat ? shades.heat : shades.cloth));
    if (looks.lines) group.add(surface.lines(shades.lines, view.eye));
    if (body && looks.body) group.add(body.mesh(shades.body));
    stage.draw(this.canvas, group, view);
  }

  // Shows the value at a place of the picture, x right and y down in [0, 1]; null hides it.
  read(stage, place) {
    const player = this.player;
    let value = null;
    if (place && player.looks.heat && this.surface.track.levels) {
      stage.place(player.view(this.aspect), this.aspect);
      const raycaster = new THREE.Raycaster();
      raycaster.setFromCamera(new THREE.Vector2(2 * place.x - 1, 1 - 2 * place.y), stage.camera);
      const hit = this.surface.hit(raycaster, player.shades.heat);
      const body = hit && player.looks.body && player.body?.hit(raycaster, player.shades.body);
      if (hit && !(body && body.distance < hit.distance)) value = this.surface.valueAt(hit);
    }
    this.probe.hidden = value === null;
    if (value === null) return;
    this.probe.textContent = `${short(value)} ${player.scene.unit}`;
    this.probe.style.left = `${100 * place.x}%`;
    this.probe.style.top = `${100 * place.y}%`;
    this.probe.classList.toggle("mv-left", place.x > 0.6);
  }
}
