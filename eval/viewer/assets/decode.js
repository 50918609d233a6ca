// Unpacks moving surfaces; encode.py says how they were packed.

async function unpack(text, size) {
  const characters = atob(text);
  const packed = new Uint8Array(characters.length);
  for (let i = 0; i < packed.length; i++) packed[i] = characters.charCodeAt(i);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer());
  const count = planes.length / size;
  const numbers = new (size === 1 ? Uint8Array : size === 2 ? Uint16Array : Uint32Array)(count);
  for (let plane = 0; plane < size; plane++)
    for (let i = 0; i < count; i++) numbers[i] |= planes[plane * count + i] << (8 * plane);
  return numbers;
}

const unzigzag = (number) => (number >>> 1) ^ -(number & 1);

// Turns residuals into whole numbers in place. The arrays' own type takes them mod 2^8 or mod 2^16.
// starts[t] is where frame t begins, an axis has vertices(t) entries.
function integrate(numbers, frames, starts, axes, vertices) {
  for (let t = 0; t < frames.length; t++) {
    const count = vertices(t);
    const before = t > 0 && frames[t] === frames[t - 1] ? starts[t - 1] : -1;
    for (let axis = 0; axis < axes; axis++) {
      let change = 0;
      const start = starts[t] + axis * count;
      for (let i = 0; i < count; i++) {
        change += unzigzag(numbers[start + i]);
        numbers[start + i] = change + (before < 0 ? 0 : numbers[before + axis * count + i]);
      }
    }
  }
}

// A moving surface: any frame's positions, values and faces.
class Track {
  static async open(data) {
    const track = new Track();
    track.frames = data.frames;
    track.low = data.low;
    track.step = data.step;
    track.top = data.top;
    track.sizes = data.topologies.map((topology) => topology.vertices);
    track.faces = await Promise.all(
      data.topologies.map(async (topology) => {
        const faces = await unpack(topology.data, 4);
        let last = 0;
        for (let i = 0; i < faces.length; i++) faces[i] = last += unzigzag(faces[i]);
        return faces;
      }),
    );
    const vertices = (t) => track.vertices(t);
    track.starts = [0];
    for (let t = 0; t < data.frames.length; t++) track.starts.push(track.starts[t] + vertices(t));
    track.quantised = await unpack(data.positions, 2);
    integrate(track.quantised, data.frames, track.starts.map((start) => 3 * start), 3, vertices);
    track.levels = data.values === null ? null : await unpack(data.values, 1);
    if (track.levels) integrate(track.levels, data.frames, track.starts, 1, vertices);
    return track;
  }

  get length() {
    return this.frames.length;
  }

  vertices(t) {
    return this.sizes[this.frames[t]];
  }

  // metres, x y z of one vertex after the other
  positions(t, out = new Float64Array(3 * this.vertices(t))) {
    const count = this.vertices(t);
    for (let axis = 0; axis < 3; axis++) {
      const start = 3 * this.starts[t] + axis * count;
      for (let i = 0; i < count; i++) out[3 * i + axis] = this.low[axis] + this.step * this.quantised[start + i];
    }
    return out;
  }

  values(t, out = new Float64Array(this.vertices(t))) {
    if (!this.levels) return null;
    const start = this.starts[t];
    for (let i = 0; i < out.length; i++) out[i] = this.top * (this.levels[start + i] / 255) ** 2;
    return out;
  }

  // {low, high, centre} of a frame, metres
  box(t) {
    const count = this.vertices(t);
    const box = { low: [], high: [], centre: [] };
    for (let axis = 0; axis < 3; axis++) {
      let low = 65535, high = 0, sum = 0;
      const start = 3 * this.starts[t] + axis * count;
      for (let i = start; i < start + count; i++) {
        const q = this.quantised[i];
        sum += q;
        if (q < low) low = q;
        if (q > high) high = q;
      }
      box.low.push(this.low[axis] + this.step * low);
      box.high.push(this.low[axis] + this.step * high);
      box.centre.push(this.low[axis] + (this.step * sum) / count);
    }
    return box;
  }
}
