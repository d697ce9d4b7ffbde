#!/usr/bin/env bash
# ffmpeg 5.1.9 (filter hstack) and python3-opencv 4.6.0, Debian 12: two cameras, the second of
# which starts 0.2 s later, as its edit list says (an empty edit).
# Guess: hstack pairs frames by their times, and CAP_PROP_POS_MSEC of the late one begins at 200.
# Seen: both forget the start. ffmpeg moves each input to zero, so that frame k stands beside frame
#   k, five frames apart in time; -copyts keeps the times (frame 5 beside 0). OpenCV says 0 ms for
#   the first frame of both.
# Valid: ISO/IEC 14496-12, 8.6.6: media_time -1 is an empty edit; ffprobe says start_time 0.2.
# For users of Atelier: offsets of synchronised cameras that live in the container are lost in
#   mosaics and in frame times; take start_time from ffprobe and give the
#   offset by hand (Atelier says it: `video-start`).
set -euo pipefail
. "$(dirname "$(realpath "$0")")/debian.sh"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
debian_packages python3-opencv=4.6.0+dfsg-12 ffmpeg=7:5.1.9-0+deb12u1

# 40 grey frames at 25 Hz; frame k has luma 20 + 5 k.
/usr/bin/python3 -c "
import sys
for k in range(40):
    sys.stdout.buffer.write(bytes([20 + 5 * k]) * 4096 + bytes([128]) * 2048)" |
  ffmpeg -v error -f rawvideo -pix_fmt yuv420p -s 64x64 -r 25 -i - -c:v libx264 -qp 4 a.mp4
ffmpeg -v error -itsoffset 0.2 -i a.mp4 -c copy late.mp4
pairs() {
  ffmpeg -v error "$@" -i a.mp4 "$@" -i late.mp4 -filter_complex hstack -fps_mode passthrough \
    -f rawvideo -pix_fmt gray - | /usr/bin/python3 -c "
import sys
data = sys.stdin.buffer.read()
number = lambda value: round((value * 219 / 255 - 4) / 5)
print(*[f'{number(data[at])}:{number(data[at + 64])}' for at in range(0, len(data), 8192)][7:10])"
}
seen=$(
  echo "start_time $(ffprobe -v error -of csv=p=0 -show_entries stream=start_time late.mp4)"
  echo "hstack: $(pairs)"
  echo "hstack with -copyts: $(pairs -copyts)"
  /usr/bin/python3 - <<'PY'
import cv2
for name in ['a', 'late']:
    video = cv2.VideoCapture(name + '.mp4', cv2.CAP_FFMPEG)
    video.read()
    print(f'OpenCV {name}: first frame at {video.get(cv2.CAP_PROP_POS_MSEC):.0f} ms')
PY
)
printf '%s\n' "$seen"
expected='start_time 0.200000
hstack: 7:7 8:8 9:9
hstack with -copyts: 12:7 13:8 14:9
OpenCV a: first frame at 0 ms
OpenCV late: first frame at 0 ms'
if [ "$seen" != "$expected" ]; then
  echo "CHANGED: the start of a late camera is treated otherwise than recorded"
  exit 1
fi
