#!/usr/bin/env bash
# svg-path-bounding-box 1.0.4, beside svg-path-bbox 2.1.0 (npm): smooth quadratic curves (T).
# Guess: the box of the curve: -25 to 25 for a quadratic wave of height 25.
# Seen: it places the mirrored control point of T wrongly and gives -6.2 to 30.7. A path of a single C
#   is right.
# Valid: SVG 1.1 section 8.3.7: T mirrors the control point of the Q before it.
# For users of Atelier: pieces whose curves are written with T are cut off or laid over one another by
#   this box; take it from sampled points.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
echo '{"type": "module"}' > package.json
npm install --no-audit --no-fund --ignore-scripts --silent svg-path-bounding-box@1.0.4 \
  svg-path-bbox@2.1.0 svg-path-properties@2.1.0 \
  > npm.log 2>&1 || { echo "the npm packages cannot be had"; exit 77; }

cat > seen.js <<'JS'
import box from 'svg-path-bounding-box';
import {svgPathBbox} from 'svg-path-bbox';
import {svgPathProperties} from 'svg-path-properties';
const paths = {
  wave: 'M0 0Q25 50 50 0T100 0',
  neckline: 'M0 0C0 100 100 100 100 0',
};
const two = (low, high) => `${low.toFixed(1)} to ${high.toFixed(1)}`;
for (const [name, d] of Object.entries(paths)) {
  const path = new svgPathProperties(d);
  const ys = Array.from({length: 4001}, (_, i) => path.getPointAtLength(
      path.getTotalLength() * i / 4000).y);
  const other = box(d), b = svgPathBbox(d);
  console.log(`${name}: sampled ${two(Math.min(...ys), Math.max(...ys))}, ` +
      `svg-path-bbox ${two(b[1], b[3])}, ` +
      `svg-path-bounding-box ${two(other.minY ?? other.y1, other.maxY ?? other.y2)}`);
}
JS
seen=$(node seen.js)
printf '%s\n' "$seen"
expected='wave: sampled -25.0 to 25.0, svg-path-bbox -25.0 to 25.0, svg-path-bounding-box -6.2 to 30.7
neckline: sampled 0.0 to 75.0, svg-path-bbox 0.0 to 75.0, svg-path-bounding-box 0.0 to 75.0'
if [ "$seen" != "$expected" ]; then
  echo "CHANGED: boxes of curves are otherwise than recorded"
  exit 1
fi
