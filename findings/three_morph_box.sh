#!/usr/bin/env bash
# npm three 0.187.0: the box of a mesh sequence, ten morph targets of which each is one frame.
# Guess: Box3.setFromObject gives what is shown, or at worst the union of all frames.
# Seen: it adds up all targets, as if every frame were shown at once: a triangle that moves 1 m in ten frames
#   has a box that is 6.5 m wide, and a bounding sphere of 3.29 m instead of 0.71 m. With `precise` set the box
#   is that of the frame shown. Nothing is drawn wrongly.
# Valid: glTF 2.0, 3.7.2.2: weights of a sequence are 0 but for one; three's own vertices (getVertexPosition,
#   which the precise box goes by) are those of the frame.
# For users of Atelier: viewers that set their camera by the box or by the sphere of a garment with 60 targets
#   stand much too far away, and its frustum culling never culls. setFromObject(mesh, true), or frame the body.
set -euo pipefail
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
echo '{"type": "module"}' > package.json
npm install --prefer-offline --silent --no-audit --no-fund --ignore-scripts three@0.187.0 >/dev/null 2>&1 ||
  { echo "three 0.187.0 cannot be had"; exit 77; }
cat > run.mjs <<'JS'
import { Box3, BufferAttribute, BufferGeometry, Mesh } from 'three';
const triangle = new BufferGeometry();
triangle.setAttribute('position', new BufferAttribute(new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0]), 3));
triangle.morphTargetsRelative = true;  // as GLTFLoader makes them
triangle.morphAttributes.position = [];
for (let frame = 1; frame <= 10; ++frame) {
  const offset = new Float32Array(9);
  for (let vertex = 0; vertex < 3; ++vertex) offset[3 * vertex] = frame / 10;
  triangle.morphAttributes.position.push(new BufferAttribute(offset, 3));
}
const mesh = new Mesh(triangle);
mesh.morphTargetInfluences.fill(0);
mesh.morphTargetInfluences[4] = 1;  // the fifth: moved by 0.5
const wide = ({ min, max }) => `${min.x.toFixed(2)} to ${max.x.toFixed(2)}`;
console.log(`box ${wide(new Box3().setFromObject(mesh))}, precise ${wide(new Box3().setFromObject(mesh, true))}`);
console.log(`sphere ${triangle.boundingSphere?.radius.toFixed(2) ?? (triangle.computeBoundingSphere(), triangle.boundingSphere.radius.toFixed(2))}`);
JS
seen=$(node run.mjs)
printf '%s\n' "$seen"
[ "$seen" = 'box 0.00 to 6.50, precise 0.50 to 1.50
sphere 3.29' ] || { echo "CHANGED: three makes other boxes of morph targets than recorded"; exit 1; }
