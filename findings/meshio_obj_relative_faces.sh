#!/usr/bin/env bash
# python3-meshio 7.0.0-3 of Debian 12 on an OBJ whose faces count back from the last vertex (f -3 -2 -1), and on
# a PLY whose coordinates stand in the order z, y, x.
# Guess: both are read as the formats say, or refused.
# Seen: no error, wrong meshes. OBJ: each -1 becomes -2 and so on, and as an index into the finished array all
#   pieces point at the last one: two triangles in two blocks both come out as (-4 -3 -2) of six points, which
#   numpy takes as points 2, 3, 4, a triangle that the file does not have. PLY: the points come out as an
#   array of one column (z's place is taken for x's), y and x among the point data.
# For users of Atelier: a sequence or garment exported in blocks with relative indices is garbage in meshio,
#   and in what converts by it. Write absolute indices and x y z, as we do.
set -euo pipefail
. "$(dirname "$(realpath "$0")")/debian.sh"
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
debian_packages python3-meshio=7.0.0-3
# Valid: in OBJ a negative number counts back from the vertex last defined; in PLY the header gives the order.
# VTK 9.1, Open3D 0.16.1 (OBJ) and three 0.187.0 read triangles 0 1 2 and 3 4 5, and x y z by name.
printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 0 0 5\nv 1 0 5\nv 0 1 5\nf -3 -2 -1\n' > blocks.obj
printf '%s\n' ply 'format ascii 1.0' 'element vertex 3' 'property float z' 'property float y' 'property float x' \
  'element face 1' 'property list uchar int vertex_indices' end_header '9 0 0' '9 0 1' '9 1 0' '3 0 1 2' > turned.ply
cat > run.py <<'PY'
import sys, warnings
warnings.simplefilter('ignore')
import meshio
faces = [face for block in meshio.read('blocks.obj').cells for face in block.data.tolist()]
turned = meshio.read('turned.ply')
seen = faces, turned.points.tolist(), sorted(turned.point_data)
print('OBJ faces', seen[0], '\nPLY points', seen[1], 'and point data', seen[2])
recorded = [[-4, -3, -2], [-4, -3, -2]], [[0.0], [0.0], [1.0]], ['x', 'y']
if seen != recorded:
    sys.exit(f'changed: recorded was {recorded}')
PY
/usr/bin/python3 run.py
