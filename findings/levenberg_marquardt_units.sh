#!/usr/bin/env bash
# ml-levenberg-marquardt 5.1.0 (npm), defaults.
# Guess: a least-squares fit does not depend on the unit: millimetres and metres give the same
#   decay rate.
# Seen: the default errorTolerance 0.01 is absolute, on the sum of squares. Noise-free decay from
#   2.1 mm: in millimetres the rate is 0.700 (true 0.7) after 4 iterations; in metres the fit stops
#   after 1 with the first guess, rate 1.000, and no sign. errorTolerance 0 cures it.
# For users of Atelier: motions and bodies are in metres here; set errorTolerance to 0 or scale.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
echo '{"type": "module"}' > package.json
npm install --no-audit --no-fund --ignore-scripts --silent ml-levenberg-marquardt@5.1.0 \
  > npm.log 2>&1 || { echo "the npm package cannot be had"; exit 77; }

# Valid: 20 samples, 3 parameters, the first guess near the answer and scaled with the data.
cat > seen.js <<'JS'
import {levenbergMarquardt} from 'ml-levenberg-marquardt';
const x = Array.from({length: 20}, (_, i) => i * 0.2);
const decay = ([a, b, c]) => (t) => a * Math.exp(-b * t) + c;
for (const [name, unit, more] of [['millimetres', 1, {}], ['metres', 1e-3, {}],
                                  ['metres, tolerance 0', 1e-3, {errorTolerance: 0}]]) {
  const y = x.map((t) => unit * decay([2, 0.7, 0.1])(t));
  const fit = levenbergMarquardt({x, y}, decay,
      {initialValues: [unit, 1, 0], gradientDifference: 1e-6, maxIterations: 100, ...more});
  console.log(`${name}: rate ${fit.parameterValues[1].toFixed(3)}` +
              (more.errorTolerance === 0 ? '' : `, ${fit.iterations} iterations`));
}
JS
seen=$(node seen.js)
printf '%s\n' "$seen"
expected='millimetres: rate 0.700, 4 iterations
metres: rate 1.000, 1 iterations
metres, tolerance 0: rate 0.700'
if [ "$seen" != "$expected" ]; then
  echo "CHANGED: the fit depends on the unit otherwise than recorded"
  exit 1
fi
