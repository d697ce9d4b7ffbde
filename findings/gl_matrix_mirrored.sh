#!/usr/bin/env bash
# gl-matrix 3.4.4 mat4.getScaling, getRotation, getTranslation (npm).
# Guess: a mirrored transform (scale -1 1 1) taken apart and put together again is itself.
# Seen: gl-matrix's scale is always positive, so the mirror is lost, and its rotation is not a
#   unit quaternion (length 0.711 here); put together again elements are off by up to 1.66. With
#   the determinant's sign put on x (as three does) it comes back.
# For users of Atelier: left and right halves of a body or a garment piece that are instanced by a
#   negative scale do not survive gl-matrix's three getters; check the determinant first.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
echo '{"type": "module"}' > package.json
npm install --no-audit --no-fund --ignore-scripts --silent gl-matrix@3.4.4 \
  > npm.log 2>&1 || { echo "the npm package cannot be had"; exit 77; }

# Valid: a rotation, a translation and a scale, joined by gl-matrix itself; no shear.
cat > seen.js <<'JS'
import {glMatrix, mat4, quat} from 'gl-matrix';
glMatrix.setMatrixArrayType(Array);
const turned = quat.fromEuler([0, 0, 0, 1], 20, 30, 40);
for (const scale of [[1, 1, 1], [-1, 1, 1]]) {
  const whole = mat4.fromRotationTranslationScale([], turned, [1, 2, 3], scale);
  const off = (other) => Math.max(...whole.map((x, i) => Math.abs(x - other[i])));
  const rotation = mat4.getRotation([], whole);
  const again = mat4.fromRotationTranslationScale(
      [], rotation, mat4.getTranslation([], whole), mat4.getScaling([], whole));
  const signed = mat4.getScaling([], whole);  // the sign of the determinant on x
  signed[0] *= Math.sign(mat4.determinant(whole));
  const plain = mat4.scale([], whole, signed.map((x) => 1 / x));
  const repaired = mat4.fromRotationTranslationScale(
      [], mat4.getRotation([], plain), mat4.getTranslation([], whole), signed);
  console.log(`scale ${scale}: gl-matrix scale ${mat4.getScaling([], whole).map((x) => x.toFixed(0))}` +
      `, quaternion of length ${Math.hypot(...rotation).toFixed(3)}, off by ${off(again).toFixed(2)}` +
      `; with the sign on x ${off(repaired).toFixed(2)}`);
}
JS
seen=$(node seen.js)
printf '%s\n' "$seen"
expected='scale 1,1,1: gl-matrix scale 1,1,1, quaternion of length 1.000, off by 0.00; with the sign on x 0.00
scale -1,1,1: gl-matrix scale 1,1,1, quaternion of length 0.711, off by 1.66; with the sign on x 0.00'
if [ "$seen" != "$expected" ]; then
  echo "CHANGED: gl-matrix takes mirrored matrices apart otherwise than recorded"
  exit 1
fi
