// What loaders.gl makes of a file: lines of a word and numbers.
//   node loaders_gl.mjs gltf FILE     each mesh: vertices, triangles, box of its POSITION
//   node loaders_gl.mjs ply FILE      vertices, triangles, box
//   node loaders_gl.mjs obj FILE      the same
import { readFileSync } from 'node:fs';
import { parse } from '@loaders.gl/core';
import { GLTFLoader, postProcessGLTF } from '@loaders.gl/gltf';
import { OBJLoader } from '@loaders.gl/obj';
import { PLYLoader } from '@loaders.gl/ply';

const [kind, file] = process.argv.slice(2);
const bytes = readFileSync(file);
const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);

function box(places) {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < places.length; ++i) {
    low[i % 3] = Math.min(low[i % 3], places[i]);
    high[i % 3] = Math.max(high[i % 3], places[i]);
  }
  return [...low, ...high];
}

if (kind === 'gltf') {
  const options = { worker: false, gltf: { loadImages: false, loadBuffers: true } };
  const gltf = postProcessGLTF(await parse(buffer, GLTFLoader, options));
  for (const mesh of gltf.meshes) {
    const { attributes, indices } = mesh.primitives[0];
    const places = attributes.POSITION.value;
    console.log(`mesh:${mesh.name}`, places.length / 3, indices.count / 3, ...box(places));
  }
} else {
  const mesh = await parse(buffer, kind === 'ply' ? PLYLoader : OBJLoader, { worker: false });
  const places = mesh.attributes.POSITION.value;
  const triangles = (mesh.indices?.value.length ?? places.length / 3) / 3;
  console.log(kind, places.length / 3, triangles, ...box(places));
}
