#!/usr/bin/env bash
# fili 2.0.3 (npm): CalcCascades().lowpass({order, characteristic: 'butterworth'}).
# Guess: order 4 is a Butterworth filter of fourth order: -24 dB an octave above the cutoff.
# Seen: order counts sections of second order: 4 gives -50.2 dB an octave above (an eighth order),
#   2 gives the fourth. -3.0 dB at the cutoff in all. For 'bessel' sections 2 and 4 fall alike
#   (-14.0 and -14.1 dB): more of them make it no steeper.
# For users of Atelier: "fourth order at 6 Hz", as motion papers filter markers, is order 2 here;
#   run forward and backward it is order 1.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
echo '{"type": "module"}' > package.json
npm install --no-audit --no-fund --ignore-scripts --silent fili@2.0.3 \
  > npm.log 2>&1 || { echo "the npm package cannot be had"; exit 77; }

# Valid: cutoff 6 Hz at 120 Hz, orders of 1 to 12 are allowed; the gain is measured with sines
# after the transient.
cat > seen.js <<'JS'
import Fili from 'fili';
for (const characteristic of ['butterworth', 'bessel']) {
  for (const order of [1, 2, 4]) {
    const sections = new Fili.CalcCascades().lowpass(
        {order, characteristic, Fs: 120, Fc: 6, gain: 0, preGain: false});
    const decibel = (hertz) => {
      const filter = new Fili.IirFilter(sections);
      let peak = 0;
      for (let i = 0; i < 6000; ++i) {
        const y = filter.singleStep(Math.sin(2 * Math.PI * hertz * i / 120));
        if (i >= 4800) peak = Math.max(peak, Math.abs(y));
      }
      return (20 * Math.log10(peak)).toFixed(1);
    };
    console.log(`${characteristic} ${order}: 6 Hz ${decibel(6)} dB, 12 Hz ${decibel(12)} dB`);
  }
}
JS
seen=$(node seen.js)
printf '%s\n' "$seen"
expected='butterworth 1: 6 Hz -3.0 dB, 12 Hz -12.9 dB
butterworth 2: 6 Hz -3.0 dB, 12 Hz -25.2 dB
butterworth 4: 6 Hz -3.0 dB, 12 Hz -50.2 dB
bessel 1: 6 Hz -3.0 dB, 12 Hz -10.1 dB
bessel 2: 6 Hz -3.0 dB, 12 Hz -14.0 dB
bessel 4: 6 Hz -2.9 dB, 12 Hz -14.1 dB'
if [ "$seen" != "$expected" ]; then
  echo "CHANGED: fili counts the order otherwise than recorded"
  exit 1
fi
