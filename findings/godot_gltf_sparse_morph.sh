#!/usr/bin/env bash
# godot3-server 3.2.3-stable-1+b3 of Debian 12 imports a glTF whose morph target is a sparse accessor without
# bufferView (moves one vertex of four), shown by two nodes with weights of their own.
# Guess: the accessor starts from zeros, as the format says; each node keeps its weight.
# Seen: the accessor starts from buffer view 0, here the positions: the target's offset is the body itself, so
#   that the blend shape of a vertex at (1 0 0) is at (2 0 0): the face doubles in size where only a lip should
#   move. And a node's own weights are passed over: 0.25 of the mesh for both, where the second node says 0.75.
#   No error, no warning.
# For users of Atelier: write morph targets dense, or sparse over a buffer view of zeros, for engines of that age;
#   give each person a mesh of its own rather than weights on nodes.
set -euo pipefail
. "$(dirname "$(realpath "$0")")/debian.sh"
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
debian_packages godot3-server=3.2.3-stable-1+b3
export HOME=$work
cat > make.py <<'PY'
# Valid: glTF 2.0, 3.6.2.3: without bufferView a sparse accessor starts as zeros; 3.7.2.2: a node's weights
# override the mesh's. gltf-validator 2.0.0-dev.3.10 finds nothing; three 0.187.0, Babylon 9.28.0 and Blender
# 3.4.1 read offset (0 0 0.5) for vertex 3, none for the others, and both weights.
import base64, json, struct
data = (struct.pack('<12f', 0, 0, 0, 1, 0, 0, 0, 2, 0, 1, 2, 0) + struct.pack('<6H', 0, 1, 2, 1, 3, 2) +
        struct.pack('<2H', 3, 0) + struct.pack('<3f', 0, 0, 0.5))
json.dump({
    'asset': {'version': '2.0'}, 'scene': 0, 'scenes': [{'nodes': [0, 1]}],
    'nodes': [{'name': 'a', 'mesh': 0}, {'name': 'b', 'mesh': 0, 'weights': [0.75], 'translation': [5, 0, 0]}],
    'meshes': [{'weights': [0.25], 'primitives': [{'attributes': {'POSITION': 0}, 'indices': 1, 'targets': [{'POSITION': 2}]}]}],
    'buffers': [{'byteLength': len(data), 'uri': 'data:application/octet-stream;base64,' + base64.b64encode(data).decode()}],
    'bufferViews': [{'buffer': 0, 'byteOffset': o, 'byteLength': n} for o, n in ((0, 48), (48, 12), (60, 2), (64, 12))],
    'accessors': [
        {'bufferView': 0, 'componentType': 5126, 'count': 4, 'type': 'VEC3', 'min': [0, 0, 0], 'max': [1, 2, 0]},
        {'bufferView': 1, 'componentType': 5123, 'count': 6, 'type': 'SCALAR'},
        {'componentType': 5126, 'count': 4, 'type': 'VEC3', 'min': [0, 0, 0], 'max': [0, 0, 0.5],
         'sparse': {'count': 1, 'indices': {'bufferView': 2, 'componentType': 5123}, 'values': {'bufferView': 3}}}]},
    open('morph.gltf', 'w'))
PY
/usr/bin/python3 make.py
printf 'config_version=4\n[application]\nconfig/name="finding"\n' > project.godot
cat > read.gd <<'GD'
extends SceneTree
func _init():
	var scene = load("res://morph.gltf").instance()
	var mesh = scene.get_node("a").mesh
	print("SEEN shape ", mesh.surface_get_blend_shape_arrays(0)[0][0])
	for name in ["a", "b"]:
		print("SEEN weight of ", name, " ", scene.get_node(name).get("blend_shapes/" + mesh.get_blend_shape_name(0)))
	quit()
GD
timeout 240 godot3-server --path . --editor --quit >import.log 2>&1 || true
timeout 60 godot3-server --path . --script read.gd 2>/dev/null | grep '^SEEN' | tee seen || true
cat > recorded <<'TEXT'
SEEN shape [(0, 0, 0), (2, 0, 0), (0, 4, 0), (1, 2, 0.5)]
SEEN weight of a 0.25
SEEN weight of b 0.25
TEXT
cmp -s seen recorded || { echo "changed: recorded was"; cat recorded; exit 1; }
