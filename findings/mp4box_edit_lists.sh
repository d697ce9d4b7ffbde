#!/usr/bin/env bash
# npm mp4box 2.4.1, beside mediabunny 1.61.0: times of the images of an MP4 with B-frames, of the same trimmed by
# ffmpeg 5.1.9 (-ss 0.4 -c copy), and of a camera that starts 0.2 s late.
# Guess: cts / timescale of a sample is when it is shown, as WebCodecs wants it.
# Seen: it is the time within the media: all three files begin at 0.08 s (two frames of delay by B-frames), the
#   trimmed one gives its ten hidden images first, and the pause of the late camera is gone. mediabunny has the
#   first image at 0, -0.4 (what is hidden has negative times) and 0.2 s.
# Valid: ISO/IEC 14496-12, 8.6.6: edit lists, which mp4box reads (`edits`) and does not apply; ffprobe's start
#   times are 0, 0 and 0.2.
# For users of Atelier: cameras that are paired in a browser by these times are off by the trim and by the pause;
#   Atelier numbers what is shown and says what pauses (`video-start`).
set -euo pipefail
. "$(dirname "$(realpath "$0")")/debian.sh"
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
debian_packages ffmpeg=7:5.1.9-0+deb12u1
echo '{"type": "module"}' > package.json
npm install --prefer-offline --silent --no-audit --no-fund --ignore-scripts mp4box@2.4.1 mediabunny@1.61.0 \
  >/dev/null 2>&1 || { echo "mp4box 2.4.1 and mediabunny 1.61.0 cannot be had"; exit 77; }
# 40 grey frames at 25 Hz, an I-frame every 12 and B-frames between.
head -c $((40 * 6144)) /dev/zero | tr '\0' '\200' |
  ffmpeg -v error -f rawvideo -pix_fmt yuv420p -s 64x64 -r 25 -i - -c:v libx264 -qp 4 -bf 3 \
    -x264-params keyint=12:min-keyint=12:scenecut=0:b-adapt=0 whole.mp4
ffmpeg -v error -ss 0.4 -i whole.mp4 -c copy trimmed.mp4
ffmpeg -v error -itsoffset 0.2 -i whole.mp4 -c copy late.mp4
cat > run.mjs <<'JS'
import { readFileSync } from 'node:fs';
import { createFile } from 'mp4box';
import { ALL_FORMATS, BufferSource, EncodedPacketSink, Input } from 'mediabunny';
const least = (times) => Math.min(...times).toFixed(2);
for (const name of ['whole', 'trimmed', 'late']) {
  const bytes = readFileSync(name + '.mp4');
  const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length);
  buffer.fileStart = 0;
  const file = createFile(), times = [];
  file.onReady = ({ videoTracks: [track] }) => { file.setExtractionOptions(track.id, null, { nbSamples: 100 }); file.start(); };
  file.onSamples = (id, user, samples) => times.push(...samples.map((sample) => sample.cts / sample.timescale));
  file.appendBuffer(buffer);
  file.flush();
  await new Promise((then) => setTimeout(then, 100));
  const input = new Input({ source: new BufferSource(bytes), formats: ALL_FORMATS });
  const others = [];
  for await (const packet of new EncodedPacketSink(await input.getPrimaryVideoTrack()).packets()) others.push(packet.timestamp);
  console.log(`${name}: mp4box ${times.length} images from ${least(times)} s, mediabunny ${others.length} from ${least(others)} s`);
}
JS
seen=$(node run.mjs)
printf '%s\n' "$seen"
[ "$seen" = 'whole: mp4box 40 images from 0.08 s, mediabunny 40 from 0.00 s
trimmed: mp4box 40 images from 0.08 s, mediabunny 40 from -0.40 s
late: mp4box 40 images from 0.08 s, mediabunny 40 from 0.20 s' ] ||
  { echo "CHANGED: mp4box or mediabunny gives other times than recorded"; exit 1; }
