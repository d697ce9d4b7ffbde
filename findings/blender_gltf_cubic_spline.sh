#!/usr/bin/env bash
# blender 3.4.1+dfsg-2+b1 of Debian 12 imports a glTF translation whose sampler is CUBICSPLINE (numpy.bool is
# put back first, see blender_gltf_import_numpy.sh).
# Guess: Blender's curves are cubic too, so that the spline is kept; at worst it is sampled.
# Seen: the keys are kept, the tangents are dropped and replaced by automatic ones: at half a second the
#   spline of the file is at 1.25 m, a straight line would be at 0.5 m, Blender shows 0.3125 m. It is neither
#   the file's curve nor a line, and it starts out on the wrong side of both. No warning.
# For users of Atelier: write motion with linear samplers (as ours is); a spline by somebody else must be
#   sampled before Blender sees it. What Blender then exports has the wrong path baked in.
set -euo pipefail
. "$(dirname "$(realpath "$0")")/debian.sh"
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
debian_packages blender=3.4.1+dfsg-2+b1
export HOME=$work
cat > run.py <<'PY'
# Valid: glTF 2.0, appendix C: in-tangent, value and out-tangent for each key. gltf-validator 2.0.0-dev.3.10
# finds nothing; three 0.187.0, Babylon 9.28.0, VTK 9.1 and playcanvas 2.23.3 read 1.25 and 1.4063.
import base64, json, struct, sys
import bpy, numpy
numpy.bool = bool
spline = [0, 0, 0, 0, 0, 0, 3, 0, 0, -3, 0, 0, 1, 0, 0, 3, 0, 0, -3, 0, 0, 2, 0, 0, 0, 0, 0]
data = struct.pack('<9f', 0, 0, 0, 1, 0, 0, 0, 1, 0) + struct.pack('<3f', 0, 1, 2) + struct.pack('<27f', *spline)
json.dump({
    'asset': {'version': '2.0'}, 'scene': 0, 'scenes': [{'nodes': [0]}], 'nodes': [{'name': 'pelvis', 'mesh': 0}],
    'meshes': [{'primitives': [{'attributes': {'POSITION': 0}}]}],
    'buffers': [{'byteLength': len(data), 'uri': 'data:application/octet-stream;base64,' + base64.b64encode(data).decode()}],
    'bufferViews': [{'buffer': 0, 'byteOffset': o, 'byteLength': n} for o, n in ((0, 36), (36, 12), (48, 108))],
    'accessors': [{'bufferView': 0, 'componentType': 5126, 'count': 3, 'type': 'VEC3', 'min': [0, 0, 0], 'max': [1, 1, 0]},
                  {'bufferView': 1, 'componentType': 5126, 'count': 3, 'type': 'SCALAR', 'min': [0], 'max': [2]},
                  {'bufferView': 2, 'componentType': 5126, 'count': 9, 'type': 'VEC3'}],
    'animations': [{'samplers': [{'input': 1, 'output': 2, 'interpolation': 'CUBICSPLINE'}],
                    'channels': [{'sampler': 0, 'target': {'node': 0, 'path': 'translation'}}]}]}, open('spline.gltf', 'w'))
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath='spline.gltf')
scene = bpy.context.scene
def at(time):
    frame = time * scene.render.fps
    scene.frame_set(int(frame), subframe=frame % 1)
    return round(bpy.data.objects['pelvis'].matrix_world.translation.x, 4)
def hermite(time):
    i, t = (0, time) if time < 1 else (1, time - 1)
    p, m, n, q = spline[9 * i + 3], spline[9 * i + 6], spline[9 * i + 9], spline[9 * i + 12]
    return (2*t**3 - 3*t**2 + 1)*p + (t**3 - 2*t**2 + t)*m + (3*t**2 - 2*t**3)*q + (t**3 - t**2)*n
times = (0.5, 0.75, 1.0, 1.5)
seen = [at(t) for t in times]
print('SEEN Blender', seen, 'the file says', [round(hermite(t), 4) for t in times])
if seen != [0.3125, 0.6328, 1.0, 1.6875]:
    print('SEEN changed: recorded was [0.3125, 0.6328, 1.0, 1.6875]')
    sys.exit(1)
PY
status=0
blender --background --factory-startup --addons io_scene_gltf2 --python-exit-code 1 --python run.py >log 2>&1 || status=1
grep '^SEEN' log || { tail -3 log; status=1; }
exit $status
