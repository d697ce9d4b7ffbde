#!/usr/bin/env bash
# python3-open3d 0.16.1+ds-2+b4 of Debian 12: read_triangle_mesh of a glTF whose nodes place and scale a mesh.
# Guess: the scene is flattened: each node's mesh is placed by its transform and added.
# Seen: nodes are not looked at: the mesh comes once, in its own coordinates. A body in centimetres under a node
#   of scale 0.01, as exporters from centimetre programs write it, is 100 times as large, and a second
#   node that shows the same mesh at (5 0 0) is missing. 3 vertices for 6, no warning. VTK 9.1 gives both,
#   placed.
# For users of Atelier: before comparing an avatar with a scan in Open3D flatten the file (gltf-transform
#   flatten and join), and check the extents.
set -euo pipefail
. "$(dirname "$(realpath "$0")")/debian.sh"
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
debian_packages python3-open3d=0.16.1+ds-2+b4 python3-vtk9=9.1.0+really9.1.0+dfsg2-5+deb12u1
cat > make.py <<'PY'
# Valid: glTF 2.0, 3.7.4: a mesh may be shown by many nodes, each with its transform; gltf-validator
# 2.0.0-dev.3.10 finds nothing.
import base64, json, struct
data = struct.pack('<9f', 0, 0, 0, 100, 0, 0, 0, 100, 0)
json.dump({
    'asset': {'version': '2.0'}, 'scene': 0, 'scenes': [{'nodes': [0, 1]}],
    'nodes': [{'name': 'body', 'mesh': 0, 'scale': [0.01] * 3},
              {'name': 'again', 'mesh': 0, 'scale': [0.01] * 3, 'translation': [5, 0, 0]}],
    'meshes': [{'primitives': [{'attributes': {'POSITION': 0}}]}],
    'buffers': [{'byteLength': 36, 'uri': 'data:application/octet-stream;base64,' + base64.b64encode(data).decode()}],
    'bufferViews': [{'buffer': 0, 'byteLength': 36}],
    'accessors': [{'bufferView': 0, 'componentType': 5126, 'count': 3, 'type': 'VEC3', 'min': [0, 0, 0], 'max': [100, 100, 0]}]},
    open('nodes.gltf', 'w'))
PY
cat > by_open3d.py <<'PY'
import open3d
mesh = open3d.io.read_triangle_mesh('nodes.gltf')
print('Open3D', len(mesh.vertices), 'vertices, x up to %g' % max(p[0] for p in mesh.vertices))
PY
cat > by_vtk.py <<'PY'
import vtk
reader = vtk.vtkGLTFReader()
reader.SetFileName('nodes.gltf')
reader.Update()
leaf, count, most = reader.GetOutput().NewIterator(), 0, 0
leaf.InitTraversal()
while not leaf.IsDoneWithTraversal():
    part = leaf.GetCurrentDataObject()
    count, most = count + part.GetNumberOfPoints(), max(most, part.GetBounds()[1])
    leaf.GoToNextItem()
print('VTK', count, 'vertices, x up to %g' % most)
PY
/usr/bin/python3 make.py
for tool in open3d vtk; do /usr/bin/python3 by_$tool.py; done | tee seen
printf 'Open3D 3 vertices, x up to 100\nVTK 6 vertices, x up to 6\n' > recorded
cmp -s seen recorded || { echo "changed: recorded was"; cat recorded; exit 1; }
