#!/usr/bin/env bash
# sharp 0.35.5 and image-js 1.7.0 (npm), beside ffmpeg 5.1.9 (Debian 12): where a blob lies after
#   resizing.
# Guess: all keep the picture's frame: centre c goes to (c + 0.5) s - 0.5, and shrinking and
#   enlarging are alike.
# Seen: sharp shrinks exactly but enlarges with a shift of half a pixel of the result to the right
#   and down (linear, lanczos3). image-js (bilinear) shifts by half a pixel of the result when it
#   shrinks as when it enlarges. ffmpeg (bicubic) is right.
# For users of Atelier: intrinsics scaled with the images are then off by half a pixel, as are masks
#   that a network gave at half size; check with a blob.
set -euo pipefail
. "$(dirname "$(realpath "$0")")/debian.sh"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
debian_packages ffmpeg=7:5.1.9-0+deb12u1
echo '{"type": "module"}' > package.json
npm install --no-audit --no-fund --ignore-scripts --silent sharp@0.35.5 image-js@1.7.0 \
  > npm.log 2>&1 || { echo "the npm packages cannot be had"; exit 77; }

# Valid: RGB of 8 bits, a Gaussian of 30 px that ends well within the picture.
cat > seen.js <<'JS'
import sharp from 'sharp';
import {decode} from 'image-js';
import fs from 'fs';
import {execFileSync} from 'child_process';
const side = 400, place = [150.3, 250.7], pixels = Buffer.alloc(side * side * 3);
for (let y = 0; y < side; ++y) {
  for (let x = 0; x < side; ++x) {
    const value = 230 * Math.exp(-((x - place[0]) ** 2 + (y - place[1]) ** 2) / 1800);
    pixels.fill(Math.round(value), (y * side + x) * 3, (y * side + x) * 3 + 3);
  }
}
await sharp(pixels, {raw: {width: side, height: side, channels: 3}}).png().toFile('blob.png');
for (const size of [200, 800]) {
  const off = (data, channels) => {
    let sum = 0, sx = 0, sy = 0;
    for (let i = 0; i < size * size; ++i) {
      const value = data[i * channels];
      sum += value, sx += value * (i % size), sy += value * Math.floor(i / size);
    }
    const scale = size / side;
    return [sx, sy].map((s, k) => s / sum - ((place[k] + 0.5) * scale - 0.5))
        .map((x) => (Math.abs(x) < 0.05 ? 0 : x).toFixed(1)).join(' ');
  };
  const words = [];
  for (const kernel of ['linear', 'lanczos3']) {
    words.push(`sharp ${kernel} ` +
        off(await sharp('blob.png').resize(size, size, {kernel}).raw().toBuffer(), 3));
  }
  const resized = decode(fs.readFileSync('blob.png')).resize(
      {width: size, height: size, interpolationType: 'bilinear'});
  words.push(`image-js bilinear ${off(resized.getRawImage().data, resized.channels)}`);
  words.push('ffmpeg bicubic ' + off(execFileSync('ffmpeg', ['-v', 'error', '-i', 'blob.png',
      '-vf', `scale=${size}:${size}:flags=bicubic`, '-f', 'rawvideo', '-pix_fmt', 'rgb24', '-'],
      {maxBuffer: 1 << 24}), 3));
  console.log(`${side} to ${size}: ${words.join(', ')}`);
}
JS
seen=$(node seen.js)
printf '%s\n' "$seen"
expected='400 to 200: sharp linear 0.0 0.0, sharp lanczos3 0.0 0.0, image-js bilinear 0.5 0.5, ffmpeg bicubic 0.0 0.0
400 to 800: sharp linear 0.5 0.5, sharp lanczos3 0.5 0.5, image-js bilinear 0.5 0.5, ffmpeg bicubic 0.0 0.0'
if [ "$seen" != "$expected" ]; then
  echo "CHANGED: resizing shifts pictures otherwise than recorded"
  exit 1
fi
