// One WebGL context for every pane of every viewer in the page: a pane is drawn here and copied to its own canvas.

const FIELD_OF_VIEW = 24; // degrees, vertical
const BODY = 0xc4beb8, CLOTH = 0x5585bd, LINES = 0x0b1622;

class Stage {
  static shared() {
    if (Stage.only === undefined) {
      try {
        Stage.only = new Stage();
      } catch (error) {
        Stage.only = null;
        console.info(`muslin viewer: no WebGL (${error.message})`);
      }
    }
    return Stage.only;
  }

  constructor() {
    this.renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true, powerPreference: "high-performance" });
    this.renderer.setClearColor(0x000000, 0);
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    this.camera = new THREE.PerspectiveCamera(FIELD_OF_VIEW, 1, 0.05, 100);
    this.scene = new THREE.Scene();
    this.sky = new THREE.HemisphereLight(0xffffff, 0x77716b, 1.25);
    this.key = new THREE.DirectionalLight(0xfff4e6, 2.5);
    this.fill = new THREE.DirectionalLight(0xdde8ff, 0.6);
    this.key.castShadow = true;
    this.key.shadow.mapSize.set(1024, 1024);
    this.key.shadow.radius = 3;
    this.floor = new THREE.Mesh(new THREE.CircleGeometry(1, 64), new THREE.ShadowMaterial({ opacity: 0.22 }));
    this.floor.rotation.x = -Math.PI / 2;
    this.floor.receiveShadow = true;
    this.scene.add(this.sky, this.key, this.key.target, this.fill, this.fill.target, this.floor);
    this.renderer.domElement.addEventListener("webglcontextrestored", () => {
      for (const viewer of muslinViewers) viewer.invalidate();
    });
  }

  // view: {target, eye: THREE.Vector3, reach: metres seen around the target, floor: its height or null}
  draw(canvas, group, view) {
    const { width, height } = canvas;
    if (!width || !height) return;
    const size = this.renderer.getSize(new THREE.Vector2());
    if (width > size.x || height > size.y)
      this.renderer.setSize(Math.max(width, size.x), Math.max(height, size.y), false);
    this.place(view, width / height);
    this.scene.add(group);
    const room = this.renderer.getSize(size).y;
    this.renderer.setViewport(0, room - height, width, height); // three measures from the bottom
    this.renderer.setScissor(0, room - height, width, height);
    this.renderer.setScissorTest(true);
    this.renderer.render(this.scene, this.camera);
    this.scene.remove(group);
    const context = canvas.getContext("2d");
    context.clearRect(0, 0, width, height);
    context.drawImage(this.renderer.domElement, 0, 0, width, height, 0, 0, width, height);
  }

  place(view, aspect) {
    const { eye, target, reach } = view;
    const camera = this.camera;
    camera.aspect = aspect;
    camera.position.copy(eye);
    camera.lookAt(target);
    const distance = eye.distanceTo(target);
    camera.near = Math.max(distance / 200, distance - 6 * reach);
    camera.far = distance + 12 * reach;
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
    // The lights turn with the camera, so that no side of the cloth stays in the dark.
    const side = new THREE.Vector3().subVectors(eye, target).setY(0).normalize();
    const across = new THREE.Vector3(side.z, 0, -side.x);
    const at = (forward, right, up) =>
      target.clone().addScaledVector(side, forward * reach).addScaledVector(across, right * reach)
        .add(new THREE.Vector3(0, up * reach, 0));
    this.key.position.copy(at(2.7, -1.9, 2.5));
    this.fill.position.copy(at(1.5, 3, 0.8));
    this.key.target.position.copy(target);
    this.fill.target.position.copy(target);
    const shadow = this.key.shadow;
    const box = shadow.camera;
    if (box.right !== 2 * reach) {
      box.left = box.bottom = -2 * reach;
      box.right = box.top = 2 * reach;
      box.near = 0.2 * reach;
      box.far = 9 * reach;
      box.updateProjectionMatrix();
      shadow.normalBias = 0.012 * reach;
      shadow.bias = -0.0006;
    }
    this.floor.visible = view.floor !== null;
    this.floor.position.set(target.x, view.floor ?? 0, target.z);
    this.floor.scale.setScalar(8 * reach);
  }
}
