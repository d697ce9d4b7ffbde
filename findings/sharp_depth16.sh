#!/usr/bin/env bash
# sharp 0.35.5 (npm) on a PNG of 16 bits by fast-png 8.0.0: depth in millimetres.
# Guess: raw({depth: 'ushort'}) gives the 16 bits of the file, raw({depth: 'float'}) the floats put in.
# Seen: 1500 mm comes as 5, in three channels, in a buffer of ushort: the picture is brought to 8 bits
#   first, and the depth asked for is that of the buffer alone. .toColourspace('grey16') before it
#   keeps 1500. stats() says 65535 all the while. A raw Float32Array is taken for grey of 16 bits: 300
#   comes out as 1 (300 / 256), with grey16 as 300, but 1.5 as 1. (That .png() and .tiff() write 8
#   bits by default is documented.)
# For users of Atelier: depth images through sharp need grey16, and a look at a value.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
echo '{"type": "module"}' > package.json
npm install --no-audit --no-fund --ignore-scripts --silent sharp@0.35.5 fast-png@8.0.0 \
  > npm.log 2>&1 || { echo "the npm packages cannot be had"; exit 77; }

# Valid: greyscale of 16 bits without gAMA or sBIT (PNG 11.2.2); fast-png reads it back.
cat > seen.js <<'JS'
import sharp from 'sharp';
import {decode, encode} from 'fast-png';
const depth = new Uint16Array([0, 255, 1500, 65535]);
const png = Buffer.from(encode({width: 2, height: 2, data: depth, depth: 16, channels: 1}));
const words = (buffer) => [...new Uint16Array(buffer.buffer, buffer.byteOffset, buffer.length / 2)];
const show = (name, image) => console.log(
    `${name}: ${image.depth} bits, ${image.channels} channels, third value ` +
    `${image.data[2 * image.channels]}`);
show('fast-png', decode(png));
for (const space of [undefined, 'grey16']) {
  const pipe = space ? sharp(png).toColourspace(space) : sharp(png);
  const values = words(await pipe.raw({depth: 'ushort'}).toBuffer());
  console.log(`raw ushort ${space ?? 'by default'}: ${values}`);
}
console.log(`stats: most ${(await sharp(png).stats()).channels[0].max}`);
for (const space of ['srgb', 'grey16']) {
  const floats = await sharp(new Float32Array([0, 0.5, 1.5, 300]),
                             {raw: {width: 2, height: 2, channels: 1}})
      .toColourspace(space).raw({depth: 'float'}).toBuffer();
  const out = new Float32Array(floats.buffer, floats.byteOffset, floats.length / 4);
  console.log(`floats ${space}: ${[...out].filter((_, i) => i % (out.length / 4) === 0)}`);
}
JS
seen=$(node seen.js)
printf '%s\n' "$seen"
expected='fast-png: 16 bits, 1 channels, third value 1500
raw ushort by default: 0,0,0,0,0,0,5,5,5,255,255,255
raw ushort grey16: 0,255,1500,65535
stats: most 65535
floats srgb: 0,0,0,1
floats grey16: 0,0,1,300'
if [ "$seen" != "$expected" ]; then
  echo "CHANGED: sharp treats 16 bits otherwise than recorded"
  exit 1
fi
