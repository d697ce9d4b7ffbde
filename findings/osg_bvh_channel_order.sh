#!/usr/bin/env bash
# OpenSceneGraph 3.6.5+dfsg1-8+b2 of Debian 12 (osgconv) reads a BVH whose joints say "Xrotation Yrotation
# Zrotation"; its quaternion is compared with the product of the three turns (which three 0.187.0 and Babylon
# 9.28.0 give for the same file).
# Guess: the reader follows the order of the CHANNELS line, as the format says; at worst it refuses others.
# Seen: it takes the first number as Z, the second as X and the third as Y whatever CHANNELS says, and always
#   composes Z, X, Y. X30 Y40 Z50 comes out as a turn that is 37.98 degrees off; no warning. A file in the
#   order Z, X, Y, whose joint is 30 40 50 too, is read right to 1e-4 degrees.
# For users of Atelier: a motion shown by OpenSceneGraph is right only when the BVH turns in the order ZXY;
#   positions, times and lengths are right in both, so nothing else gives the fault away.
set -euo pipefail
. "$(dirname "$(realpath "$0")")/debian.sh"
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
debian_packages openscenegraph=3.6.5+dfsg1-8+b2
[ ! -d debian/root ] || export OSG_LIBRARY_PATH=$work/debian/root/usr/lib/x86_64-linux-gnu

cat > make.mjs <<'JS'
// Valid by the format's description: the CHANNELS line names the order of the numbers, and a joint's turn is
// the product of its turns in that order (the first named stands leftmost).
import { writeFileSync } from 'node:fs';
for (const order of ['XYZ', 'ZXY']) {
  const turns = [...order].map((axis) => `${axis}rotation`).join(' ');
  writeFileSync(`${order}.bvh`, `HIERARCHY\nROOT Hips\n{\n\tOFFSET 0 0 0\n` +
    `\tCHANNELS 6 Xposition Yposition Zposition ${turns}\n\tEnd Site\n\t{\n\t\tOFFSET 0 10 0\n\t}\n}\n` +
    `MOTION\nFrames: 2\nFrame Time: 0.01\n1 2 3 30 40 50\n1 2 3 30 40 50\n`);
}
JS
cat > compare.mjs <<'JS'
import { readFileSync } from 'node:fs';
const axisTurn = (axis, degrees) => {
  const half = degrees * Math.PI / 360, s = Math.sin(half);
  return [axis === 'X' ? s : 0, axis === 'Y' ? s : 0, axis === 'Z' ? s : 0, Math.cos(half)];
};
const product = ([a, b, c, d], [e, f, g, h]) => [
  d * e + a * h + b * g - c * f, d * f - a * g + b * h + c * e, d * g + a * f - b * e + c * h, d * h - a * e - b * f - c * g];
let failed = false;
for (const [order, recorded] of [['XYZ', 37.98], ['ZXY', 0]]) {
  const truth = [...order].map((axis, i) => axisTurn(axis, [30, 40, 50][i])).reduce(product);
  const text = readFileSync(`${order}.osgt`, 'utf8');
  const keys = [...text.matchAll(/^\s+0 (\S+) (\S+) (\S+) (\S+) *$/gm)].map((m) => m.slice(1).map(Number));
  const dot = truth.reduce((sum, value, i) => sum + value * keys[0][i], 0);
  const angle = 2 * Math.acos(Math.min(1, Math.abs(dot))) * 180 / Math.PI;
  console.log(`${order}: OpenSceneGraph is ${angle.toFixed(2)} degrees off`);
  if (Math.abs(angle - recorded) > 0.02) failed = true;
}
if (failed) { console.log('changed: recorded were 37.98 and 0.00 degrees'); process.exit(1); }
JS
node make.mjs
for order in XYZ ZXY; do osgconv $order.bvh $order.osgt >/dev/null 2>&1; done
node compare.mjs
