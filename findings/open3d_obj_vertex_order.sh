#!/usr/bin/env bash
# python3-open3d 0.16.1+ds-2+b4 of Debian 12 (which reads OBJ by assimp 5.2.5): order of an OBJ's vertices.
# Guess: read_triangle_mesh keeps the vertices as the file lists them; a PLY of the same mesh agrees.
# Seen: vertices come in the order in which faces first use them, and those of no face vanish: the file's
#   vertices 1 to 6, with faces 5 4 3 and 3 4 2, come out as 5 4 3 2 (four of six). The same mesh as PLY keeps
#   all six in order. The count is often unchanged (every vertex used), so that nothing warns.
# For users of Atelier: a template, landmark list, set of skin weights or a registered sequence indexed by
#   vertex must reach Open3D as PLY; through OBJ each index points elsewhere.
set -euo pipefail
. "$(dirname "$(realpath "$0")")/debian.sh"
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
debian_packages python3-open3d=0.16.1+ds-2+b4
cat > run.py <<'PY'
# Valid: plain v and f lines; faces may name vertices in any order, and nothing asks that all be used. VTK 9.1
# and meshlab 2020.09 keep the six in order.
import sys
import open3d
points = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 1, 0), (4, 0, 0), (5, 0, 0)]   # x tells the place in the file
faces = [(4, 3, 2), (2, 3, 1)]
with open('mesh.obj', 'w') as file:
    file.writelines('v %g %g %g\n' % p for p in points)
    file.writelines('f %d %d %d\n' % tuple(i + 1 for i in f) for f in faces)
with open('mesh.ply', 'w') as file:
    file.write('ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n'
               'element face 2\nproperty list uchar int vertex_indices\nend_header\n')
    file.writelines('%g %g %g\n' % p for p in points)
    file.writelines('3 %d %d %d\n' % f for f in faces)
def order(path):
    return [int(p[0]) for p in open3d.io.read_triangle_mesh(path).vertices]
seen = order('mesh.obj'), order('mesh.ply')
print('OBJ', seen[0], 'PLY', seen[1])
if seen != ([4, 3, 2, 1], [0, 1, 2, 3, 4, 5]):
    sys.exit('changed: recorded was OBJ [4, 3, 2, 1], PLY [0, 1, 2, 3, 4, 5]')
PY
/usr/bin/python3 run.py
