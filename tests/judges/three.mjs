// What three.js makes of a file: lines of a word and numbers.
//   node three.mjs gltf FILE [SECONDS...]   each mesh: how it looks, its box at rest and then
//   node three.mjs bvh FILE [SECONDS...]    each joint's place
//   node three.mjs ply FILE                 vertices, triangles, box
//   node three.mjs obj FILE                 the same
//   node three.mjs usd FILE                 each mesh's box
import { readFileSync } from 'node:fs';
import * as THREE from 'three';
import { GLTFLoader } from 'three/examples/jsm/loaders/GLTFLoader.js';
import { BVHLoader } from 'three/examples/jsm/loaders/BVHLoader.js';
import { OBJLoader } from 'three/examples/jsm/loaders/OBJLoader.js';
import { PLYLoader } from 'three/examples/jsm/loaders/PLYLoader.js';
import { USDLoader } from 'three/examples/jsm/loaders/USDLoader.js';

globalThis.self = globalThis;
const [kind, file, ...times] = process.argv.slice(2);
const bytes = readFileSync(file);
const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
const say = (...words) => console.log(words.join(' '));

/** Lines of all meshes as they are drawn now: morphed, skinned, placed. */
function sayMeshes(scene, when) {
  scene.updateMatrixWorld(true);
  scene.traverse((mesh) => {
    if (!mesh.isMesh) return;
    if (mesh.isSkinnedMesh) mesh.skeleton.update();
    const box = new THREE.Box3();
    const point = new THREE.Vector3();
    for (let i = 0; i < mesh.geometry.attributes.position.count; ++i) {
      mesh.getVertexPosition(i, point);
      box.expandByPoint(point.applyMatrix4(mesh.matrixWorld));
    }
    say(`${mesh.name}@${when}`, ...box.min.toArray(), ...box.max.toArray());
  });
}

/** Clips as they stand at a time; at their end they stay there. */
function play(mixer, clips, time) {
  for (const clip of clips) {
    const action = mixer.clipAction(clip).reset().setLoop(THREE.LoopOnce);
    action.clampWhenFinished = true;
    action.play();
  }
  mixer.setTime(time);
}

if (kind === 'gltf') {
  const gltf = await new GLTFLoader().parseAsync(buffer, '');
  gltf.scene.traverse((mesh) => {
    if (!mesh.isMesh) return;
    const { attributes, morphAttributes } = mesh.geometry;
    say(`mesh:${mesh.name}`, mesh.material.metalness, mesh.material.side === THREE.DoubleSide ? 2 : 1,
      attributes.normal ? 1 : 0, morphAttributes.position?.length ?? 0,
      morphAttributes.normal?.length ?? 0, attributes.skinIndex?.itemSize ?? 0);
  });
  sayMeshes(gltf.scene, 'rest');
  const mixer = new THREE.AnimationMixer(gltf.scene);
  say('clips', gltf.animations.length);
  for (const time of times) {
    play(mixer, gltf.animations, Number(time));
    sayMeshes(gltf.scene, time);
  }
} else if (kind === 'bvh') {
  const { skeleton, clip } = new BVHLoader().parse(bytes.toString());
  const root = skeleton.bones[0];
  const mixer = new THREE.AnimationMixer(root);
  for (const time of times) {
    play(mixer, [clip], Number(time));
    root.updateMatrixWorld(true);
    for (const bone of skeleton.bones) {
      if (bone.name === 'ENDSITE') continue;
      say(`${bone.name}@${time}`, ...new THREE.Vector3().setFromMatrixPosition(bone.matrixWorld).toArray());
    }
  }
} else if (kind === 'ply') {
  const geometry = new PLYLoader().parse(buffer);
  geometry.computeBoundingBox();
  const corners = geometry.index ?? geometry.attributes.position;  // no index: three vertices a triangle
  say('ply', geometry.attributes.position.count, corners.count / 3,
    ...geometry.boundingBox.min.toArray(), ...geometry.boundingBox.max.toArray());
} else if (kind === 'obj') {  // three vertices a triangle
  const { geometry } = new OBJLoader().parse(bytes.toString()).children[0];
  geometry.computeBoundingBox();
  say('obj', geometry.attributes.position.count, geometry.attributes.position.count / 3,
    ...geometry.boundingBox.min.toArray(), ...geometry.boundingBox.max.toArray());
} else if (kind === 'usd') {
  const scene = new USDLoader().parse(buffer);
  sayMeshes(scene, 'rest');
}
