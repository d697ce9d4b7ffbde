// What h5wasm finds in a sequence of one HDF5 file: frames, vertices and triangles, the frame rate, and the
// box of each frame asked for.
//   node h5wasm.mjs FILE [FRAME...]
import h5wasm from 'h5wasm/node';

await h5wasm.ready;
const [file, ...frames] = process.argv.slice(2);
const archive = new h5wasm.File(file, 'r');
const vertices = archive.get('vertices');
console.log('counts', vertices.shape[0], vertices.shape[1], archive.get('faces').shape[0]);
console.log('fps', archive.get('fps').value[0]);
for (const frame of frames.map(Number)) {
  const places = vertices.slice([[frame, frame + 1], [], []]);
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  places.forEach((value, i) => {
    low[i % 3] = Math.min(low[i % 3], value);
    high[i % 3] = Math.max(high[i % 3], value);
  });
  console.log(`frame:${frame}`, ...low, ...high);
}
archive.close();
