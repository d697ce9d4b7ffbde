#!/usr/bin/env bash
# A PLY whose faces are `element tristrips`, as Stanford's scanning tools wrote them, read by meshlab
# 2020.09+dfsg1-2, blender 3.4.1+dfsg-2+b1, assimp-utils 5.2.5~ds0-1+b1 and python3-open3d 0.16.1+ds-2+b4 of Debian 12.
# Guess: strips are read right or refused.
# Seen: four answers for one strip of six vertices, four triangles, all as success: meshlab has the four, right;
#   Blender has four, but 1 2 3 for 2 1 3 and 3 4 5 for 4 3 5: every second one faces inwards; assimp has the last
#   triangle of the strip alone, and turned; Open3D has none, a mesh of vertices only (it warns of a point cloud).
# For users of Atelier: old scans in strips come in with normals that alternate, which a registration by normals
#   then rejects, or nearly without surface. Convert by meshlab first, count the triangles. (Atelier refuses them.)
set -euo pipefail
. "$(dirname "$(realpath "$0")")/debian.sh"
command -v xvfb-run >/dev/null || { echo "needs xvfb-run (apt-get install xvfb)"; exit 77; }
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
debian_packages meshlab=2020.09+dfsg1-2 blender=3.4.1+dfsg-2+b1 assimp-utils=5.2.5~ds0-1+b1 python3-open3d=0.16.1+ds-2+b4
export HOME=$work
# Valid: an element of any name may have a list; tristrips with vertex_indices is the known form, a
# count and that many indices; every second triangle of a strip turns the other way round.
cat > strips.ply <<'PLY'
ply
format ascii 1.0
element vertex 6
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
0 2 0
1 2 0
6 0 1 2 3 4 5
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
meshlab [[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 5]]
Blender [[0, 1, 2], [1, 2, 3], [2, 3, 4], [3, 4, 5]]
assimp [[3, 4, 5]]
Open3D []
TEXT
cmp -s seen recorded || { echo "changed: recorded was"; cat recorded; exit 1; }
