#!/usr/bin/env bash
# gl-matrix 3.4.4 quat.rotationTo, @math.gl/core 4.1.0, wgpu-matrix 3.4.2 and cannon-es 0.20.0
# (npm): the rotation that takes one unit vector to another.
# Guess: right for every pair, opposite vectors included; these functions treat that case.
# Seen: gl-matrix, math.gl and wgpu-matrix return the identity for turns below 0.081 degrees (dot
#   above 0.999999): a bone swinging 9.6 degrees a second at 120 Hz never moves when its frames are
#   summed. Opposite vectors: wgpu-matrix returns a quaternion of length 6e-17, cannon-es one of
#   length 0.8 for (0.6, 0.8, 0). "half way" is the right one, written out.
# For users of Atelier: swings from frame to frame of a slow motion need atan2 of cross and dot.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
echo '{"type": "module"}' > package.json
npm install --no-audit --no-fund --ignore-scripts --silent gl-matrix@3.4.4 @math.gl/core@4.1.0 \
  wgpu-matrix@3.4.2 cannon-es@0.20.0 \
  > npm.log 2>&1 || { echo "the npm packages cannot be had"; exit 77; }

# Valid: unit vectors, as each function asks for.
cat > seen.js <<'JS'
import {quat as gl, glMatrix} from 'gl-matrix';
import {Quaternion as MathGl} from '@math.gl/core';
import {quat as wgpu} from 'wgpu-matrix';
import {Quaternion as Cannon, Vec3} from 'cannon-es';
glMatrix.setMatrixArrayType(Array);
const readers = {
  'half way': (u, v) => {  // right but at opposite vectors
    const q = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0],
               1 + u[0] * v[0] + u[1] * v[1] + u[2] * v[2]];
    const length = Math.hypot(...q);
    return length > 0 ? q.map((x) => x / length) : [u[1], -u[0], 0, 0];
  },
  'gl-matrix': (u, v) => gl.rotationTo([], u, v),
  'math.gl': (u, v) => [...new MathGl().rotationTo(u, v)],
  'wgpu-matrix': (u, v) => [...wgpu.rotationTo(u, v)],
  'cannon-es': (u, v) => new Cannon().setFromVectors(new Vec3(...u), new Vec3(...v)).toArray(),
};
const at = (degrees) => [Math.cos(degrees * Math.PI / 180), Math.sin(degrees * Math.PI / 180), 0];
const turn = (q) => (2 * Math.atan2(Math.hypot(q[0], q[1], q[2]), q[3]) * 180 / Math.PI);
for (const [name, f] of Object.entries(readers)) {
  let sum = 0;
  for (let frame = 0; frame < 1000; ++frame) {
    sum += turn(f(at(frame * 0.08), at((frame + 1) * 0.08)));
  }
  const opposite = [[1, 0, 0], [0.6, 0.8, 0]].map(
      (u) => Math.hypot(...f(u, u.map((x) => -x))).toFixed(2));
  console.log(`${name}: 0.09 -> ${turn(f(at(0), at(0.09))).toFixed(2)}, ` +
              `1000 steps of 0.08 -> ${sum.toFixed(0)} degrees, lengths at opposite ${opposite}`);
}
JS
seen=$(node seen.js)
printf '%s\n' "$seen"
expected='half way: 0.09 -> 0.09, 1000 steps of 0.08 -> 80 degrees, lengths at opposite 1.00,1.00
gl-matrix: 0.09 -> 0.09, 1000 steps of 0.08 -> 0 degrees, lengths at opposite 1.00,1.00
math.gl: 0.09 -> 0.09, 1000 steps of 0.08 -> 0 degrees, lengths at opposite 1.00,1.00
wgpu-matrix: 0.09 -> 0.09, 1000 steps of 0.08 -> 0 degrees, lengths at opposite 0.00,0.00
cannon-es: 0.09 -> 0.09, 1000 steps of 0.08 -> 80 degrees, lengths at opposite 1.00,0.80'
if [ "$seen" != "$expected" ]; then
  echo "CHANGED: rotations between two vectors are otherwise than recorded"
  exit 1
fi
