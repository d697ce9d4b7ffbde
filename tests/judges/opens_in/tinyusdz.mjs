// What tinyusdz makes of a USD file: lines of a word and numbers.
//   node tinyusdz.mjs FILE      each mesh: vertices, triangles, box
import { readFileSync } from 'node:fs';

process.type = 'renderer';  // its module refuses Node, and takes a renderer with a window
globalThis.window = globalThis;
const { default: tinyusdz } = await import('tinyusdz/tinyusdz.js');
const wasm = new URL('node_modules/tinyusdz/tinyusdz.wasm', import.meta.url);
const { TinyUSDZLoaderNative } = await tinyusdz({ wasmBinary: readFileSync(wasm) });
const loader = new TinyUSDZLoaderNative();
if (!loader.loadFromBinary(new Uint8Array(readFileSync(process.argv[2])), 'a.usda')) throw new Error(loader.error());
for (let i = 0; i < loader.numMeshes(); ++i) {
  const { primName, points, faceVertexIndices } = loader.getMesh(i);
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  points.forEach((value, k) => {
    low[k % 3] = Math.min(low[k % 3], value);
    high[k % 3] = Math.max(high[k % 3], value);
  });
  console.log(primName, points.length / 3, faceVertexIndices.length / 3, ...low, ...high);
}
