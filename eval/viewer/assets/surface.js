// A moving surface in three.js: shaded cloth or heat map, its triangles' sides, and rays against it.

const NEARER = 0.001;

// Vertex normals, the sum of the triangles' normals by area.
function computeNormals(positions, faces, normals) {
  normals.fill(0);
  for (let f = 0; f < faces.length; f += 3) {
    const a = 3 * faces[f], b = 3 * faces[f + 1], c = 3 * faces[f + 2];
    const ux = positions[b] - positions[a], uy = positions[b + 1] - positions[a + 1];
    const uz = positions[b + 2] - positions[a + 2], vx = positions[c] - positions[a];
    const vy = positions[c + 1] - positions[a + 1], vz = positions[c + 2] - positions[a + 2];
    const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
    for (const i of [a, b, c]) {
      normals[i] += x;
      normals[i + 1] += y;
      normals[i + 2] += z;
    }
  }
  for (let i = 0; i < normals.length; i += 3) {
    const length = Math.hypot(normals[i], normals[i + 1], normals[i + 2]) || 1;
    normals[i] /= length;
    normals[i + 1] /= length;
    normals[i + 2] /= length;
  }
}

// Pairs of vertices, each side of a triangle once.
function sides(faces, count) {
  const seen = new Set();
  const pairs = [];
  for (let f = 0; f < faces.length; f += 3)
    for (let k = 0; k < 3; k++) {
      const a = faces[f + k], b = faces[f + ((k + 1) % 3)];
      const key = Math.min(a, b) * count + Math.max(a, b);
      if (seen.has(key)) continue;
      seen.add(key);
      pairs.push(a, b);
    }
  return new Uint32Array(pairs);
}

// Colours of the heat map as a texture of 256 texels; stops are sRGB in [0, 1], at equal steps.
function heatTexture(stops) {
  const texels = new Uint8Array(256 * 4);
  for (let i = 0; i < 256; i++) {
    const place = (i / 255) * (stops.length - 1);
    const k = Math.min(Math.floor(place), stops.length - 2);
    for (let c = 0; c < 3; c++)
      texels[4 * i + c] = Math.round(255 * (stops[k][c] + (place - k) * (stops[k + 1][c] - stops[k][c])));
    texels[4 * i + 3] = 255;
  }
  const texture = new THREE.DataTexture(texels, 256, 1);
  texture.colorSpace = THREE.SRGBColorSpace;
  texture.magFilter = texture.minFilter = THREE.LinearFilter;
  texture.needsUpdate = true;
  return texture;
}

function materials(stops) {
  const common = { side: THREE.DoubleSide, shadowSide: THREE.DoubleSide };
  const map = heatTexture(stops);
  return {
    cloth: new THREE.MeshLambertMaterial({ ...common, color: CLOTH }),
    // More than half of its light is its own, so that a fold's shade does not pass for another colour of the bar.
    heat: new THREE.MeshLambertMaterial({ ...common, color: 0xb0b0b0, map, emissive: 0xc2c2c2, emissiveMap: map }),
    body: new THREE.MeshLambertMaterial({ color: BODY }),
    lines: new THREE.LineBasicMaterial({ color: LINES, transparent: true, opacity: 0.42 }),
  };
}

class Surface {
  constructor(track) {
    this.track = track;
    this.topology = -1;
    this.frame = -1;
  }

  // Brings the geometry to a frame. Meshes that show it are made by mesh() and lines().
  show(t, high) {
    const frame = Math.min(t, this.track.length - 1);
    if (this.frame === frame && this.high === high) return;
    this.frame = frame;
    this.high = high;
    const kind = this.track.frames[frame];
    if (kind !== this.topology) this.rebuild(kind);
    const { position, normal, uv } = this.geometry.attributes;
    this.track.positions(frame, position.array);
    computeNormals(position.array, this.track.faces[kind], normal.array);
    position.needsUpdate = normal.needsUpdate = true;
    this.geometry.boundingSphere = null;
    if (this.track.levels) {
      const values = (this.current = this.track.values(frame));
      for (let i = 0; i < values.length; i++) uv.array[2 * i] = (Math.min(values[i] / high, 1) * 255 + 0.5) / 256;
      uv.needsUpdate = true;
    }
  }

  rebuild(kind) {
    this.dispose();
    this.topology = kind;
    const count = this.track.sizes[kind];
    const attribute = (size) => new THREE.BufferAttribute(new Float32Array(size * count), size);
    this.geometry = new THREE.BufferGeometry();
    this.geometry.setAttribute("position", attribute(3));
    this.geometry.setAttribute("normal", attribute(3));
    this.geometry.setAttribute("uv", attribute(2));
    this.geometry.setIndex(new THREE.BufferAttribute(this.track.faces[kind], 1));
    this.edges = null;
  }

  mesh(material) {
    const mesh = new THREE.Mesh(this.geometry, material);
    mesh.frustumCulled = false;
    mesh.castShadow = mesh.receiveShadow = true;
    return mesh;
  }

  // The triangles' sides, brought nearer to the eye along the rays by a thousandth, so that they do not sink into
  // the cloth. (An offset of the cloth's own depth would let the body show through where the cloth is seen edge on.)
  lines(material, eye) {
    if (!this.edges) {
      this.edges = new THREE.BufferGeometry();
      this.edges.setAttribute("position", this.geometry.attributes.position);
      const pairs = sides(this.track.faces[this.topology], this.track.sizes[this.topology]);
      this.edges.setIndex(new THREE.BufferAttribute(pairs, 1));
    }
    const lines = new THREE.LineSegments(this.edges, material);
    lines.frustumCulled = false;
    lines.scale.setScalar(1 - NEARER);
    lines.position.copy(eye).multiplyScalar(NEARER);
    return lines;
  }

  // Where a ray first meets this surface: {distance, point, face}, or undefined.
  hit(raycaster, material) {
    return this.geometry && raycaster.intersectObject(this.mesh(material), false)[0];
  }

  // The value at such a place.
  valueAt({ face, point }) {
    const at = (i) => new THREE.Vector3().fromBufferAttribute(this.geometry.attributes.position, i);
    const [a, b, c] = [at(face.a), at(face.b), at(face.c)];
    const area = (p, q, r) => q.clone().sub(p).cross(r.clone().sub(p)).length();
    const whole = area(a, b, c) || 1;
    const [wa, wb] = [area(point, b, c) / whole, area(a, point, c) / whole];
    const [va, vb, vc] = [face.a, face.b, face.c].map((i) => this.current[i]);
    return Math.max(0, wa * va + wb * vb + (1 - wa - wb) * vc);
  }

  dispose() {
    this.geometry?.dispose();
    this.edges?.dispose();
    this.geometry = this.edges = null;
  }
}
