// A camera on a sphere around what it looks at, common to all panes; drag, wheel, fingers and keys move it.

const POLE = 1.5; // radians: never quite above
const ELEVATION = 0.12;

class Orbit {
  constructor(changed) {
    this.changed = changed;
    this.azimuth = this.home = 0;
    this.reset();
  }

  reset() {
    this.azimuth = this.home;
    this.elevation = ELEVATION;
    this.zoom = 1;
    this.pan = new THREE.Vector3();
    this.changed();
  }

  turn(right, up) {
    this.azimuth -= right;
    this.elevation = Math.max(-POLE, Math.min(POLE, this.elevation + up));
    this.changed();
  }

  scale(factor) {
    this.zoom = Math.max(0.1, Math.min(20, this.zoom * factor));
    this.changed();
  }

  // right and up in units of the picture's height
  shift(right, up) {
    const height = this.height;
    const sine = Math.sin(this.elevation), cosine = Math.cos(this.elevation);
    const [x, z] = [Math.sin(this.azimuth), Math.cos(this.azimuth)];
    this.pan.add(new THREE.Vector3(z, 0, -x).multiplyScalar(-right * height));
    this.pan.add(new THREE.Vector3(-x * sine, cosine, -z * sine).multiplyScalar(-up * height));
    this.changed();
  }

  // centre: THREE.Vector3; half, radius: half the height and the largest radius of what is to be seen; metres
  view(centre, half, radius, aspect, floor) {
    const slope = Math.tan((FIELD_OF_VIEW * Math.PI) / 360);
    const distance = ((1.08 * Math.max(half, radius / aspect)) / slope + radius) / this.zoom;
    this.height = 2 * slope * distance; // metres that the picture shows where the target is
    const target = centre.clone().add(this.pan);
    const level = Math.cos(this.elevation);
    const away = new THREE.Vector3(
      level * Math.sin(this.azimuth), Math.sin(this.elevation), level * Math.cos(this.azimuth),
    );
    return { target, eye: target.clone().addScaledVector(away, distance), reach: Math.max(half, radius), floor };
  }

  // Listens to a canvas. The wheel belongs to the page until the pane has the focus, and so does a finger that
  // moves up or down (touch-action: pan-y).
  attach(canvas, hint) {
    const pointers = new Map();
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("dblclick", () => this.reset());
    canvas.addEventListener("pointerdown", (event) => {
      canvas.focus({ preventScroll: true });
      canvas.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, event);
    });
    const release = (event) => pointers.delete(event.pointerId);
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
    canvas.addEventListener("pointermove", (event) => {
      const last = pointers.get(event.pointerId);
      if (!last) return;
      const height = canvas.clientHeight || 1;
      const others = [...pointers.values()].filter((other) => other.pointerId !== event.pointerId);
      const x = (event.clientX - last.clientX) / height, y = (event.clientY - last.clientY) / height;
      pointers.set(event.pointerId, event);
      if (others.length) {
        const apart = (one) => Math.hypot(one.clientX - others[0].clientX, one.clientY - others[0].clientY) || 1;
        this.scale(apart(event) / apart(last));
        this.shift(x / 2, -y / 2); // the other finger does the other half
      } else if (event.shiftKey || last.buttons & 6) this.shift(x, -y);
      else this.turn(3.2 * x, 3.2 * y);
    });
    canvas.addEventListener(
      "wheel",
      (event) => {
        if (!event.ctrlKey && document.activeElement !== canvas) return hint();
        event.preventDefault();
        const lines = event.deltaMode === 1 ? 24 : 1;
        this.scale(Math.exp(-0.0016 * lines * Math.max(-200, Math.min(200, event.deltaY))));
      },
      { passive: false },
    );
  }

  // Whether the key moved the camera: with shift the arrows turn it; + and - zoom, 0 resets.
  key(event) {
    const turns = { ArrowLeft: [-0.15, 0], ArrowRight: [0.15, 0], ArrowUp: [0, 0.15], ArrowDown: [0, -0.15] };
    if (event.shiftKey && turns[event.key]) this.turn(...turns[event.key]);
    else if (event.key === "+" || event.key === "=") this.scale(1.2);
    else if (event.key === "-") this.scale(1 / 1.2);
    else if (event.key === "0") this.reset();
    else return false;
    return true;
  }
}
