#!/usr/bin/env bash
# A PLY with colours as `property float red` (1, 0.5, 0.25, as scanners and point-cloud tools write), read by
# python3-open3d 0.16.1+ds-2+b4, python3-vtk9 9.1.0 and assimp-utils 5.2.5~ds0-1+b1 of Debian 12.
# Guess: floats are taken as 0 to 1, or not at all; the three agree.
# Seen: three answers for one file, no warning: Open3D divides by 255 all the same (0.0039, 0.0020, 0.0010:
#   black); VTK cuts the floats down to bytes 1, 0, 0 of 255 (black, and every value below 1 is 0 for good);
#   assimp takes them as they are (1, 0.5, 0.25).
# For users of Atelier: write scan colours as uchar, as we do; a scan that comes in black has float colours.
#   After VTK's reader the texture cannot be brought back by scaling.
set -euo pipefail
. "$(dirname "$(realpath "$0")")/debian.sh"
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
debian_packages python3-open3d=0.16.1+ds-2+b4 python3-vtk9=9.1.0+really9.1.0+dfsg2-5+deb12u1 assimp-utils=5.2.5~ds0-1+b1
# Valid: the header gives each property its type freely; red, green and blue are names by custom. three's
# PLYLoader 0.187.0 reads 1, 0.5, 0.25 too (before its step from sRGB to linear).
cat > colours.ply <<'PLY'
ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
property float red
property float green
property float blue
element face 1
property list uchar int vertex_indices
end_header
0 0 0 1 0.5 0.25
1 0 0 1 0.5 0.25
0 1 0 1 0.5 0.25
3 0 1 2
PLY
cat > by_open3d.py <<'PY'
import open3d
print('Open3D', *('%.4f' % c for c in open3d.io.read_triangle_mesh('colours.ply').vertex_colors[0]))
PY
cat > by_vtk.py <<'PY'
import vtk
reader = vtk.vtkPLYReader()
reader.SetFileName('colours.ply')
reader.Update()
array = reader.GetOutput().GetPointData().GetScalars()
print('VTK', array.GetDataTypeAsString(), *(int(c) for c in array.GetTuple(0)))
PY
cat > by_assimp.py <<'PY'
import json
print('assimp', *json.load(open('scene.json'))['meshes'][0]['colors'][0][:3])
PY
assimp export colours.ply scene.json -fassjson >/dev/null
for tool in open3d vtk assimp; do /usr/bin/python3 by_$tool.py; done | tee seen
cat > recorded <<'TEXT'
Open3D 0.0039 0.0020 0.0010
VTK unsigned char 1 0 0
assimp 1 0.5 0.25
TEXT
cmp -s seen recorded || { echo "changed: recorded was"; cat recorded; exit 1; }
