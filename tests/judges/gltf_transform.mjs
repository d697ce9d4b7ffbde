// glTF Transform: the bounds of the scene, with the names of its meshes.
import { NodeIO, getBounds } from '@gltf-transform/core';

const document = await new NodeIO().read(process.argv[2]);
const { min, max } = getBounds(document.getRoot().listScenes()[0]);
console.log('bounds', ...min, ...max);
for (const mesh of document.getRoot().listMeshes()) console.log(`mesh:${mesh.getName()}`, 1);
