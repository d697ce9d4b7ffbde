// Draws meshes without a GPU: what a browser's own stand-in for one takes for each of a mesh's many
// small triangles, it takes for all of this. Lit at the vertices, by the light of layer.js.

/// Light from above and below, a key light, a little on the rim: on a vertex's front, or its back.
function lightOf(nx, ny, nz, key, viewer, shade, isBack, out) {
  const side = isBack ? -1 : 1;
  const k = Math.max(side * (nx * key.x + ny * key.y + nz * key.z), 0);
  const rim = 1 - Math.abs(nx * viewer.x + ny * viewer.y + nz * viewer.z);
  const edge = 0.1 * rim * rim * rim;
  const dim = isBack ? 0.62 : 1;
  out[0] = Math.sqrt(dim * (1 + shade * (0.4 + 0.1 * side * ny + 0.62 * k + edge - 1)));
  out[1] = Math.sqrt(dim * (1 + shade * (0.4 + 0.11 * side * ny + 0.6 * k + edge - 1)));
  out[2] = Math.sqrt(dim * (1 + shade * (0.405 + 0.125 * side * ny + 0.57 * k + edge - 1)));
}

/// Bytes [V*3] of what is seen of each vertex, as numbers: colour by light.
function shadesOf({normals, tints, base}, {key, viewer, shade}, isBack, out) {
  const light = [0, 0, 0];
  let [r, g, b] = base;
  for (let i = 0; i < normals.length; i += 3) {
    lightOf(normals[i], normals[i + 1], normals[i + 2], key, viewer, shade, isBack, light);
    if (tints) {
      r = tints[i];
      g = tints[i + 1];
      b = tints[i + 2];
    }
    out[i] = Math.min(255 * r * light[0], 255);
    out[i + 1] = Math.min(255 * g * light[1], 255);
    out[i + 2] = Math.min(255 * b * light[2], 255);
  }
}

/// Pixels from the left and the bottom, and depths as of WebGL; no numbers for what is behind the viewer.
function toScreen(places, m, width, height, out, box) {
  for (let i = 0; i < places.length; i += 3) {
    const x = places[i], y = places[i + 1], z = places[i + 2];
    const w = m[3] * x + m[7] * y + m[11] * z + m[15];
    const scale = w > 1e-6 ? 0.5 / w : NaN;
    const px = ((m[0] * x + m[4] * y + m[8] * z + m[12]) * scale + 0.5) * width;
    const py = ((m[1] * x + m[5] * y + m[9] * z + m[13]) * scale + 0.5) * height;
    out[i] = px;
    out[i + 1] = py;
    out[i + 2] = (m[2] * x + m[6] * y + m[10] * z + m[14]) * scale + 0.5;
    if (px < box.left) box.left = px;
    if (px > box.right) box.right = px;
    if (py < box.bottom) box.bottom = py;
    if (py > box.top) box.top = py;
  }
}

/// Fills the triangles of one mesh where they are nearest: pixels whose centre they cover.
/// @param back  shades of the other side; null: that is not drawn
/// @param scale  null, or {shares [V], row}: the colours of a scale, which the shades darken
/// @param texture  null, or {width, height, colors, corners [F*3*2]}: an image, rows from the top, which they darken
function fill(screen, {faces, scale, texture}, front, back, {left, bottom, width, height, colors, depths}) {
  const kEdge = -1e-7;  // a pixel between two triangles is one's at least
  for (let f = 0; f < faces.length; f += 3) {
    const a = 3 * faces[f];
    let b = 3 * faces[f + 1], c = 3 * faces[f + 2];
    const ax = screen[a] - left, ay = screen[a + 1] - bottom;
    let bx = screen[b] - left, by = screen[b + 1] - bottom, cx = screen[c] - left, cy = screen[c + 1] - bottom;
    let area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay);
    let shades = front, second = f + 1, third = f + 2;
    if (!(area > 0)) {
      if (back === null || !(area < 0)) {
        continue;
      }
      shades = back;
      area = -area;
      let swap = b; b = c; c = swap;
      swap = bx; bx = cx; cx = swap;
      swap = by; by = cy; cy = swap;
      second = f + 2;
      third = f + 1;
    }
    let low = ax < bx ? ax : bx, high = ax > bx ? ax : bx;
    low = low < cx ? low : cx;
    high = high > cx ? high : cx;
    const first = Math.max(Math.ceil(low - 0.5), 0), last = Math.min(Math.floor(high - 0.5), width - 1);
    if (first > last) {
      continue;
    }
    low = ay < by ? ay : by;
    high = ay > by ? ay : by;
    low = low < cy ? low : cy;
    high = high > cy ? high : cy;
    const firstRow = Math.max(Math.ceil(low - 0.5), 0), lastRow = Math.min(Math.floor(high - 0.5), height - 1);
    if (firstRow > lastRow) {
      continue;
    }
    // Weights of b and c, which change evenly along x and y.
    const inverse = 1 / area;
    const bdx = (cy - ay) * inverse, bdy = (ax - cx) * inverse, cdx = (ay - by) * inverse, cdy = (bx - ax) * inverse;
    const az = screen[a + 2], bz = screen[b + 2] - az, cz = screen[c + 2] - az;
    const zdx = bz * bdx + cz * cdx;
    const dx = first + 0.5 - ax;
    for (let row = firstRow; row <= lastRow; ++row) {
      const dy = row + 0.5 - ay;
      let wb = bdx * dx + bdy * dy, wc = cdx * dx + cdy * dy;
      let z = az + bz * wb + cz * wc;
      let at = row * width + first;
      for (let x = first; x <= last; ++x, ++at, wb += bdx, wc += cdx, z += zdx) {
        if (wb >= kEdge && wc >= kEdge && wb + wc <= 1 - kEdge && z < depths[at] && z >= 0) {
          const wa = 1 - wb - wc;
          depths[at] = z;
          let red = wa * shades[a] + wb * shades[b] + wc * shades[c];
          let green = wa * shades[a + 1] + wb * shades[b + 1] + wc * shades[c + 1];
          let blue = wa * shades[a + 2] + wb * shades[b + 2] + wc * shades[c + 2];
          if (scale !== null) {
            const {shares, row: colorsOfScale} = scale;
            const share = wa * shares[a / 3] + wb * shares[b / 3] + wc * shares[c / 3];
            const entry = 4 * Math.round(255 * Math.min(Math.max(share, 0), 1));
            red *= colorsOfScale[entry] / 255;
            green *= colorsOfScale[entry + 1] / 255;
            blue *= colorsOfScale[entry + 2] / 255;
          }
          if (texture !== null) {
            const {corners, width: wide, height: high} = texture;
            const u = wa * corners[2 * f] + wb * corners[2 * second] + wc * corners[2 * third];
            const v = wa * corners[2 * f + 1] + wb * corners[2 * second + 1] + wc * corners[2 * third + 1];
            const column = Math.min(Math.max(Math.floor(u * wide), 0), wide - 1);
            const texel = texture.colors[Math.min(Math.max(Math.floor((1 - v) * high), 0), high - 1) * wide + column];
            red *= (texel & 255) / 255;
            green *= ((texel >> 8) & 255) / 255;
            blue *= ((texel >> 16) & 255) / 255;
          }
          colors[at] = 0xff000000 | blue << 16 | green << 8 | red;
        }
      }
    }
  }
}

