#!/usr/bin/env bash
# cannon-es 0.20.0 (npm): Quaternion.setFromEuler and Quaternion.toEuler.
# Guess: with default arguments the second undoes the first.
# Seen: setFromEuler turns in the order XYZ by default, toEuler reads YZX and knows no other:
#   (30, 40, 50) degrees come back as (51.0, -2.9, 60.5). setFromEuler(..., 'YZX') comes back.
# For users of Atelier: angles of a ragdoll read back for a motion file are in YZX; write the
#   channels in that order, or go through the quaternion.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
echo '{"type": "module"}' > package.json
npm install --no-audit --no-fund --ignore-scripts --silent cannon-es@0.20.0 \
  > npm.log 2>&1 || { echo "the npm package cannot be had"; exit 77; }

# Valid: angles within (-90, 90) degrees, far from gimbal lock in both orders.
cat > seen.js <<'JS'
import {Quaternion, Vec3} from 'cannon-es';
const angles = [30, 40, 50].map((a) => a * Math.PI / 180);
for (const order of [undefined, 'XYZ', 'YZX']) {
  const q = new Quaternion();
  q.setFromEuler(...angles, order);
  const back = new Vec3();
  q.toEuler(back);
  console.log(`set by ${order ?? 'default'}: read back ` +
      [back.x, back.y, back.z].map((a) => (a * 180 / Math.PI).toFixed(1)).join(' '));
}
JS
seen=$(node seen.js)
printf '%s\n' "$seen"
expected='set by default: read back 51.0 -2.9 60.5
set by XYZ: read back 51.0 -2.9 60.5
set by YZX: read back 30.0 40.0 50.0'
if [ "$seen" != "$expected" ]; then
  echo "CHANGED: cannon-es reads Euler angles back otherwise than recorded"
  exit 1
fi
