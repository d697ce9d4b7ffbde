// Where what is shown stands, and from where it is seen well.

/// The box of the layers that have a mesh, or else of where the cameras of captures stand; null: of neither.
export function boundsOf(layers, captures) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  const add = (x, y, z) => [x, y, z].forEach((p, k) => {
    low[k] = Math.min(low[k], p);
    high[k] = Math.max(high[k], p);
  });
  for (const {places} of layers) {
    for (let i = 0; i < (places?.length ?? 0); i += 3) {
      add(places[i], places[i + 1], places[i + 2]);
    }
  }
  const ofCameras = low[0] > high[0];
  if (ofCameras) {
    captures.forEach(cameras => cameras?.cameras.forEach((_, c) => add(...cameras.centre(c))));
  }
  return low[0] <= high[0] ? {low, high, ofCameras} : null;
}

/// The mean of places [V*3].
export function middleOf(places) {
  const sum = [0, 0, 0];
  places.forEach((value, i) => { sum[i % 3] += value; });
  return sum.map(value => 3 * value / places.length);
}

/// Azimuth of the view from the front, a little from the side, of who stands there: across the shoulders, to the
/// side of the toes, which are before the shins. null: there is nobody, or that does not tell.
export function frontOf(layers) {
  const places = ["body", "scan"].map(role => layers.find(layer => layer.info.role === role && layer.places)?.places).find(Boolean);
  if (!places) {
    return null;
  }
  let low = Infinity, high = -Infinity;
  for (let i = 1; i < places.length; i += 3) {
    low = Math.min(low, places[i]);
    high = Math.max(high, places[i]);
  }
  // Mean and covariance, from above, of what is between shares of the height.
  const slab = (from, to) => {
    let x = 0, z = 0, xx = 0, xz = 0, zz = 0, count = 0;
    for (let i = 0; i < places.length; i += 3) {
      const share = (places[i + 1] - low) / (high - low), p = places[i], q = places[i + 2];
      if (share >= from && share < to) {
        x += p; z += q; xx += p * p; xz += p * q; zz += q * q;
        ++count;
      }
    }
    x /= count; z /= count;
    return {x, z, xx: xx / count - x * x, xz: xz / count - x * z, zz: zz / count - z * z};
  };
  const toes = slab(0, 0.03), shins = slab(0.07, 0.14), shoulders = slab(0.72, 0.86);
  const x = toes.x - shins.x, z = toes.z - shins.z;
  if (!(Math.hypot(x, z) > 0.01 * (high - low))) {
    return null;
  }
  const {xx, xz, zz} = shoulders;
  const spread = Math.hypot(xx - zz, 2 * xz);  // of the variances along and across the shoulders, the difference
  if (!(spread > 0.5 * (xx + zz))) {
    return Math.atan2(x, z) + kAside;
  }
  const along = Math.atan2(2 * xz, xx - zz) / 2;
  const across = [Math.sin(along), -Math.cos(along)];
  const side = Math.sign(across[0] * x + across[1] * z) || 1;
  return Math.atan2(side * across[0], side * across[1]) + kAside;
}

const kAside = 0.45;

/// Where who stands there casts a shadow: x, z, and how dark it is.
export function feetOf(layers) {
  const isShown = layer => layer.places && layer.shownFrame !== null;
  const layer = layers.find(one => one.info.role === "body" && isShown(one)) ?? layers.find(isShown);
  if (!layer) {
    return [0, 0, 0];
  }
  let x = 0, z = 0, count = 0, lowest = Infinity;
  for (let i = 0; i < layer.places.length; i += 30) {
    x += layer.places[i];
    z += layer.places[i + 2];
    lowest = Math.min(lowest, layer.places[i + 1]);
    ++count;
  }
  return [x / count, z / count, Math.max(0, 1 - 3 * Math.abs(lowest))];
}
