#!/usr/bin/env bash
# makerjs 0.19.2 importer.fromSVGPathData, beside svgpath 2.6.0 and svg-path-properties 2.1.0 (npm).
# Guess: "a50 50 0 01100 0" is read as an arc with flags 0 and 1 to (100, 0), or refused.
# Seen: makerjs takes "01100" for one number and returns a model with NaN in it and no error: length
#   NaN, extents of null. svgpath and svg-path-properties read 157.08, a half circle.
# Valid: SVG 1.1 section 8.3.9, flag: "0" | "1" and comma-wsp is optional; SVG 2 the same. SVGO
#   writes it with noSpaceAfterFlags.
# For users of Atelier: minified patterns go into makerjs's DXF with lost arcs; write spaces
#   between the flags (we write no arcs).
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
echo '{"type": "module"}' > package.json
npm install --no-audit --no-fund --ignore-scripts --silent makerjs@0.19.2 svgpath@2.6.0 \
  svg-path-properties@2.1.0 > npm.log 2>&1 || { echo "the npm packages cannot be had"; exit 77; }

cat > seen.js <<'JS'
import makerjs from 'makerjs';
import svgpath from 'svgpath';
import {svgPathProperties} from 'svg-path-properties';
for (const d of ['M0 0a50 50 0 0 1 100 0', 'M0 0a50 50 0 01100 0']) {
  const model = makerjs.importer.fromSVGPathData(d);
  console.log(`${d}: makerjs ${makerjs.measure.modelPathLength(model).toFixed(1)}, ` +
      `svg-path-properties ${new svgPathProperties(d).getTotalLength().toFixed(1)}, ` +
      `svgpath ${svgpath(d).abs().toString()}`);
}
JS
seen=$(node seen.js)
printf '%s\n' "$seen"
expected='M0 0a50 50 0 0 1 100 0: makerjs 157.1, svg-path-properties 157.1, svgpath M0 0A50 50 0 0 1 100 0
M0 0a50 50 0 01100 0: makerjs NaN, svg-path-properties 157.1, svgpath M0 0A50 50 0 0 1 100 0'
if [ "$seen" != "$expected" ]; then
  echo "CHANGED: compact arc flags are read otherwise than recorded"
  exit 1
fi
