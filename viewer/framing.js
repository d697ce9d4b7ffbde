// Where what is shown stands, and from where it is seen well.

/// The box of the layers that have a mesh, or else of where the cameras stand; null: of neither.
export function boundsOf(layers, cameras) {
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
    cameras?.cameras.forEach((_, c) => add(...cameras.centre(c)));
  }
  return low[0] <= high[0] ? {low, high, ofCameras} : null;
}

/// The mean of places [V*3].
export function middleOf(places) {
  const sum = [0, 0, 0];
  places.forEach((value, i) => { sum[i % 3] += value; });
  return sum.map(value => 3 * value / places.length);
}

/// Azimuth of the view from the front, a little from the side, of a body that stands: toes are
/// before shins. null: there is none, or that does not tell.
export function frontOf(layers) {
  const places = layers.find(layer => layer.info.role === "body" && layer.places)?.places;
  if (!places) {
    return null;
  }
  let low = Infinity, high = -Infinity;
  for (let i = 1; i < places.length; i += 3) {
    low = Math.min(low, places[i]);
    high = Math.max(high, places[i]);
  }
  const middle = (from, to) => {
    let x = 0, z = 0, count = 0;
    for (let i = 0; i < places.length; i += 3) {
      const share = (places[i + 1] - low) / (high - low);
      if (share >= from && share < to) {
        x += places[i];
        z += places[i + 2];
        ++count;
      }
    }
    return [x / count, z / count];
  };
  const toes = middle(0, 0.025), shins = middle(0.07, 0.14);
  const x = toes[0] - shins[0], z = toes[1] - shins[1];
  return Math.hypot(x, z) > 0.02 * (high - low) ? Math.atan2(x, z) + 0.45 : null;
}

/// Puts under who stands there: x, z, and how dark the shadow is.
export function feetOf(layers, feet) {
  const isShown = layer => layer.places && layer.shownFrame !== null;
  const layer = layers.find(one => one.info.role === "body" && isShown(one)) ?? layers.find(isShown);
  if (!layer) {
    feet.z = 0;
    return;
  }
  let x = 0, z = 0, count = 0, lowest = Infinity;
  for (let i = 0; i < layer.places.length; i += 30) {
    x += layer.places[i];
    z += layer.places[i + 2];
    lowest = Math.min(lowest, layer.places[i + 1]);
    ++count;
  }
  feet.set(x / count, z / count, Math.max(0, 1 - 3 * Math.abs(lowest)));
}
