#!/usr/bin/env bash
# python3-opencv 4.6.0, Debian 12: decomposeProjectionMatrix of a camera's 3 x 4 matrix P and of -P.
# Guess: P and -P are one camera, as projections are up to a factor; both give the same K, R and centre.
# Seen: of -P the centre is right, K has -500, -400 and -1 for 500, 400 and 1 (divided by its corner: focal
#   lengths of -1000) and R, whose determinant is 1, is a half turn off: 180.0 degrees. No error.
# Valid: P = K [R | t] of f 1000, centre (500, 400) and a camera 3 m away; both project alike.
# For users of Atelier: matrices by DLT or MATLAB have any sign. Multiply P by the sign of the determinant of its
#   left 3 x 3 before it is taken apart and written as a calibration.
set -euo pipefail
. "$(dirname "$(realpath "$0")")/debian.sh"
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
debian_packages python3-opencv=4.6.0+dfsg-12
cat > run.py <<'PY'
import cv2, numpy
K = numpy.array([[1000, 0, 500], [0, 1000, 400], [0, 0, 1.0]])
R = cv2.Rodrigues(numpy.array([0.1, 0.2, 0.3]))[0]
t = numpy.array([[0.1], [0.2], [3]])
P = K @ numpy.hstack([R, t])
for sign in (1, -1):
    k, r, c = cv2.decomposeProjectionMatrix(sign * P)[:3]
    centre = numpy.abs(c[:3] / c[3] + R.T @ t).max()
    angle = numpy.degrees(numpy.arccos(numpy.clip((numpy.trace(r.T @ R) - 1) / 2, -1, 1)))
    print(f'{sign:+d} P: K {k[0, 0]:.0f} {k[0, 2]:.0f} {k[1, 2]:.0f} {k[2, 2]:.0f}, det R {numpy.linalg.det(r):.0f}, '
          f'R {angle:.1f} degrees off, centre {centre:.3f} off')
PY
seen=$(/usr/bin/python3 run.py)
printf '%s\n' "$seen"
[ "$seen" = '+1 P: K 1000 500 400 1, det R 1, R 0.0 degrees off, centre 0.000 off
-1 P: K 1000 -500 -400 -1, det R 1, R 180.0 degrees off, centre 0.000 off' ] ||
  { echo "CHANGED: OpenCV takes projection matrices apart otherwise than recorded"; exit 1; }
