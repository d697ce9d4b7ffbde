#!/usr/bin/env bash
# @math.gl/core 4.1.0 (npm): class Euler, beside the product of three matrices.
# Guess: Euler(x, y, z, order).toQuaternion() and .getRotationMatrix() are the same rotation.
# Seen: toQuaternion() pays no heed to the order: all six orders give the quaternion of ZYX, while
#   the matrix of the same object follows the order as it must. At (30, 40, 50) degrees the two
#   are up to 44.9 degrees apart.
# For users of Atelier: joint angles of a motion that go through this class must be turned into
#   matrices, never into its quaternions, unless their order is ZYX.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
echo '{"type": "module"}' > package.json
npm install --no-audit --no-fund --ignore-scripts --silent @math.gl/core@4.1.0 \
  > npm.log 2>&1 || { echo "the npm package cannot be had"; exit 77; }

# Valid: angles within (-90, 90) degrees, the class's own names of orders.
cat > seen.js <<'JS'
import {Euler, Matrix4} from '@math.gl/core';
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
for (const order of ['XYZ', 'XZY', 'YXZ', 'YZX', 'ZXY', 'ZYX']) {
  const euler = new Euler(...angles, Euler[order]);
  const quaternion = matrixOf([...euler.toQuaternion()]);
  const e = [...euler.getRotationMatrix(new Matrix4())];
  const matrix = [[e[0], e[4], e[8]], [e[1], e[5], e[9]], [e[2], e[6], e[10]]];
  console.log(`${order}: matrix to true ${apart(matrix, inOrder(order))}, ` +
              `quaternion to matrix ${apart(quaternion, matrix)} degrees`);
}
JS
seen=$(node seen.js)
printf '%s\n' "$seen"
expected='XYZ: matrix to true 0.0, quaternion to matrix 44.9 degrees
XZY: matrix to true 0.0, quaternion to matrix 30.0 degrees
YXZ: matrix to true 0.0, quaternion to matrix 39.9 degrees
YZX: matrix to true 0.0, quaternion to matrix 33.2 degrees
ZXY: matrix to true 0.0, quaternion to matrix 20.3 degrees
ZYX: matrix to true 0.0, quaternion to matrix 0.0 degrees'
if [ "$seen" != "$expected" ]; then
  echo "CHANGED: the orders of @math.gl/core's Euler behave otherwise than recorded"
  exit 1
fi
