#!/usr/bin/env bash
# python3-vtk9 9.1.0+really9.1.0+dfsg2-5+deb12u1 of Debian 12: vtkGLTFReader on an animation whose sampler is
# STEP, asked at the keys' own times and between.
# Guess: at a key's time the key's value holds: glTF 2.0 keeps the output of a keyframe "until the next keyframe"
#   (animation.sampler.interpolation).
# Seen: at each key's own time it still gives the key before, and the last key is never shown: keys 0, 1, 2 at
#   0, 1, 2 s are read at these times as 0, 0, 1. A hundredth later the value is right. LINEAR and CUBICSPLINE
#   samplers are right at their keys.
# For users of Atelier: a mesh sequence as STEP weights, asked at its own frame times as any tool for analysis
#   does, is shown one frame late, beside a skeleton (LINEAR) of the right frame; at 30 Hz a hand at 3 m/s is
#   then 10 cm off. Ask VTK a little after each frame.
set -euo pipefail
. "$(dirname "$(realpath "$0")")/debian.sh"
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
debian_packages python3-vtk9=9.1.0+really9.1.0+dfsg2-5+deb12u1
cat > run.py <<'PY'
# Valid: a triangle, strictly rising times with min and max, one VEC3 a key; gltf-validator 2.0.0-dev.3.10
# finds neither errors nor warnings. three 0.187.0, Babylon 9.28.0 and Blender 3.4.1 read 0, 1, 2 at the keys.
import base64, json, struct, sys, vtk
def write(path, kind):
    keys = [0, 0, 0, 1, 0, 0, 2, 0, 0]
    data = struct.pack('<9f', 0, 0, 0, 1, 0, 0, 0, 1, 0) + struct.pack('<3f', 0, 1, 2) + struct.pack('<9f', *keys)
    file = {
        'asset': {'version': '2.0'}, 'scene': 0, 'scenes': [{'nodes': [0]}], 'nodes': [{'mesh': 0}],
        'meshes': [{'primitives': [{'attributes': {'POSITION': 0}}]}],
        'buffers': [{'byteLength': len(data), 'uri': 'data:application/octet-stream;base64,' + base64.b64encode(data).decode()}],
        'bufferViews': [{'buffer': 0, 'byteOffset': o, 'byteLength': n} for o, n in ((0, 36), (36, 12), (48, 36))],
        'accessors': [
            {'bufferView': 0, 'componentType': 5126, 'count': 3, 'type': 'VEC3', 'min': [0, 0, 0], 'max': [1, 1, 0]},
            {'bufferView': 1, 'componentType': 5126, 'count': 3, 'type': 'SCALAR', 'min': [0], 'max': [2]},
            {'bufferView': 2, 'componentType': 5126, 'count': 3, 'type': 'VEC3'}],
        'animations': [{'samplers': [{'input': 1, 'output': 2, 'interpolation': kind}],
                        'channels': [{'sampler': 0, 'target': {'node': 0, 'path': 'translation'}}]}]}
    json.dump(file, open(path, 'w'))
def read(path):
    reader = vtk.vtkGLTFReader()
    reader.SetFileName(path)
    reader.UpdateInformation()
    reader.EnableAnimation(0)
    seen = {}
    for time in (0.0, 0.5, 1.0, 1.01, 2.0):
        reader.UpdateTimeStep(time)
        leaf = reader.GetOutput().NewIterator()
        leaf.InitTraversal()
        seen[time] = round(leaf.GetCurrentDataObject().GetPoint(0)[0], 4)
    return seen
recorded = {'STEP': {0.0: 0, 0.5: 0, 1.0: 0, 1.01: 1, 2.0: 1}, 'LINEAR': {0.0: 0, 0.5: 0.5, 1.0: 1, 1.01: 1.01, 2.0: 2}}
for kind, expected in recorded.items():
    write(kind + '.gltf', kind)
    seen = read(kind + '.gltf')
    print(kind, 'x of the first vertex by time:', seen)
    if seen != expected:
        sys.exit(f'changed: recorded was {expected}')
PY
/usr/bin/python3 run.py
