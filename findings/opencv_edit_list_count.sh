#!/usr/bin/env bash
# python3-opencv 4.6.0 (FFmpeg back end) and ffmpeg 5.1.9, Debian 12: an MP4 trimmed without
# re-encoding (ffmpeg -ss 0.4 -c copy), as phones and editors trim.
# Guess: CAP_PROP_FRAME_COUNT is the number of frames that read() gives, and a seek to the last of
#   them works.
# Seen: it counts the samples of the track, 40, while the edit list shows 30: reading ends ten
#   frames early, the first frame is number 10 of the track, and seeks to 30 to 39 fail.
# Valid: ISO/IEC 14496-12, 8.6.6: the edit list maps media to presentation; decoders need the
#   samples before it from the last sync sample on. ffprobe counts 30 frames.
# For users of Atelier: a count of the container is no count of frames; cameras that were trimmed
#   differently look equally long.
set -euo pipefail
. "$(dirname "$(realpath "$0")")/debian.sh"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
debian_packages python3-opencv=4.6.0+dfsg-12 ffmpeg=7:5.1.9-0+deb12u1

# 40 grey frames at 25 Hz, frame k of luma 20 + 5 k, an I-frame every 12 and B-frames between.
/usr/bin/python3 -c "
import sys
for k in range(40):
    sys.stdout.buffer.write(bytes([20 + 5 * k]) * 4096 + bytes([128]) * 2048)" |
  ffmpeg -v error -f rawvideo -pix_fmt yuv420p -s 64x64 -r 25 -i - -c:v libx264 -qp 4 -bf 3 \
    -x264-params keyint=12:min-keyint=12:scenecut=0:b-adapt=0 whole.mp4
ffmpeg -v error -ss 0.4 -i whole.mp4 -c copy trimmed.mp4
seen=$(
  for name in whole trimmed; do
    echo "$name: ffprobe $(ffprobe -v error -count_frames -of csv=p=0 \
      -show_entries stream=nb_read_frames $name.mp4)"
    /usr/bin/python3 - $name.mp4 <<'PY'
import cv2, sys
video = cv2.VideoCapture(sys.argv[1], cv2.CAP_FFMPEG)
count = int(video.get(cv2.CAP_PROP_FRAME_COUNT))
number = lambda image: round((image.mean() * 219 / 255 - 4) / 5)
frames = []
while True:
    good, image = video.read()
    if not good:
        break
    frames.append(number(image))
seeks = 0
for k in range(count):
    video.set(cv2.CAP_PROP_POS_FRAMES, k)
    seeks += video.read()[0]
print(f'  OpenCV count {count}, read {len(frames)}, first {frames[0]}, seeks that work {seeks}')
PY
  done
)
printf '%s\n' "$seen"
expected='whole: ffprobe 40
  OpenCV count 40, read 40, first 0, seeks that work 40
trimmed: ffprobe 30
  OpenCV count 40, read 30, first 10, seeks that work 30'
if [ "$seen" != "$expected" ]; then
  echo "CHANGED: OpenCV counts the frames of a trimmed video otherwise than recorded"
  exit 1
fi
