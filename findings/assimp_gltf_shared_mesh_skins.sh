#!/usr/bin/env bash
# assimp-utils 5.2.5~ds0-1+b1 of Debian 12 on a glTF of two bodies that share one mesh, each with its own skin.
# Guess: as in glTF, where the skin belongs to the node: two meshes come out, each bound to its own joints.
# Seen: one mesh comes out, bound to the joints of the second node alone; both nodes show it. The first body's
#   joints are in the tree, its animation may play, but no vertex hangs on them: body A stands where B is.
#   Vertex (0 2 0) of body A, bound to a joint turned by 90 degrees, belongs at (0 1 3); by assimp's bones
#   it is at (10 2 0), in the other body. No warning, exit status 0.
# For users of Atelier: two people of one template, or an avatar shown twice, need a mesh each (accessors
#   may be shared) before assimp, or what is built on it as Open3D is, reads the file.
set -euo pipefail
. "$(dirname "$(realpath "$0")")/debian.sh"
command -v node >/dev/null || { echo "needs node"; exit 77; }
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
debian_packages assimp-utils=5.2.5~ds0-1+b1
cat > make.mjs <<'JS'
// Valid: glTF 2.0, sections 3.7.3 and 3.7.4: many nodes may show one mesh, and the skin is the node's; nothing
// bars two skins for a mesh. gltf-validator 2.0.0-dev.3.10 finds nothing; three 0.187.0, Babylon 9.28.0, VTK 9.1 and
// Blender 3.4.1 put vertex 2 of body A at (0 1 3) and that of body B at (10 2 0).
import { writeFileSync } from 'node:fs';
const parts = [
  new Float32Array([0, 0, 0, 1, 0, 0, 0, 2, 0]),
  new Uint8Array([0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0]),
  new Float32Array([1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]),
  new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -1, 0, 1]),
].map((a) => Buffer.from(a.buffer));
let at = 0;
const bufferViews = parts.map((p) => { at += p.length; return { buffer: 0, byteOffset: at - p.length, byteLength: p.length }; });
const half = Math.SQRT1_2;
writeFileSync('two.gltf', JSON.stringify({
  asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0, 1, 3, 4] }],
  buffers: [{ byteLength: at, uri: 'data:application/octet-stream;base64,' + Buffer.concat(parts).toString('base64') }],
  bufferViews,
  accessors: [
    { bufferView: 0, componentType: 5126, count: 3, type: 'VEC3', min: [0, 0, 0], max: [1, 2, 0] },
    { bufferView: 1, componentType: 5121, count: 3, type: 'VEC4' },
    { bufferView: 2, componentType: 5126, count: 3, type: 'VEC4' },
    { bufferView: 3, componentType: 5126, count: 2, type: 'MAT4' }],
  meshes: [{ primitives: [{ attributes: { POSITION: 0, JOINTS_0: 1, WEIGHTS_0: 2 } }] }],
  skins: [{ joints: [1, 2], inverseBindMatrices: 3 }, { joints: [4, 5], inverseBindMatrices: 3 }],
  nodes: [
    { name: 'body A', mesh: 0, skin: 0 }, { name: 'hips A', translation: [0, 0, 2], children: [2] },
    { name: 'knee A', translation: [0, 1, 0], rotation: [half, 0, 0, half] },
    { name: 'body B', mesh: 0, skin: 1 }, { name: 'hips B', translation: [10, 0, 0], children: [5] },
    { name: 'knee B', translation: [0, 1, 0] }],
}));
JS
cat > read.mjs <<'JS'
import { readFileSync } from 'node:fs';
const scene = JSON.parse(readFileSync('scene.json', 'utf8'));
const bones = scene.meshes.map((mesh) => mesh.bones.map((bone) => bone.name).join(' and '));
const users = scene.rootnode.children.filter((node) => node.meshes).map((node) => `${node.name} shows mesh ${node.meshes}`);
const seen = `${scene.meshes.length} mesh on ${bones}; ${users.join(', ')}`;
console.log(seen);
const recorded = '1 mesh on hips B and knee B; body A shows mesh 0, body B shows mesh 0';
if (seen !== recorded) { console.log(`changed: recorded was ${recorded}`); process.exit(1); }
JS
node make.mjs
assimp export two.gltf scene.json -fassjson >/dev/null
node read.mjs
