#!/usr/bin/env bash
# npm three 0.187.0: the box of a mesh sequence, ten morph targets of which each is one frame, as GLTFLoader has
# loaded it and after geometry.computeBoundingBox().
# Guess: a box of what is shown, or at worst of all frames; computing it again changes nothing.
# Seen: a triangle that moves 1 m in ten frames stands at 0.5 to 1.5. Loaded, its box is -1 to 2; computed again
#   (also by center() and whatever merges or rewrites the geometry) it is 0 to 6.5, the sum of all targets.
#   setFromObject(mesh, true) goes by the vertices and has 0.5 to 1.5.
# Valid: glTF 2.0, 3.7.2.2; all weights are 0 but one, as in a sequence.
# For users of Atelier: a viewer that prepares the geometry of a garment with 60 targets and then sets its camera by
#   the box stands many times too far away. setFromObject(mesh, true), or frame the body.
set -euo pipefail
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
echo '{"type": "module"}' > package.json
npm install --prefer-offline --silent --no-audit --no-fund --ignore-scripts three@0.187.0 >/dev/null 2>&1 ||
  { echo "three 0.187.0 cannot be had"; exit 77; }
cat > run.mjs <<'JS'
import { Box3 } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
globalThis.self = globalThis;
globalThis.ProgressEvent = class {};
const targets = Array.from({ length: 10 }, (_, i) => (i + 1) / 10);
const arrays = [[0, 0, 0, 1, 0, 0, 0, 1, 0], ...targets.map((x) => [x, 0, 0, x, 0, 0, x, 0, 0])];
const data = Buffer.from(new Float32Array(arrays.flat()).buffer);
const gltf = {
  asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }],
  meshes: [{ weights: targets.map((x) => Number(x === 0.5)),
    primitives: [{ attributes: { POSITION: 0 }, targets: targets.map((_, i) => ({ POSITION: i + 1 })) }] }],
  buffers: [{ byteLength: data.length, uri: 'data:application/octet-stream;base64,' + data.toString('base64') }],
  bufferViews: arrays.map((_, i) => ({ buffer: 0, byteOffset: 36 * i, byteLength: 36 })),
  accessors: arrays.map((_, i) => ({ bufferView: i, componentType: 5126, count: 3, type: 'VEC3',
    min: [i / 10, 0, 0], max: i ? [i / 10, 0, 0] : [1, 1, 0] })),
};
const { scene } = await new GLTFLoader().parseAsync(JSON.stringify(gltf), '');
scene.updateMatrixWorld(true);
const wide = (precise) => {
  const { min, max } = new Box3().setFromObject(scene, precise);
  return `${min.x.toFixed(2)} to ${max.x.toFixed(2)}`;
};
console.log(`shown ${wide(true)}, loaded ${wide(false)}`);
scene.children[0].geometry.computeBoundingBox();
console.log(`computed again ${wide(false)}`);
JS
seen=$(node run.mjs)
printf '%s\n' "$seen"
[ "$seen" = 'shown 0.50 to 1.50, loaded -1.00 to 2.00
computed again 0.00 to 6.50' ] || { echo "CHANGED: three makes other boxes of morph targets than recorded"; exit 1; }
