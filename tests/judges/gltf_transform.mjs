// glTF Transform: the bounds of the scene, the names of its meshes with vertices and triangles, and the
// last time of each animation.
//   node gltf_transform.mjs FILE [OUT]      OUT: written again
import { NodeIO, getBounds } from '@gltf-transform/core';

const io = new NodeIO();
const document = await io.read(process.argv[2]);
const root = document.getRoot();
const { min, max } = getBounds(root.listScenes()[0]);
console.log('bounds', ...min, ...max);
for (const mesh of root.listMeshes()) {
  let vertices = 0;
  let triangles = 0;
  for (const primitive of mesh.listPrimitives()) {
    vertices += primitive.getAttribute('POSITION').getCount();
    triangles += primitive.getIndices().getCount() / 3;
  }
  console.log(`mesh:${mesh.getName()}`, vertices, triangles);
}
for (const animation of root.listAnimations()) {
  const ends = animation.listSamplers().map((sampler) => sampler.getInput().getMax([])[0]);
  console.log('end', Math.max(...ends));
}
if (process.argv[3]) await io.write(process.argv[3], document);
