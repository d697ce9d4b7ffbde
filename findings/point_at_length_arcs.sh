#!/usr/bin/env bash
# point-at-length 1.1.0 (npm), beside svg-path-properties 2.1.0: lengths of SVG paths.
# Guess: the length of any valid path; arcs as curves or, at worst, an error.
# Seen: elliptical arcs count nothing: a half circle of radius 50 has length 0 for 157.1, a pocket
#   of two sides and a half circle 241.4 for 357.1 (the side after it starts at the wrong end). No
#   error; lines and Bezier curves are right.
# For users of Atelier: seam lengths of patterns from programs that write arcs come out short.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
echo '{"type": "module"}' > package.json
npm install --no-audit --no-fund --ignore-scripts --silent point-at-length@1.1.0 \
  svg-path-properties@2.1.0 > npm.log 2>&1 || { echo "the npm packages cannot be had"; exit 77; }

# Valid: SVG 1.1 section 8.3.8; the radii reach the end points exactly.
cat > seen.js <<'JS'
import pointAtLength from 'point-at-length';
import {svgPathProperties} from 'svg-path-properties';
const paths = {
  'half circle': 'M0 0A50 50 0 0 1 100 0',
  pocket: 'M0 0L0 100A50 50 0 0 0 100 100L100 0',
  curve: 'M0 0C0 100 100 100 100 0',
};
for (const [name, d] of Object.entries(paths)) {
  console.log(`${name}: point-at-length ${pointAtLength(d).length().toFixed(1)}, ` +
      `svg-path-properties ${new svgPathProperties(d).getTotalLength().toFixed(1)}`);
}
JS
seen=$(node seen.js)
printf '%s\n' "$seen"
expected='half circle: point-at-length 0.0, svg-path-properties 157.1
pocket: point-at-length 241.4, svg-path-properties 357.1
curve: point-at-length 200.0, svg-path-properties 200.0'
if [ "$seen" != "$expected" ]; then
  echo "CHANGED: point-at-length counts arcs otherwise than recorded"
  exit 1
fi
