#!/usr/bin/env bash
# godot3-server 3.2.3-stable-1+b3 of Debian 12 imports glTF animations by its defaults.
# Guess: linear keys are kept as they are; splines and steps are sampled finely enough.
# Seen: all is resampled at 15 keys a second. A spline comes out wrong in itself: at 0.5 and 0.75 s the file has
#   1.25 and 1.406 m, Godot 0.5 and 0.010 m (at 0.2 s it has 0.968 m for 0.584). A STEP becomes a ramp over the
#   last 67 ms before each key: at 0.97 s it stands at 0.55 for 0. A 120 Hz take of a hand shaking at 10 Hz with
#   20 mm comes out up to 26 mm off; keys between the samples are gone. No warning.
# For users of Atelier: set the import option animation/fps of Godot 3 to the rate of the take and
#   animation/optimizer/enabled to off before judging a motion there; splines and steps must be sampled by
#   whoever writes the file.
set -euo pipefail
. "$(dirname "$(realpath "$0")")/debian.sh"
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
debian_packages godot3-server=3.2.3-stable-1+b3
export HOME=$work
cat > make.py <<'PY'
# Valid: glTF 2.0, appendix C; strictly rising times with min and max. gltf-validator 2.0.0-dev.3.10 finds
# nothing; three 0.187.0, Babylon 9.28.0 and VTK 9.1 read 1.25 and 1.4063 from the spline.
import base64, json, math, struct
def write(name, kind, times, xs_and_tangents):
    values = [v for x in xs_and_tangents for v in (x, 0, 0)]
    parts = [struct.pack('<9f', 0, 0, 0, 1, 0, 0, 0, 1, 0), struct.pack(f'<{len(times)}f', *times), struct.pack(f'<{len(values)}f', *values)]
    data = b''.join(parts)
    starts = [0, len(parts[0]), len(parts[0]) + len(parts[1])]
    last = struct.unpack('<f', struct.pack('<f', times[-1]))[0]
    json.dump({
        'asset': {'version': '2.0'}, 'scene': 0, 'scenes': [{'nodes': [0]}], 'nodes': [{'name': 'hand', 'mesh': 0}],
        'meshes': [{'primitives': [{'attributes': {'POSITION': 0}}]}],
        'buffers': [{'byteLength': len(data), 'uri': 'data:application/octet-stream;base64,' + base64.b64encode(data).decode()}],
        'bufferViews': [{'buffer': 0, 'byteOffset': s, 'byteLength': len(p)} for s, p in zip(starts, parts)],
        'accessors': [{'bufferView': 0, 'componentType': 5126, 'count': 3, 'type': 'VEC3', 'min': [0, 0, 0], 'max': [1, 1, 0]},
                      {'bufferView': 1, 'componentType': 5126, 'count': len(times), 'type': 'SCALAR', 'min': [0], 'max': [last]},
                      {'bufferView': 2, 'componentType': 5126, 'count': len(values) // 3, 'type': 'VEC3'}],
        'animations': [{'name': 'take', 'samplers': [{'input': 1, 'output': 2, 'interpolation': kind}],
                        'channels': [{'sampler': 0, 'target': {'node': 0, 'path': 'translation'}}]}]}, open(name + '.gltf', 'w'))
write('spline', 'CUBICSPLINE', [0, 1, 2], [0, 0, 3, -3, 1, 3, -3, 2, 0])
write('step', 'STEP', [0, 1, 2], [0, 1, 2])
write('shake', 'LINEAR', [i / 120 for i in range(121)], [0.02 * math.sin(2 * math.pi * 10 * i / 120) for i in range(121)])
PY
/usr/bin/python3 make.py
printf 'config_version=4\n[application]\nconfig/name="finding"\n' > project.godot
cat > read.gd <<'GD'
extends SceneTree
func take(name):
	return load("res://" + name + ".gltf").instance().get_node("AnimationPlayer").get_animation("take")
func at(animation, time):
	var place = animation.transform_track_interpolate(0, float(time))
	return "%.3f" % place[0].x
func _init():
	var spline = take("spline")
	print("SEEN spline at 0.2 0.5 0.75 1: ", at(spline, 0.2), " ", at(spline, 0.5), " ", at(spline, 0.75), " ", at(spline, 1))
	var step = take("step")
	print("SEEN step at 0.9 0.97 1: ", at(step, 0.9), " ", at(step, 0.97), " ", at(step, 1))
	var shake = take("shake")
	var worst = 0.0
	for i in 121:
		var truth = 0.02 * sin(2 * PI * 10 * i / 120.0)
		var place = shake.transform_track_interpolate(0, i / 120.0)
		worst = max(worst, abs(place[0].x - truth))
	print("SEEN shake: ", shake.track_get_key_count(0), " keys of 121, ", "%.0f" % (1000 * worst), " mm off")
	quit()
GD
timeout 240 godot3-server --path . --editor --quit >import.log 2>&1 || true
timeout 60 godot3-server --path . --script read.gd 2>/dev/null | grep '^SEEN' | tee seen || true
cat > recorded <<'TEXT'
SEEN spline at 0.2 0.5 0.75 1: 0.968 0.500 0.010 1.000
SEEN step at 0.9 0.97 1: 0.000 0.550 1.000
SEEN shake: 12 keys of 121, 26 mm off
TEXT
cmp -s seen recorded || { echo "changed: recorded was"; cat recorded; exit 1; }