/// Of 2 x 2 samples each one pixel, with the share that is covered as alpha, and the nearest depth.
function average(fine, out) {
  for (let y = 0; y < out.height; ++y) {
    let at = y * out.width, from = 2 * y * fine.width;
    for (let x = 0; x < out.width; ++x, ++at, from += 2) {
      let r = 0, g = 0, b = 0, count = 0, depth = 1;
      for (let k = 0; k < 4; ++k) {
        const sample = from + (k & 1) + (k >> 1) * fine.width;
        const color = fine.colors[sample];
        if (color !== 0) {
          ++count;
          r += color & 255;
          g += (color >> 8) & 255;
          b += (color >> 16) & 255;
          depth = Math.min(depth, fine.depths[sample]);
        }
      }
      out.depths[at] = depth;
      out.colors[at] = count === 0 ? 0 : (255 * count / 4) << 24 | (b / count) << 16 | (g / count) << 8 | (r / count);
    }
  }
}

/// Colours (RGBA bytes) and depths of a rectangle of a picture, rows from the bottom.
class Rectangle {
  constructor() {
    this.left = this.bottom = this.width = this.height = 0;
    this.colors = new Uint32Array(0);
    this.depths = new Float32Array(0);
  }

  set(left, bottom, width, height) {
    Object.assign(this, {left, bottom});
    if (this.width !== width || this.height !== height) {
      Object.assign(this, {width, height, colors: new Uint32Array(width * height), depths: new Float32Array(width * height)});
    }
    this.colors.fill(0);
    this.depths.fill(1);
  }
}

export class Rasterizer {
  constructor() {
    this.picture = new Rectangle();
    this.fine = new Rectangle();
    this.scratch = [];  // of each mesh
  }

  /// Draws meshes into `picture`, as large as what they cover.
  /// @param meshes  [{places, normals, faces, base, tints or null, scale and texture as for fill, closed: its inside is
  ///                not seen, light: {key, viewer, shade}}]
  /// @param matrix  from the world to clip coordinates, 16 numbers by columns
  /// @param samples  along each side of a pixel: 1 or 2
  draw(meshes, matrix, width, height, samples = 1) {
    const box = {left: Infinity, right: -Infinity, bottom: Infinity, top: -Infinity};
    meshes.forEach((mesh, i) => {
      const size = mesh.places.length;
      if (this.scratch[i]?.screen.length !== size) {
        const numbers = () => new Float32Array(size);
        this.scratch[i] = {screen: numbers(), front: numbers(), back: numbers()};
      }
      toScreen(mesh.places, matrix, width, height, this.scratch[i].screen, box);
    });
    const kStep = 64;  // px; the size of a texture seldom changes
    const begin = (low, most) => Math.min(Math.max(Math.floor(low), 0), most);
    const left = begin(box.left, width), bottom = begin(box.bottom, height);
    const size = (from, high, most) => Math.min(Math.ceil((begin(high + 1, most) - from + 1) / kStep) * kStep, most);
    const columns = box.left <= box.right ? size(left, box.right, width) : 1;
    const rows = box.left <= box.right ? size(bottom, box.top, height) : 1;
    this.picture.set(Math.min(left, width - columns), Math.min(bottom, height - rows), columns, rows);
    const target = samples === 1 ? this.picture : this.fine;
    if (samples > 1) {
      const {left: x, bottom: y} = this.picture;
      this.fine.set(samples * x, samples * y, samples * columns, samples * rows);
    }
    meshes.forEach((mesh, i) => {
      const {screen, front, back} = this.scratch[i];
      if (samples > 1) {
        for (let k = 0; k < screen.length; k += 3) {
          screen[k] *= samples;
          screen[k + 1] *= samples;
        }
      }
      shadesOf(mesh, mesh.light, false, front);
      if (!mesh.closed) {
        shadesOf(mesh, mesh.light, true, back);
      }
      fill(screen, mesh, front, mesh.closed ? null : back, target);
    });
    if (samples > 1) {
      average(this.fine, this.picture);
    }
    return this.picture;
  }
}
