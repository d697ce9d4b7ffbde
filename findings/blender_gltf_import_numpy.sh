#!/usr/bin/env bash
# blender 3.4.1+dfsg-2+b1 with python3-numpy 1:1.24.2-1+deb12u1, both of Debian 12: import of a glTF mesh.
# Guess: Blender's own importer, packaged with the rest of Debian, reads any valid glTF mesh.
# Seen: every mesh of triangles fails in the default setting, with normals or without: the add-on uses
#   `numpy.bool`, which NumPy 1.24 no longer has. The operator raises; nothing is in the scene. With the
#   name put back (`import numpy; numpy.bool = bool`) before the import, or with the option
#   import_shading "SMOOTH" or "FLAT", the same file gives its 3 vertices.
# For users of Atelier: open our .glb in Debian's Blender with
#   blender --python-expr "import numpy; numpy.bool = bool", or set Shading to "Smooth Shading" in the dialog.
set -euo pipefail
. "$(dirname "$(realpath "$0")")/debian.sh"
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
debian_packages blender=3.4.1+dfsg-2+b1 python3-numpy=1:1.24.2-1+deb12u1
export HOME=$work
cat > run.py <<'PY'
# Valid: one triangle of floats; gltf-validator 2.0.0-dev.3.10 finds neither errors nor warnings.
import base64, json, struct, sys
import bpy, numpy
data = struct.pack('<9f', 0, 0, 0, 1, 0, 0, 0, 1, 0) + struct.pack('<9f', *(0, 0, 1) * 3)
def write(path, attributes):
    json.dump({
        'asset': {'version': '2.0'}, 'scene': 0, 'scenes': [{'nodes': [0]}], 'nodes': [{'mesh': 0}],
        'meshes': [{'primitives': [{'attributes': attributes}]}],
        'buffers': [{'byteLength': 72, 'uri': 'data:application/octet-stream;base64,' + base64.b64encode(data).decode()}],
        'bufferViews': [{'buffer': 0, 'byteOffset': o, 'byteLength': 36} for o in (0, 36)],
        'accessors': [{'bufferView': 0, 'componentType': 5126, 'count': 3, 'type': 'VEC3', 'min': [0, 0, 0], 'max': [1, 1, 0]},
                      {'bufferView': 1, 'componentType': 5126, 'count': 3, 'type': 'VEC3'}]}, open(path, 'w'))
write('bare.gltf', {'POSITION': 0})
write('normals.gltf', {'POSITION': 0, 'NORMAL': 1})
def read(path, **options):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    try:
        bpy.ops.import_scene.gltf(filepath=path, **options)
    except RuntimeError as error:
        return "numpy has no 'bool'" if "no attribute 'bool'" in str(error) else str(error)
    return sum(len(o.data.vertices) for o in bpy.data.objects if o.type == 'MESH')
seen = [read('bare.gltf'), read('normals.gltf'), read('bare.gltf', import_shading='SMOOTH'),
        read('normals.gltf', import_shading='FLAT')]
numpy.bool = bool
seen.append(read('normals.gltf'))
print('SEEN', seen)
recorded = ["numpy has no 'bool'", "numpy has no 'bool'", 3, 3, 3]
if seen != recorded:
    print('SEEN changed: recorded was', recorded)
    sys.exit(1)
PY
status=0
blender --background --factory-startup --python-exit-code 1 --python run.py >log 2>&1 || status=1
grep '^SEEN' log || { tail -3 log; status=1; }
exit $status
