#!/usr/bin/env bash
# quaternion 2.2.0 and @thi.ng/matrices 3.0.26 beside gl-matrix 3.4.4 (npm).
# Guess: fromEuler(a, b, c, 'ZXY') takes the angles about x, y and z and the order apart from them,
#   as gl-matrix and three do.
# Seen: quaternion and @thi.ng/matrices take the angles in the order of the letters: the first is
#   about Z. Only XYZ agrees. The same call with the same word is 14 to 36 degrees apart at
#   (30, 40, 50) degrees; with the angles sorted by the letters all agree.
# For users of Atelier: BVH channels (ZXY, ZYX, ...) handed to these packages by x, y, z are wrong
#   in every order but XYZ, with no sign but the pose.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
echo '{"type": "module"}' > package.json
npm install --no-audit --no-fund --ignore-scripts --silent quaternion@2.2.0 \
  @thi.ng/matrices@3.0.26 gl-matrix@3.4.4 \
  > npm.log 2>&1 || { echo "the npm packages cannot be had"; exit 77; }

# Valid: angles within (-90, 90) degrees, orders that the packages name in their types.
cat > seen.js <<'JS'
import Quaternion from 'quaternion';
import {quatFromEuler} from '@thi.ng/matrices';
import {quat} from 'gl-matrix';
const angles = [30, 40, 50].map((a) => a * Math.PI / 180);
const axes = {X: [1, 2], Y: [2, 0], Z: [0, 1]};
const turn = (axis, angle) => {  // 3x3 in rows
  const m = [[1, 0, 0], [0, 1, 0], [0, 0, 1]], [i, j] = axes[axis];
  m[i][i] = m[j][j] = Math.cos(angle);
  m[j][i] = Math.sin(angle);
  m[i][j] = -m[j][i];
  return m;
};
const product = (a, b) => a.map((row) => [0, 1, 2].map(
    (j) => row.reduce((sum, x, k) => sum + x * b[k][j], 0)));
const inOrder = (order) => [...order].map((axis) => turn(axis, angles['XYZ'.indexOf(axis)]))
    .reduce(product);
const matrixOf = ([x, y, z, w]) => [
  [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
  [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
  [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]];
const apart = (a, b) => {  // degrees
  const trace = a.flat().reduce((sum, x, i) => sum + x * b.flat()[i], 0);
  return (Math.acos(Math.max(-1, Math.min(1, (trace - 1) / 2))) * 180 / Math.PI).toFixed(1);
};
const by = (word) => [...word].map((axis) => angles['XYZ'.indexOf(axis)]);
for (const order of ['XYZ', 'XZY', 'YXZ', 'YZX', 'ZXY', 'ZYX']) {
  const off = (q) => apart(matrixOf(q), inOrder(order));
  const raw = (three) => {
    const q = Quaternion.fromEuler(...three, order);
    return [q.x, q.y, q.z, q.w];
  };
  const thing = (three) => [...quatFromEuler(order.toLowerCase(), ...three)];
  const gl = quat.fromEuler([0, 0, 0, 1], 30, 40, 50, order.toLowerCase());
  console.log(`${order}: gl-matrix off by ${off(gl)}, quaternion ${off(raw(angles))}, ` +
      `@thi.ng ${off(thing(angles))}; sorted ${off(raw(by(order)))} ${off(thing(by(order)))}`);
}
JS
seen=$(node seen.js)
printf '%s\n' "$seen"
expected='XYZ: gl-matrix off by 0.0, quaternion 0.0, @thi.ng 0.0; sorted 0.0 0.0
XZY: gl-matrix off by 0.0, quaternion 14.1, @thi.ng 14.1; sorted 0.0 0.0
YXZ: gl-matrix off by 0.0, quaternion 14.1, @thi.ng 14.1; sorted 0.0 0.0
YZX: gl-matrix off by 0.0, quaternion 17.7, @thi.ng 17.7; sorted 0.0 0.0
ZXY: gl-matrix off by 0.0, quaternion 19.2, @thi.ng 19.2; sorted 0.0 0.0
ZYX: gl-matrix off by 0.0, quaternion 36.2, @thi.ng 36.2; sorted 0.0 0.0'
if [ "$seen" != "$expected" ]; then
  echo "CHANGED: the order of Euler arguments is otherwise than recorded"
  exit 1
fi
