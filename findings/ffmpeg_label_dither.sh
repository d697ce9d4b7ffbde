#!/usr/bin/env bash
# ffmpeg 5.1.9 (Debian 12): PNG of 16 bits to 8 bits (-pix_fmt gray), beside python3-pil's Pillow.
# Guess: each value goes to one value (v / 257 rounded, or v >> 8): a flat picture stays flat.
# Seen: an ordered dither by default: a flat picture of 1500 comes out as 5 and 6 in a pattern, so
#   that 1500 can come out above 1535. -sws_dither none gives one value for each.
# Valid: greyscale of 16 bits; Pillow reads one flat value of 1500 from the same file.
# For users of Atelier: label images and masks kept in 16 bits, and depth for a preview, get values
#   that no pixel had; convert labels before, or give -sws_dither none.
set -euo pipefail
. "$(dirname "$(realpath "$0")")/debian.sh"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
debian_packages ffmpeg=7:5.1.9-0+deb12u1 python3-pil=9.4.0-1.1+deb12u1

/usr/bin/python3 - <<'PY'
from PIL import Image
for value in (0, 1500, 1535, 40000, 65535):
    image = Image.new('I;16', (32, 32), value)
    image.save(f'{value}.png')
    assert Image.open(f'{value}.png').getextrema() == (value, value)
PY
values() {
  ffmpeg -v error -i "$1.png" "${@:2}" -f rawvideo -pix_fmt gray - |
    /usr/bin/python3 -c "import sys; print(*sorted(set(sys.stdin.buffer.read())))"
}
seen=$(for value in 0 1500 1535 40000 65535; do
  echo "$value: $(values $value); -sws_dither none: $(values $value -sws_dither none)"
done)
printf '%s\n' "$seen"
expected='0: 0; -sws_dither none: 0
1500: 5 6; -sws_dither none: 5
1535: 5 6; -sws_dither none: 5
40000: 155 156; -sws_dither none: 156
65535: 255; -sws_dither none: 255'
if [ "$seen" != "$expected" ]; then
  echo "CHANGED: ffmpeg reduces 16 bits otherwise than recorded"
  exit 1
fi
