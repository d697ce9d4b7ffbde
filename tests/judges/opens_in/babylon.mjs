// What Babylon.js makes of a file: lines of a word and numbers.
//   node babylon.mjs gltf FILE [SECONDS...]   each mesh's box at rest and then
//   node babylon.mjs bvh FILE [SECONDS...]    each joint's place
import { readFileSync } from 'node:fs';
import * as BABYLON from '@babylonjs/core';
import { registerBuiltInLoaders } from '@babylonjs/loaders/dynamic.js';
import { ReadBvh } from '@babylonjs/loaders/BVH/bvhLoader.js';

const [kind, file, ...times] = process.argv.slice(2);
BABYLON.Logger.LogLevels = BABYLON.Logger.ErrorLogLevel;
const scene = new BABYLON.Scene(new BABYLON.NullEngine());
new BABYLON.FreeCamera('', BABYLON.Vector3.Zero(), scene);  // without one nothing is rendered
const say = (...words) => console.log(words.join(' '));

/** The world's box of every mesh, morphed and skinned; Babylon mirrors glTF at x. */
function sayMeshes(when) {
  for (const mesh of scene.meshes) {
    if (mesh.getTotalVertices() === 0) continue;
    mesh.skeleton?.prepare(true);
    mesh.computeWorldMatrix(true);
    const places = mesh.getPositionData(true, true);
    const world = mesh.getWorldMatrix();
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < places.length; i += 3) {
      const p = BABYLON.Vector3.TransformCoordinatesFromFloatsToRef(
        places[i], places[i + 1], places[i + 2], world, BABYLON.Vector3.Zero()).asArray();
      for (let axis = 0; axis < 3; ++axis) {
        low[axis] = Math.min(low[axis], p[axis]);
        high[axis] = Math.max(high[axis], p[axis]);
      }
    }
    say(`${mesh.name}@${when}`, ...low, ...high);
  }
}

if (kind === 'gltf') {
  registerBuiltInLoaders();
  scene.useRightHandedSystem = true;
  await BABYLON.AppendSceneAsync(new Uint8Array(readFileSync(file)), scene, { pluginExtension: '.glb' });
  for (const group of scene.animationGroups) group.stop();
  sayMeshes('rest');
  for (const time of times) {
    for (const group of scene.animationGroups) {
      group.start(false, 1, group.from, group.to);
      group.pause();
      group.goToFrame(Number(time) * group.targetedAnimations[0].animation.framePerSecond);
    }
    for (const skeleton of scene.skeletons) {
      for (const bone of skeleton.bones) bone.getTransformNode()?.computeWorldMatrix(true);
    }
    scene.render(false);
    sayMeshes(time);
  }
} else if (kind === 'bvh') {
  scene.useRightHandedSystem = true;
  const skeleton = ReadBvh(readFileSync(file, 'utf8'), scene, null, {});
  for (const time of times) {
    for (const bone of skeleton.bones) {
      for (const animation of bone.animations) {
        animation.getKeys();  // frames of seconds times the rate
        const value = animation.evaluate(Number(time) * animation.framePerSecond);
        if (animation.targetProperty === 'position') bone.position = value;
        else bone.rotationQuaternion = value;
      }
    }
    skeleton.computeAbsoluteMatrices(true);
    for (const bone of skeleton.bones) say(`${bone.name}@${time}`, ...bone.getAbsolutePosition().asArray());
  }
}
