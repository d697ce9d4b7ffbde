// Arithmetic on vertices: what is quicker to compute here than to send.

/// Vertices [frames][V*3] in 16 bits. A file holds how much further each moves from the frame before (in the first
/// frame from 0) than the vertex before does: decoded up to the frame that is asked for, since who plays leaves
/// frames out.
export class CodedFrames {
  constructor(frames, small, large) {
    this.stride = small.length / frames;
    this.small = small;
    this.large = large;
    this.count = frames;
    this.decoded = [];
  }

  /// Bytes of all frames, decoded or not.
  get byteLength() {
    return 2 * this.stride * this.count + this.small.byteLength + this.large.byteLength;
  }

  at(frame) {
    const {stride, small, large, decoded} = this;
    while (decoded.length <= frame) {
      const now = decoded.length > 0 ? decoded.at(-1).slice() : new Uint16Array(stride);
      const begin = decoded.length * stride;
      const further = i => {
        const coded = small[begin + i] | (large[begin + i] << 8);
        return (coded >>> 1) ^ -(coded & 1);
      };
      let x = 0, y = 0, z = 0;  // motion of the vertex
      for (let i = 0; i < stride; i += 3) {
        now[i] += x += further(i);
        now[i + 1] += y += further(i + 1);
        now[i + 2] += z += further(i + 2);
      }
      decoded.push(now);
    }
    return decoded[frame];
  }

  all() {
    return Array.from({length: this.count}, (_, f) => this.at(f));
  }
}

/// Places in metres, of 16 bits.
export function toMetres(quantized, low, step, out) {
  for (let i = 0; i < quantized.length; i += 3) {
    out[i] = low[0] + step * quantized[i];
    out[i + 1] = low[1] + step * quantized[i + 1];
    out[i + 2] = low[2] + step * quantized[i + 2];
  }
}

/// Unit normals of vertices, of the faces around them by area.
export function vertexNormals(places, faces, out) {
  out.fill(0);
  for (let f = 0; f < faces.length; f += 3) {
    const a = 3 * faces[f], b = 3 * faces[f + 1], c = 3 * faces[f + 2];
    const ux = places[b] - places[a], uy = places[b + 1] - places[a + 1], uz = places[b + 2] - places[a + 2];
    const vx = places[c] - places[a], vy = places[c + 1] - places[a + 1], vz = places[c + 2] - places[a + 2];
    const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
    out[a] += x; out[a + 1] += y; out[a + 2] += z;
    out[b] += x; out[b + 1] += y; out[b + 2] += z;
    out[c] += x; out[c + 1] += y; out[c + 2] += z;
  }
  for (let i = 0; i < out.length; i += 3) {
    const length = Math.sqrt(out[i] * out[i] + out[i + 1] * out[i + 1] + out[i + 2] * out[i + 2]) || 1;
    out[i] /= length; out[i + 1] /= length; out[i + 2] /= length;
  }
}

/// Strain of each face: the larger principal stretch less 1, of the deformation from the rest
/// shape, whose inverse edges [F*4] are given.
export function faceStrain(places, faces, rest) {
  const strain = new Float32Array(faces.length / 3);
  for (let f = 0; f < strain.length; ++f) {
    const a = 3 * faces[3 * f], b = 3 * faces[3 * f + 1], c = 3 * faces[3 * f + 2];
    const p = rest[4 * f], q = rest[4 * f + 1], r = rest[4 * f + 2], s = rest[4 * f + 3];
    let xx = 0, xy = 0, yy = 0;
    for (let k = 0; k < 3; ++k) {
      const u = places[b + k] - places[a + k], v = places[c + k] - places[a + k];
      const x = u * p + v * r, y = u * q + v * s;
      xx += x * x; xy += x * y; yy += y * y;
    }
    const half = (xx + yy) / 2;
    const root = Math.sqrt((xx - yy) * (xx - yy) / 4 + xy * xy);
    strain[f] = p === 0 ? 0 : Math.sqrt(half + root) - 1;
  }
  return strain;
}

/// The mean of the faces around each vertex.
export function faceToVertex(values, faces, vertices) {
  const sum = new Float32Array(vertices), count = new Uint16Array(vertices);
  for (let f = 0; f < values.length; ++f) {
    for (let k = 0; k < 3; ++k) {
      sum[faces[3 * f + k]] += values[f];
      ++count[faces[3 * f + k]];
    }
  }
  for (let v = 0; v < vertices; ++v) {
    sum[v] /= count[v] || 1;
  }
  return sum;
}

/// Pairs of vertices that a face joins, each once but for those at a border, which may be left out.
export function edgesOf(faces) {
  const edges = [];
  for (let f = 0; f < faces.length; f += 3) {
    for (let k = 0; k < 3; ++k) {
      const a = faces[f + k], b = faces[f + (k + 1) % 3];
      if (a < b) {
        edges.push(3 * a, 3 * b);
      }
    }
  }
  return Uint32Array.from(edges);
}

/// Lengths of edges, in metres.
export function edgeLengths(quantized, edges, step) {
  const lengths = new Float32Array(edges.length / 2);
  for (let i = 0; i < lengths.length; ++i) {
    const a = edges[2 * i], b = edges[2 * i + 1];
    const x = quantized[a] - quantized[b], y = quantized[a + 1] - quantized[b + 1], z = quantized[a + 2] - quantized[b + 2];
    lengths[i] = step * Math.sqrt(x * x + y * y + z * z);
  }
  return lengths;
}

/// The largest difference of an edge's length to its mean in the frames before and after: a torn
/// frame stands out, however fast all of it moves. @return {value, at: which edge}
export function largestDeviation(now, before, after) {
  let value = 0, at = 0;
  for (let i = 0; i < now.length; ++i) {
    const deviation = Math.abs(now[i] - (before[i] + after[i]) / 2);
    if (deviation > value) {
      value = deviation;
      at = i;
    }
  }
  return {value, at};
}

/// The same of the first or the last frame: to the nearer of the two beside it, of which one may be
/// torn itself.
export function deviationAtEnd(now, next, second) {
  let value = 0, at = 0;
  for (let i = 0; i < now.length; ++i) {
    const deviation = Math.min(Math.abs(now[i] - next[i]), Math.abs(now[i] - second[i]));
    if (deviation > value) {
      value = deviation;
      at = i;
    }
  }
  return {value, at};
}

/// Panel of each face: pieces of the flat pattern that hang together.
export function panelsOf(faces, points) {
  const parent = Uint32Array.from({length: points}, (_, i) => i);
  const root = i => {
    while (parent[i] !== i) {
      parent[i] = parent[parent[i]];
      i = parent[i];
    }
    return i;
  };
  for (let i = 0; i < faces.length; i += 3) {
    parent[root(faces[i + 1])] = root(faces[i]);
    parent[root(faces[i + 2])] = root(faces[i]);
  }
  const numbers = new Map();
  const panels = new Uint16Array(faces.length / 3);
  for (let f = 0; f < panels.length; ++f) {
    const r = root(faces[3 * f]);
    if (!numbers.has(r)) {
      numbers.set(r, numbers.size);
    }
    panels[f] = numbers.get(r);
  }
  return {panels, count: numbers.size};
}
