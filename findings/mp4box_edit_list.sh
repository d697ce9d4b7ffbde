#!/usr/bin/env bash
# mp4box 2.4.1 and mediabunny 1.61.0 (npm) on MP4 of ffmpeg 5.1.9 (Debian 12): time of the first
# frame.
# Guess: 0 for a file as cameras write it, 0.2 s for one that starts 0.2 s later; the same in both.
# Seen: mp4box gives 0.08 s for every file with B-frames, be it whole or late, and 0 for one
#   without: it leaves the edit list to the caller. mediabunny gives 0, 0.2 and 0, as ffprobe does.
# Valid: ISO/IEC 14496-12, 8.6.6; two frames of reordering are written as cts offsets that the edit
#   list takes back.
# For users of Atelier: in a page built on mp4box.js a camera with B-frames runs two frames behind
#   one without; subtract media_time and add the empty edits.
set -euo pipefail
[ "$(dpkg-query -W -f='${Version}' ffmpeg 2>/dev/null || true)" = 7:5.1.9-0+deb12u1 ] ||
  { echo "needs ffmpeg 7:5.1.9-0+deb12u1 of Debian 12"; exit 77; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
echo '{"type": "module"}' > package.json
npm install --no-audit --no-fund --ignore-scripts --silent mp4box@2.4.1 mediabunny@1.61.0 \
  > npm.log 2>&1 || { echo "the npm packages cannot be had"; exit 77; }

film() { ffmpeg -v error -f lavfi -i testsrc=size=64x64:rate=25:duration=1 -pix_fmt yuv420p "$@"; }
film -c:v libx264 -bf 3 -x264-params b-adapt=0 whole.mp4
film -c:v libx264 -bf 0 plain.mp4
ffmpeg -v error -itsoffset 0.2 -i whole.mp4 -c copy late.mp4
cat > seen.js <<'JS'
import * as mp4box from 'mp4box';
import {ALL_FORMATS, BufferSource, Input} from 'mediabunny';
import fs from 'fs';
for (const name of ['whole', 'late', 'plain']) {
  const bytes = fs.readFileSync(name + '.mp4');
  const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length);
  const file = mp4box.createFile();
  let first = Infinity;
  file.onReady = (info) => {
    file.setExtractionOptions(info.tracks[0].id, null, {nbSamples: 1000});
    file.start();
  };
  file.onSamples = (id, user, samples) => {
    first = Math.min(first, ...samples.map((sample) => sample.cts / sample.timescale));
  };
  buffer.fileStart = 0;
  file.appendBuffer(buffer);
  file.flush();
  const input = new Input({formats: ALL_FORMATS, source: new BufferSource(buffer)});
  const track = await input.getPrimaryVideoTrack();
  console.log(`${name}: mp4box ${first.toFixed(2)}, ` +
              `mediabunny ${(await track.getFirstTimestamp()).toFixed(2)}`);
}
JS
seen=$(node seen.js; for name in whole late plain; do
  echo "$name: ffprobe $(ffprobe -v error -of csv=p=0 -show_entries stream=start_time $name.mp4)"
done)
printf '%s\n' "$seen"
expected='whole: mp4box 0.08, mediabunny 0.00
late: mp4box 0.08, mediabunny 0.20
plain: mp4box 0.00, mediabunny 0.00
whole: ffprobe 0.000000
late: ffprobe 0.200000
plain: ffprobe 0.000000'
if [ "$seen" != "$expected" ]; then
  echo "CHANGED: first times of an MP4 are read otherwise than recorded"
  exit 1
fi
