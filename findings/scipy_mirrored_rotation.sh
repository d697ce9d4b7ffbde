#!/usr/bin/env bash
# python3-scipy 1.10.1, Debian 12: Rotation.from_matrix of a matrix that mirrors.
# Guess: a matrix of determinant -1 is refused, or its nearest rotation comes with a warning.
# Seen: neither: the mirror diag(-1, 1, 1) becomes a half turn about y, and a turn of 0.3 0.4 0.5 rad with the
#   same mirror becomes a turn by 21.4 degrees, of 37.7 before it was mirrored. No error, no warning.
# Valid: orthogonal matrices of determinant -1, as left-handed files, flipped axes and mirrored halves have.
# For users of Atelier: poses that were converted between handednesses by flipping one axis of the matrix alone
#   come out as other poses; check the determinant, and flip both sides (M R M).
set -euo pipefail
. "$(dirname "$(realpath "$0")")/debian.sh"
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
debian_packages python3-scipy=1.10.1-2
cat > run.py <<'PY'
import warnings
import numpy
from scipy.spatial.transform import Rotation
warnings.simplefilter('error')
mirror = numpy.diag([-1.0, 1, 1])
turn = Rotation.from_euler('xyz', [0.3, 0.4, 0.5])
print('mirror:', *Rotation.from_matrix(mirror).as_matrix().diagonal().astype(int))
print(f'turn: {numpy.degrees(turn.magnitude()):.1f} degrees, '
      f'mirrored {numpy.degrees(Rotation.from_matrix(turn.as_matrix() @ mirror).magnitude()):.1f}')
PY
seen=$(/usr/bin/python3 run.py)
printf '%s\n' "$seen"
[ "$seen" = 'mirror: -1 1 -1
turn: 37.7 degrees, mirrored 21.4' ] || { echo "CHANGED: SciPy takes mirrored matrices otherwise than recorded"; exit 1; }
