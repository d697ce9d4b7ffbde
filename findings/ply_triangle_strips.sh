#!/usr/bin/env bash
# A PLY whose faces are `element tristrips`, as the Stanford scans have them, read by meshlab 2020.09+dfsg1-2,
# blender 3.4.1+dfsg-2+b1, assimp-utils 5.2.5~ds0-1+b1 and python3-open3d 0.16.1+ds-2+b4 of Debian 12.
# Guess: strips are read (all of these know the Stanford scans) or refused.
# Seen: four answers for a strip of four vertices, two triangles, all as success: meshlab has 0 1 2 and 2 1 3,
#   which is right; Blender 0 1 2 and 1 2 3, so every second triangle faces inwards; assimp 1 2 3 alone, the
#   first triangle of each strip is gone; Open3D none, a mesh of vertices only (a warning says "point cloud").
# For users of Atelier: old scans in strips come in with holes or with normals that alternate, which a
#   registration by normals then rejects. Convert by meshlab first, count the triangles.
set -euo pipefail
need() { [ "$(dpkg-query -W -f='${Version}' "$1" 2>/dev/null)" = "$2" ] || { echo "needs $1=$2 (apt-get install)"; exit 77; }; }
need meshlab 2020.09+dfsg1-2
need blender 3.4.1+dfsg-2+b1
need assimp-utils 5.2.5~ds0-1+b1
need python3-open3d 0.16.1+ds-2+b4
command -v xvfb-run >/dev/null || { echo "needs xvfb-run (apt-get install xvfb)"; exit 77; }
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
export HOME=$work
# Valid: an element of any name may have a list; tristrips with vertex_indices is the Stanford repository's own
# form, a count and that many indices; every second triangle of a strip turns the other way round.
cat > strips.ply <<'PLY'
ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element tristrips 1
property list int int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
1 1 0
4 0 1 2 3
PLY
cat > by_meshlab.py <<'PY'
print([[int(i) for i in line.split()[1:4]] for line in open('strips.off').read().splitlines()[2:] if line.startswith('3 ')])
PY
cat > by_blender.py <<'PY'
import bpy
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_mesh.ply(filepath='strips.ply')
print('SEEN', [list(p.vertices) for p in bpy.data.meshes[0].polygons])
PY
cat > by_assimp.py <<'PY'
import json
print(json.load(open('scene.json'))['meshes'][0]['faces'])
PY
cat > by_open3d.py <<'PY'
import open3d
open3d.utility.set_verbosity_level(open3d.utility.VerbosityLevel.Error)
print([list(t) for t in open3d.io.read_triangle_mesh('strips.ply').triangles])
PY
xvfb-run -a meshlabserver -i strips.ply -o strips.off >/dev/null 2>&1
blender --background --factory-startup --python by_blender.py >log 2>&1
assimp export strips.ply scene.json -fassjson >/dev/null
{
  echo "meshlab $(/usr/bin/python3 by_meshlab.py)"
  echo "Blender $(sed -n 's/^SEEN //p' log)"
  echo "assimp $(/usr/bin/python3 by_assimp.py)"
  echo "Open3D $(/usr/bin/python3 by_open3d.py)"
} | tee seen
cat > recorded <<'TEXT'
meshlab [[0, 1, 2], [2, 1, 3]]
Blender [[0, 1, 2], [1, 2, 3]]
assimp [[1, 2, 3]]
Open3D []
TEXT
cmp -s seen recorded || { echo "changed: recorded was"; cat recorded; exit 1; }
