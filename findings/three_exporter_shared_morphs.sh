#!/usr/bin/env bash
# three 0.187.0: GLTFExporter on two meshes that share one geometry with a morph target, with influences 0.25
# and 0.75 (two people of one head, or an avatar shown twice with different expressions).
# Guess: the glTF keeps both values, as weights of two meshes or of the two nodes; both are allowed.
# Seen: one mesh is written, with the weights of the first, and two nodes without weights: read back by three
#   itself both stand at 0.25. The second expression is gone; no warning. With a geometry of its own
#   (geometry.clone()) the second keeps its 0.75.
# For users of Atelier: in scenes built in three from our exports clone the geometry of each person before
#   exporting; compare weights after the round trip, not only vertices.
set -euo pipefail
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
npm install --prefer-offline --silent --no-audit --no-fund --ignore-scripts three@0.187.0 >/dev/null 2>&1 ||
  { echo "three 0.187.0 cannot be had"; exit 77; }
cat > run.mjs <<'JS'
// Valid: three lets meshes share a geometry, and keeps influences per mesh. FileReader stands in for the
// browser's; nothing else of one is needed.
import { BufferGeometry, Float32BufferAttribute, Mesh, MeshBasicMaterial, Scene } from 'three';
import { GLTFExporter } from 'three/examples/jsm/exporters/GLTFExporter.js';
import { GLTFLoader } from 'three/examples/jsm/loaders/GLTFLoader.js';
globalThis.self = globalThis;
globalThis.FileReader = class {
  readAsArrayBuffer(blob) { blob.arrayBuffer().then((bytes) => { this.result = bytes; this.onloadend(); }); }
};
const geometry = new BufferGeometry();
geometry.setAttribute('position', new Float32BufferAttribute([0, 0, 0, 1, 0, 0, 0, 1, 0], 3));
geometry.morphAttributes.position = [new Float32BufferAttribute([0, 0, 0, 0, 0, 0, 0, 0, 1], 3)];
geometry.morphTargetsRelative = true;
async function roundTrip(second) {
  const scene = new Scene(), material = new MeshBasicMaterial();
  for (const [name, shape, influence] of [['a', geometry, 0.25], ['b', second, 0.75]]) {
    const mesh = new Mesh(shape, material);
    mesh.name = name;
    mesh.morphTargetInfluences[0] = influence;
    scene.add(mesh);
  }
  const bytes = await new GLTFExporter().parseAsync(scene, { binary: true });
  const read = await new Promise((done, failed) => new GLTFLoader().parse(bytes, '', done, failed));
  const seen = [];
  read.scene.traverse((object) => { if (object.isMesh) seen.push(`${object.name} ${object.morphTargetInfluences[0]}`); });
  return seen.join(', ');
}
const shared = await roundTrip(geometry), cloned = await roundTrip(geometry.clone());
console.log(`shared geometry: ${shared}\ncloned geometry: ${cloned}`);
if (shared !== 'a 0.25, b 0.25' || cloned !== 'a 0.25, b 0.75') {
  console.log('changed: recorded were a 0.25, b 0.25 and a 0.25, b 0.75');
  process.exit(1);
}
JS
node run.mjs
