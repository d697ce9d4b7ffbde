#!/usr/bin/env bash
# sharp 0.35.5 (npm) on a PNG of 16 bits by fast-png 8.0.0: depth in millimetres.
# Guess: raw({depth: 'ushort'}) gives the 16 bits, .png() keeps them, and floats go through raw.
# Seen: 1500 mm comes as 5, three channels, in a buffer of ushort; .png() writes 8 bits of RGB;
#   .toColourspace('grey16') before it keeps 1500 in both. Yet .tiff() after it has 8 bits again
#   (its default is JPEG inside). stats() says 65535 all the while. A Float32Array of 0 to 300 put
#   in as raw comes out clipped to whole numbers from 0 to 255.
# For users of Atelier: depth images through sharp need grey16 at each step, and a look at a value.
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
show('.png()', decode(await sharp(png).png().toBuffer()));
show('grey16 .png()', decode(await sharp(png).toColourspace('grey16').png().toBuffer()));
for (const space of [undefined, 'grey16']) {
  const pipe = space ? sharp(png).toColourspace(space) : sharp(png);
  const values = words(await pipe.raw({depth: 'ushort'}).toBuffer());
  console.log(`raw ushort ${space ?? 'by default'}: ${values}`);
}
const tiff = await sharp(png).toColourspace('grey16').tiff().toBuffer();
console.log(`grey16 .tiff(): ${(await sharp(tiff).metadata()).depth}`);
console.log(`stats: most ${(await sharp(png).stats()).channels[0].max}`);
const floats = await sharp(new Float32Array([0, 0.5, 1.5, 300]),
                           {raw: {width: 2, height: 2, channels: 1}})
    .raw({depth: 'float'}).toBuffer();
const out = new Float32Array(floats.buffer, floats.byteOffset, floats.length / 4);
console.log(`floats: ${[...out].filter((_, i) => i % (out.length / 4) === 0)}`);
JS
seen=$(node seen.js)
printf '%s\n' "$seen"
expected='fast-png: 16 bits, 1 channels, third value 1500
.png(): 8 bits, 3 channels, third value 5
grey16 .png(): 16 bits, 1 channels, third value 1500
raw ushort by default: 0,0,0,0,0,0,5,5,5,255,255,255
raw ushort grey16: 0,255,1500,65535
grey16 .tiff(): uchar
stats: most 65535
floats: 0,0,0,1'
if [ "$seen" != "$expected" ]; then
  echo "CHANGED: sharp treats 16 bits otherwise than recorded"
  exit 1
fi
