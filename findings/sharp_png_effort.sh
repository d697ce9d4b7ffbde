#!/usr/bin/env bash
# sharp 0.35.5 (npm, libvips of its own): .png({effort: 10}).
# Guess: PNG is lossless; effort asks for more work on the same pixels, as for WebP.
# Seen: effort turns the palette on: the picture is cut to 256 colours, all but a few of 4096 random
#   pixels change, by more than 30 levels. compressionLevel 9 changes none, nor does WebP's effort
#   with lossless.
# For users of Atelier: normal maps, textures and coded label images must be written with
#   compressionLevel alone; the file gets smaller and stays a valid PNG, so nothing else tells.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
echo '{"type": "module"}' > package.json
npm install --no-audit --no-fund --ignore-scripts --silent sharp@0.35.5 \
  > npm.log 2>&1 || { echo "the npm package cannot be had"; exit 77; }

# Valid: RGB of 8 bits; effort from 1 to 10 is in the range of the option.
cat > seen.js <<'JS'
import sharp from 'sharp';
const side = 64, pixels = Buffer.alloc(side * side * 3);
for (let i = 0, state = 1; i < pixels.length; ++i) {
  state = (Math.imul(state, 1103515245) + 12345) & 0x7fffffff;
  pixels[i] = (state >> 16) & 255;
}
const image = () => sharp(pixels, {raw: {width: side, height: side, channels: 3}});
const cases = {
  'png({compressionLevel: 9})': image().png({compressionLevel: 9}),
  'png({effort: 10})': image().png({effort: 10}),
  'webp({lossless: true, effort: 6})': image().webp({lossless: true, effort: 6}),
};
for (const [name, written] of Object.entries(cases)) {
  const back = await sharp(await written.toBuffer()).removeAlpha().raw().toBuffer();
  let changed = 0, most = 0;
  for (let i = 0; i < pixels.length; i += 3) {
    const off = Math.max(...[0, 1, 2].map((c) => Math.abs(back[i + c] - pixels[i + c])));
    changed += off > 0 ? 1 : 0;
    most = Math.max(most, off);
  }
  console.log(`${name}: ${(100 * changed / side / side).toFixed(0)}% of pixels changed, ` +
              (most > 30 ? 'by more than 30' : `by ${most}`));
}
JS
seen=$(node seen.js)
printf '%s\n' "$seen"
expected='png({compressionLevel: 9}): 0% of pixels changed, by 0
png({effort: 10}): 100% of pixels changed, by more than 30
webp({lossless: true, effort: 6}): 0% of pixels changed, by 0'
if [ "$seen" != "$expected" ]; then
  echo "CHANGED: sharp writes PNG with effort otherwise than recorded"
  exit 1
fi
