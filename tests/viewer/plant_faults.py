"""Makes three faulty copies of a capture and of a workspace with registered garments, for trying whether a user finds
what is wrong by `atelier view` alone:

    python3 plant_faults.py CAPTURE WORKSPACE OUT [SEED]

OUT/camera    the capture, one camera turned by three degrees
OUT/torn      the workspace, thirty vertices of a garment 15 cm off in one frame
OUT/seam      the workspace, the cloth on one side of a line down the garment slides by 12 mm in the second half

Needs no further package: archives (docs/reference/formats.md) are changed in place, and their digest is made anew.
"""
import hashlib
import json
import math
import pathlib
import random
import re
import shutil
import struct
import sys


def change_vertices(file, change):
    """Writes change(x, y, z) over each vertex of an archive of a mesh."""
    data = bytearray(file.read_bytes())
    block = int(re.search(rb"\nblock (\d+)\n", data[:4096]).group(1))
    index = bytes(data[:block])
    _, _, kind, sizes, chunk, *offsets = re.search(rb"\n(dataset vertices [^\n]*)\n", index).group(1).decode().split()
    assert kind == "float64", kind
    rows, chunk = int(sizes.split(",")[0]), int(chunk)
    for row in range(rows):
        at = int(offsets[row // chunk]) + 24 * (row % chunk)
        struct.pack_into("<3d", data, at, *change(row, *struct.unpack_from("<3d", data, at)))
    line = data.index(b"\n") + 1
    digest = hashlib.sha256(data[line:]).hexdigest().encode()
    data[line - 1 - 64:line - 1] = digest
    file.unlink()  # copies may share what they are copies of
    file.write_bytes(data)


def vertices(file):
    places = []
    change_vertices_of = lambda row, x, y, z: places.append((x, y, z)) or (x, y, z)
    copy = file.with_suffix(".read")
    shutil.copy(file, copy)
    change_vertices(copy, change_vertices_of)
    copy.unlink()
    return places


def garment_frames(workspace):
    registered = sorted((workspace / "register/current/registered").iterdir())[0]
    return sorted((registered / "frames").glob("*.h5"))


def main():
    if len(sys.argv) not in (4, 5):
        sys.exit(__doc__)
    capture, workspace, out = map(pathlib.Path, sys.argv[1:4])
    pick = random.Random(*map(int, sys.argv[4:]))
    out.mkdir(parents=True)
    answers = {}

    shutil.copytree(capture, out / "camera")
    rig = json.loads((out / "camera/cameras.json").read_text())
    camera = pick.choice(rig["cameras"])
    c, s = math.cos(math.radians(3)), math.sin(math.radians(3))
    pose = camera["camera_from_world"]
    turn = [[c, 0, s], [0, 1, 0], [-s, 0, c]]
    pose["rotation"] = [[sum(turn[i][k] * pose["rotation"][k][j] for k in range(3)) for j in range(3)] for i in range(3)]
    pose["translation"] = [sum(turn[i][k] * pose["translation"][k] for k in range(3)) for i in range(3)]
    (out / "camera/cameras.json").write_text(json.dumps(rig))
    answers["camera"] = camera["id"]

    shutil.copytree(workspace, out / "torn", symlinks=True)
    frame = pick.choice(garment_frames(out / "torn")[1:])
    places = vertices(frame)
    centre = pick.choice(places)
    near = set(sorted(range(len(places)), key=lambda v: math.dist(places[v], centre))[:30])
    change_vertices(frame, lambda v, x, y, z: (x + 0.15, y, z) if v in near else (x, y, z))
    answers["torn"] = frame.stem

    shutil.copytree(workspace, out / "seam", symlinks=True)
    frames = garment_frames(out / "seam")
    begin = pick.uniform(-math.pi, math.pi)
    for frame in frames[len(frames) // 2:]:
        places = vertices(frame)
        mx, mz = (sum(p[k] for p in places) / len(places) for k in (0, 2))

        def slide(_, x, y, z):
            angle, radius = math.atan2(x - mx, z - mz), math.hypot(x - mx, z - mz)
            if (angle - begin) % (2 * math.pi) < 0.5:
                angle += 0.012 / max(radius, 0.05)
            return mx + radius * math.sin(angle), y, mz + radius * math.cos(angle)

        change_vertices(frame, slide)
    answers["seam"] = f"from frame {frames[len(frames) // 2].stem} on, {math.degrees(begin):.0f} degrees from the front"
    (out / "answers.json").write_text(json.dumps(answers, indent=1) + "\n")


main()
