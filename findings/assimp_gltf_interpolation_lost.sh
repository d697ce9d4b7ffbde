#!/usr/bin/env bash
# assimp-utils 5.2.5~ds0-1+b1 of Debian 12: a glTF with STEP and CUBICSPLINE samplers goes through
# `assimp export in.gltf out.glb`, and the samplers of what it wrote are read back.
# Guess: assimp keeps the interpolation, or samples the curve so that the motion stays.
# Seen: both come out as LINEAR between the bare keys; tangents are dropped. Half-way between keys 0 and 1 a
#   STEP of 0 has become 0.5; a spline at 1.25 m stands at 0.5 m, so 75 cm off; it swung to 1.41 m at
#   three quarters, where the line has 0.75. Exit status 0, no warning.
# For users of Atelier: motion goes through assimp unharmed only with linear samplers (which Atelier's own
#   dense frames have); a mesh sequence as STEP weights turns into cross-fades of neighbouring frames.
set -euo pipefail
. "$(dirname "$(realpath "$0")")/debian.sh"
command -v node >/dev/null || { echo "needs node"; exit 77; }
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
debian_packages assimp-utils=5.2.5~ds0-1+b1
cat > make.mjs <<'JS'
// Valid: glTF 2.0, appendix C: STEP has one value a key, CUBICSPLINE three (in-tangent, value, out-tangent).
// gltf-validator 2.0.0-dev.3.10 finds nothing; three 0.187.0, Babylon 9.28.0, VTK 9.1 and playcanvas 2.23.3
// read 1.25 at half a second from the spline.
import { writeFileSync } from 'node:fs';
const file = (path, interpolation, values) => {
  const parts = [[0, 0, 0, 1, 0, 0, 0, 1, 0], [0, 1, 2], values].map((a) => Buffer.from(new Float32Array(a).buffer));
  let at = 0;
  const bufferViews = parts.map((p) => { at += p.length; return { buffer: 0, byteOffset: at - p.length, byteLength: p.length }; });
  writeFileSync(path, JSON.stringify({
    asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ name: 'pelvis', mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 } }] }],
    buffers: [{ byteLength: at, uri: 'data:application/octet-stream;base64,' + Buffer.concat(parts).toString('base64') }],
    bufferViews,
    accessors: [
      { bufferView: 0, componentType: 5126, count: 3, type: 'VEC3', min: [0, 0, 0], max: [1, 1, 0] },
      { bufferView: 1, componentType: 5126, count: 3, type: 'SCALAR', min: [0], max: [2] },
      { bufferView: 2, componentType: 5126, count: values.length / 3, type: 'VEC3' }],
    animations: [{ samplers: [{ input: 1, output: 2, interpolation }],
                   channels: [{ sampler: 0, target: { node: 0, path: 'translation' } }] }],
  }));
};
file('STEP.gltf', 'STEP', [0, 0, 0, 1, 0, 0, 2, 0, 0]);
file('CUBICSPLINE.gltf', 'CUBICSPLINE',
  [0, 0, 0, 0, 0, 0, 3, 0, 0, -3, 0, 0, 1, 0, 0, 3, 0, 0, -3, 0, 0, 2, 0, 0, 0, 0, 0]);
JS
cat > read.mjs <<'JS'
import { readFileSync } from 'node:fs';
let failed = false;
for (const name of ['STEP', 'CUBICSPLINE']) {
  const glb = readFileSync(`${name}.glb`), length = glb.readUInt32LE(12);
  const json = JSON.parse(glb.toString('utf8', 20, 20 + length));
  const animation = json.animations[0];
  const sampler = animation.samplers[animation.channels.find((c) => c.target.path === 'translation').sampler];
  const accessor = json.accessors[sampler.output], view = json.bufferViews[accessor.bufferView];
  const start = 28 + length + (view.byteOffset ?? 0) + (accessor.byteOffset ?? 0);
  const xs = Array.from({ length: accessor.count }, (_, i) => glb.readFloatLE(start + 12 * i));
  const seen = `${sampler.interpolation ?? 'LINEAR'} ${xs.join(' ')}`;
  console.log(`${name} came out as ${seen}`);
  if (seen !== 'LINEAR 0 1 2') failed = true;
}
if (failed) { console.log('changed: recorded was LINEAR 0 1 2 for both'); process.exit(1); }
JS
node make.mjs
for name in STEP CUBICSPLINE; do assimp export $name.gltf $name.glb >/dev/null; done
node read.mjs
