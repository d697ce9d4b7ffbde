// Colours: of layers, of numbers (a perceptually uniform scale), of labels.

/// Viridis (van der Walt and Smith 2015), every 16th.
const kScale = [
  "440154", "48186a", "472d7b", "424086", "3b528b", "33638d", "2c728e", "26828e", "21918c",
  "1fa088", "28ae80", "3fbc73", "5ec962", "84d44b", "addc30", "d8e219", "fde725",
].map(hex => [0, 2, 4].map(i => parseInt(hex.slice(i, i + 2), 16)));

/// sRGB bytes of a share in [0, 1].
export function scaleColor(share) {
  const at = Math.min(Math.max(share, 0), 1) * (kScale.length - 1);
  const i = Math.min(Math.floor(at), kScale.length - 2);
  return kScale[i].map((c, k) => Math.round(c + (at - i) * (kScale[i + 1][k] - c)));
}

/// The scale as RGBA bytes of a row of pixels.
export function scaleRow(width) {
  const row = new Uint8Array(4 * width);
  for (let x = 0; x < width; ++x) {
    row.set([...scaleColor(x / (width - 1)), 255], 4 * x);
  }
  return row;
}

/// Of the taxonomy "atelier"; 255 and others are unknown.
const kLabels = [
  ["background", 0xd9d6cf], ["skin", 0xe0a184], ["hair", 0x5b4636], ["upper", 0x3f7fbf],
  ["lower", 0x5fa35b], ["dress", 0xb0587f], ["outer", 0xd6a13a], ["shoes", 0x6b5fb0],
  ["other", 0x45a3a3],
];

export function labelName(label) {
  return kLabels[label]?.[0] ?? "unknown";
}

export function labelColor(label) {
  const color = kLabels[label]?.[1] ?? 0x8a8a8a;
  return [color >> 16, (color >> 8) & 255, color & 255];
}

export const labelCount = kLabels.length;

const kRoles = {scan: [[196, 190, 180]], body: [[206, 168, 148]], garment: [
  [74, 111, 150], [150, 90, 96], [92, 128, 96], [142, 118, 78]]};

/// sRGB bytes of the n-th layer of a role.
export function roleColor(role, n) {
  const colors = kRoles[role] ?? kRoles.scan;
  return colors[n % colors.length];
}

/// Of panels and other things told apart by number.
export function numberColor(n) {
  const hue = (n * 137.5) % 360;
  return `hsl(${hue}, 38%, 74%)`;  // with commas, as three.js reads it
}
