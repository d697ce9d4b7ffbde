#!/usr/bin/env bash
# npm three 0.187.0: BufferGeometryUtils.mergeVertices with a tolerance of 1 mm, on pairs of vertices that are
# apart by less.
# Guess: vertices that differ by no more than the tolerance become one, as its documentation says.
# Seen: it rounds to a grid of the tolerance: of pairs half a tolerance apart 50% become one, of pairs 0.9
#   apart 10%; which depends on where they lie.
# Valid: 400 pairs at places a fraction of the grid apart; a third vertex far away.
# For users of Atelier: a garment that was cut or exported with its seams doubled and has a noise of half the
#   tolerance stays open along half of each seam. Take a tolerance ten times the noise, or weld by the index of
#   the file (PLY and glTF of Atelier share vertices).
set -euo pipefail
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
echo '{"type": "module"}' > package.json
npm install --prefer-offline --silent --no-audit --no-fund --ignore-scripts three@0.187.0 >/dev/null 2>&1 ||
  { echo "three 0.187.0 cannot be had"; exit 77; }
cat > run.mjs <<'JS'
import { BufferAttribute, BufferGeometry } from 'three';
import { mergeVertices } from 'three/addons/utils/BufferGeometryUtils.js';
const tolerance = 1e-3, pairs = 400;
for (const apart of [0.1, 0.5, 0.9]) {
  let merged = 0;
  for (let i = 0; i < pairs; ++i) {
    const x = 0.3 + 3 * tolerance * i / pairs, half = apart * tolerance / 2;
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array([x - half, 0, 1, x + half, 0, 1, x, 1, 1]), 3));
    merged += mergeVertices(geometry, tolerance).attributes.position.count === 2;
  }
  console.log(`${apart} of the tolerance apart: ${Math.round(100 * merged / pairs)}% merged`);
}
JS
seen=$(node run.mjs)
printf '%s\n' "$seen"
[ "$seen" = '0.1 of the tolerance apart: 90% merged
0.5 of the tolerance apart: 50% merged
0.9 of the tolerance apart: 10% merged' ] || { echo "CHANGED: three merges other vertices than recorded"; exit 1; }
