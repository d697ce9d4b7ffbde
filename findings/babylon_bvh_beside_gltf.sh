#!/usr/bin/env bash
# npm babylonjs and babylonjs-loaders 9.28.0: one body's motion as BVH and as glTF, both loaded into a scene
# with Babylon's default (left-handed) system.
# Guess: both loaders turn right-handed files into the scene's system, so that the two skeletons coincide.
# Seen: the glTF loader mirrors the body by its __root__ node; the BVH loader takes the numbers as they are. The
#   knee of the file, at (-4.868 5.105 10.478), stands at x = -4.868 from BVH and at x = +4.868 from glTF: the two
#   are mirror images, and it is the BVH figure whose left hand is seen as the performer's right. In a scene
#   with useRightHandedSystem both stand at x = -4.868.
# For users of Atelier: set scene.useRightHandedSystem = true before a BVH is loaded in Babylon; a body that
#   seems left-handed there is not our export's fault.
set -euo pipefail
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
npm install --prefer-offline --silent --no-audit --no-fund --ignore-scripts babylonjs@9.28.0 \
  babylonjs-loaders@9.28.0 >/dev/null 2>&1 || { echo "babylon 9.28.0 cannot be had"; exit 77; }
cat > run.mjs <<'JS'
// Valid: a root and a joint with the channels that the format has; the glTF holds the same two nodes, posed as
// frame 0 by translation and unit quaternions. Both formats are right-handed, y up here.
import babylon from 'babylonjs';
import 'babylonjs-loaders';
const { FreeCamera, LoadAssetContainerAsync, NullEngine, Scene, Vector3 } = babylon;
const turn = [30, 40, 50].map((d) => d * Math.PI / 180);
const about = (x, y, z, angle) => [x * Math.sin(angle / 2), y * Math.sin(angle / 2), z * Math.sin(angle / 2), Math.cos(angle / 2)];
const times = ([a, b, c, d], [e, f, g, h]) => [
  d * e + a * h + b * g - c * f, d * f - a * g + b * h + c * e, d * g + a * f - b * e + c * h, d * h - a * e - b * f - c * g];
const rotation = times(times(about(1, 0, 0, turn[0]), about(0, 1, 0, turn[1])), about(0, 0, 1, turn[2]));
const motion = '1 2 3 30 40 50 0 0 0\n';
const bvh = 'HIERARCHY\nROOT Hips\n{\n\tOFFSET 0 0 0\n' +
  '\tCHANNELS 6 Xposition Yposition Zposition Xrotation Yrotation Zrotation\n\tJOINT Knee\n\t{\n\t\tOFFSET 0 10 0\n' +
  '\t\tCHANNELS 3 Xrotation Yrotation Zrotation\n\t\tEnd Site\n\t\t{\n\t\t\tOFFSET 0 10 0\n\t\t}\n\t}\n}\n' +
  `MOTION\nFrames: 2\nFrame Time: 0.01\n${motion}${motion}`;
const gltf = JSON.stringify({ asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0] }], nodes: [
  { name: 'Hips', translation: [1, 2, 3], rotation, children: [1] }, { name: 'Knee', translation: [0, 10, 0] }] });
const shown = (v) => v.asArray().map((x) => x.toFixed(3)).join(' ');
const engine = new NullEngine();
const seen = [];
for (const right of [false, true]) {
  const scene = new Scene(engine);
  scene.useRightHandedSystem = right;
  new FreeCamera('camera', Vector3.Zero(), scene);
  const loaded = await LoadAssetContainerAsync('data:' + bvh, scene, { pluginExtension: '.bvh' });
  loaded.addAllToScene();
  const skeleton = loaded.skeletons[0];
  scene.beginAnimation(skeleton, 0, 1, false).goToFrame(0);
  skeleton.prepare(true);
  const knee = skeleton.bones.find((bone) => bone.name === 'Knee');
  const container = await LoadAssetContainerAsync('data:' + gltf, scene, { pluginExtension: '.gltf' });
  container.addAllToScene();
  const node = scene.transformNodes.find((n) => n.name === 'Knee');
  node.computeWorldMatrix(true);
  seen.push(`${right ? 'right' : 'left'}-handed scene: knee from BVH ${shown(Vector3.TransformCoordinates(Vector3.Zero(), knee.getFinalMatrix()))}, from glTF ${shown(node.getAbsolutePosition())}`);
}
console.log(seen.join('\n'));
const recorded = [
  'left-handed scene: knee from BVH -4.868 5.105 10.478, from glTF 4.868 5.105 10.478',
  'right-handed scene: knee from BVH -4.868 5.105 10.478, from glTF -4.868 5.105 10.478'];
if (seen.join('\n') !== recorded.join('\n')) { console.log(`changed: recorded was\n${recorded.join('\n')}`); process.exit(1); }
process.exit(0);
JS
node run.mjs
