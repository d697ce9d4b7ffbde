"""Rows of glTF, BVH, meshes, USD, arrays and videos."""

import json
import pathlib
import re
import struct
import tempfile

import h5py
import numpy
from held import box, largest
from programs import Row, blender, debian, npm, output, python


def gltf_meshes(path):
    """What a .glb says of its meshes: box of POSITION, vertices, triangles."""
    data = path.read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    root = json.loads(data[20 : 20 + length])
    meshes = {}
    for mesh in root["meshes"]:
        (primitive,) = mesh["primitives"]
        places = root["accessors"][primitive["attributes"]["POSITION"]]
        meshes[mesh["name"]] = (
            places["min"] + places["max"],
            places["count"],
            root["accessors"][primitive["indices"]]["count"] // 3,
        )
    return meshes


def gltf_rows(held, exports):
    path = exports / "glb/animate/avatar.glb"
    meshes = gltf_meshes(path)
    times = [held.time(frame) for frame in held.shown[1:]]
    triangles = sum(len(faces) for faces in held.faces.values())
    still = [box for box, _, _ in meshes.values()]
    union = [*numpy.min(still, axis=0)[:3], *numpy.max(still, axis=0)[3:]]
    moving = f"{len(meshes)} meshes, {triangles:,} triangles, {held.frames()}"
    frame_of = lambda name, frame: f"{name}@{held.time(frame) if frame else 'rest'}"

    def validator():
        version, found = npm("gltf-validator", "gltf_validator.mjs", path)
        vertices, count, clips, influences = found["counts"]
        assert (count, clips, influences) == (triangles, 1, 4), found
        wrong = found["errors"][0] + found["warnings"][0]
        return Row(
            f"gltf-validator {version}",
            f"{vertices:,.0f} vertices, {count:,.0f} triangles, 1 animation, 4 influences",
            wrong,
            "errors and warnings",
            0,
        )

    def three():
        version, found = npm("three", "three.mjs", "gltf", path, *times)
        off = 1000 * largest(found, held.boxes(frame_of))
        return Row(f"three.js {version}", moving, off, "mm", 0.05, "an AnimationMixer, to play")

    def babylon():
        version, found = npm("@babylonjs/core", "babylon.mjs", "gltf", path, *times)
        off = 1000 * largest(found, held.boxes(frame_of))
        return Row(f"Babylon.js {version}", moving, off, "mm", 0.05, "`useRightHandedSystem`, or x is mirrored")

    def vtk():
        found = python("vtkmodules", "vtk_judge.py", "gltf", path, held.fps, *held.shown)
        order = {name: number for number, name in enumerate(meshes)}
        off = 1000 * largest(found, held.boxes(lambda name, frame: f"{order[name]}@{frame}"))
        return Row(
            f"VTK {found['version'][0]}",
            moving,
            off,
            "mm",
            0.05,
            "`ApplyDeformationsToGeometryOn`, `EnableAnimation(0)`",
        )

    def by_blender():
        frames = {frame: f"{24 * frame / held.fps:.6g}" for frame in held.shown}
        version, found = blender("gltf", path, *frames.values())
        off = 1000 * largest(found, held.boxes(lambda name, frame: f"{name}@{frames[frame]}"))
        return Row(
            version,
            moving + ", its reader mended",
            off,
            "mm",
            0.05,
            f"{held.fps:g} frames a second before the import; as Debian 12 packs it no mesh is imported until "
            'Shading is "Smooth" or its console was told `numpy.bool = bool`',
        )

    def transform():
        version, found = npm("@gltf-transform/core", "gltf_transform.mjs", path)
        for name, (_, vertices, count) in meshes.items():
            assert found[f"mesh:{name}"] == [vertices, count], found
        off = abs(found["end"][0] - (len(held.ids) - 1) / held.fps)
        return Row(
            f"glTF Transform {version}",
            f"{len(meshes)} meshes, {triangles:,} triangles, the last time of the clip",
            1000 * off,
            "ms",
            0.001,
            "`getBounds` takes the body at rest",
        )

    def loaders_gl():
        version, found = npm("@loaders.gl/gltf", "loaders_gl.mjs", "gltf", path)
        for name, (_, vertices, count) in meshes.items():
            assert found[f"mesh:{name}"][:2] == [vertices, count], found
        off = max(
            float(numpy.abs(numpy.subtract(found[f"mesh:{name}"][2:], corners)).max())
            for name, (corners, _, _) in meshes.items()
        )
        return Row(
            f"loaders.gl {version}",
            f"{len(meshes)} meshes, {triangles:,} triangles, as written",
            1000 * off,
            "mm",
            0.001,
        )

    def assimp():
        info = output("assimp", "info", path)
        count = int(re.search(r"Faces: +(\d+)", info)[1])
        assert count == triangles, info
        corners = [
            float(word)
            for key in ("Minimum point", "Maximum point")
            for word in re.search(rf"{key} +\((\S+) (\S+) (\S+)\)", info).groups()
        ]
        off = float(numpy.abs(numpy.subtract(corners, union)).max())
        bones = re.search(r"Bones: +(\d+)", info)[1]
        return Row(
            f"assimp {debian('assimp-utils')}",
            f"{count:,} triangles, {bones} bones, body at rest beside garments of the first frame",
            1000 * off,
            "mm",
            0.001,
            "skin and weights by your own code, or frames of `--format ply`",
        )

    def open3d():
        found = python("open3d", "open3d_judge.py", path)["mesh"]
        assert found[1] == triangles, found
        off = float(numpy.abs(numpy.subtract(found[2:], union)).max())
        return Row(
            f"Open3D {debian('python3-open3d')}",
            f"{triangles:,} triangles, body at rest beside garments of the first frame",
            1000 * off,
            "mm",
            0.001,
            "frames of `--format ply`: it has no skins",
        )

    return [validator, three, babylon, by_blender, vtk, transform, loaders_gl, assimp, open3d]


def assimp_joints(path, frames):
    """Places of all joints in frames, by assimp's own channels."""
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "a.assjson"
        output("assimp", "export", path, file, "-fassjson")
        scene = json.loads(file.read_text())
    channels = {channel["name"]: channel for channel in scene["animations"][0]["channels"]}
    places = {}

    def place(node, above, frame):
        local = numpy.reshape(node["transformation"], (4, 4))
        if node["name"] in channels:
            channel = channels[node["name"]]
            w, x, y, z = channel["rotationkeys"][min(frame, len(channel["rotationkeys"]) - 1)][1]
            local = numpy.eye(4)
            local[:3, :3] = [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
            local[:3, 3] = channel["positionkeys"][min(frame, len(channel["positionkeys"]) - 1)][1]
        world = above @ local
        places[f"{node['name']}@{frame}"] = world[:3, 3].tolist()
        for child in node.get("children", []):
            place(child, world, frame)

    for frame in frames:
        place(scene["rootnode"], numpy.eye(4), frame)
    return places


def motion_rows(held, exports):
    path = exports / "ply/animate/motion.bvh"
    joints = lambda key: {
        key(name, frame): 100 * place for frame in held.shown for name, place in held.joints(frame).items()
    }
    read = f"{len(held.motion['joint_names'])} joints, {held.frames()}"
    times = [held.time(frame) for frame in held.shown]
    in_time = lambda name, frame: f"{name}@{held.time(frame)}"

    def three():
        version, found = npm("three", "three.mjs", "bvh", path, *times)
        return Row(
            f"three.js {version}", read, 10 * largest(found, joints(in_time)), "mm", 0.05, "scale 0.01 for metres"
        )

    def babylon():
        version, found = npm("@babylonjs/core", "babylon.mjs", "bvh", path, *times)
        return Row(
            f"Babylon.js {version}",
            read,
            10 * largest(found, joints(in_time)),
            "mm",
            0.05,
            "`useRightHandedSystem`, or it is a mirror image beside a glTF; scale 0.01 for metres",
        )

    def assimp():
        found = assimp_joints(path, held.shown)
        return Row(
            f"assimp {debian('assimp-utils')}",
            read + ", in its JSON of six digits",
            10 * largest(found, joints(lambda name, frame: f"{name}@{frame}")),
            "mm",
            0.05,
            "scale 0.01 for metres",
        )

    def by_blender():
        version, found = blender("bvh", path, *(frame + 1 for frame in held.shown))
        assert abs(found["fps"][0] / held.fps - 1) < 1e-3, found["fps"]
        in_metres = {f"{name}@{frame + 1}": place for frame in held.shown for name, place in held.joints(frame).items()}
        off = 1000 * largest(found, in_metres)
        return Row(
            version,
            read + ", frames a second, its reader mended",
            off,
            "mm",
            0.05,
            'scale 0.01, "Update Scene FPS"; as Debian 12 packs it the import fails (invalid mode "rU"): '
            "take that of blender.org",
        )

    return [three, babylon, assimp, by_blender]


def mesh_rows(held, exports):
    name = list(held.folders)[-1]
    frame = held.shown[1]
    vertices, faces = held.vertices(name, frame), held.faces[name]
    paths = {kind: exports / f"{kind}/animate/garments/{name}/{held.ids[frame]:06d}.{kind}" for kind in ("ply", "obj")}

    def row(program, kind, found, advice="", digits=""):
        counts = {
            len(vertices): f"{len(vertices):,} vertices,",
            held.textured[name]: f"{held.textured[name]:,} vertices (apart along texture seams),",
            3 * len(faces): "three vertices for each of",
        }
        assert found[0] in counts and found[1] == len(faces), found
        off = 1000 * float(numpy.abs(numpy.subtract(found[2:], box(vertices))).max())
        read = f"{kind.upper()}: {counts[found[0]]} {len(faces):,} triangles{digits}"
        return Row(program, read, off, "mm", 0.006 if digits else 0.002, advice)

    def three(kind):
        version, found = npm("three", "three.mjs", kind, paths[kind])
        return row(f"three.js {version}", kind, found[kind], "`mergeVertices`, for shared vertices")

    def loaders_gl(kind):
        version, found = npm("@loaders.gl/" + kind, "loaders_gl.mjs", kind, paths[kind])
        return row(f"loaders.gl {version}", kind, found[kind])

    def assimp(kind):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "a.assjson"
            output("assimp", "export", paths[kind], file, "-fassjson", "-jiv")
            (mesh,) = json.loads(file.read_text())["meshes"]
        return row(
            f"assimp {debian('assimp-utils')}",
            kind,
            [len(mesh["vertices"]) // 3, len(mesh["faces"]), *box(numpy.reshape(mesh["vertices"], (-1, 3)))],
            "`JoinIdenticalVertices`",
            ", in its JSON of six digits",
        )

    def open3d(kind):
        return row(f"Open3D {debian('python3-open3d')}", kind, python("open3d", "open3d_judge.py", paths[kind])["mesh"])

    def vtk(kind):
        found = python("vtkmodules", "vtk_judge.py", kind, paths[kind])
        return row(f"VTK {found['version'][0]}", kind, found["mesh"])

    def by_blender(kind):
        version, found = blender("mesh", paths[kind])
        advice = "a turn by 90 degrees about x: its PLY import takes Z for up" if kind == "ply" else ""
        return row(version, kind, found["mesh"], advice)

    def pcl(kind):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "a.pcd"
            output("pcl_ply2pcd", "-format", "0", paths[kind], file)
            text = file.read_text().split("DATA ascii\n")[1]
        points = numpy.array([[float(word) for word in line.split()[:3]] for line in text.splitlines()])
        off = 1000 * float(numpy.abs(points - vertices).max())
        return Row(f"PCL {debian('pcl-tools')}", f"PLY: {len(points):,} points, each", off, "mm", 0.001)

    rows = [
        lambda judge=judge, kind=kind: judge(kind)
        for kind in paths
        for judge in (three, loaders_gl, assimp, open3d, vtk, by_blender)
    ]
    return [*rows, lambda: pcl("ply")]


def usd_rows(held, exports):
    path = exports / "usda/animate/avatar.usda"
    first = {name: box(held.vertices(name, 0)) for name in held.folders}

    def tinyusdz():
        version, found = npm("tinyusdz", "tinyusdz.mjs", path)
        assert {name: found[name][1] for name in first} == {
            name: len(faces) for name, faces in held.faces.items()
        }, found
        off = 1000 * max(largest({name: found[name][2:]}, {name: corners}) for name, corners in first.items())
        return Row(
            f"tinyusdz {version}", f"{len(first)} meshes, the first frame alone", off, "mm", 0.001, "glTF, to play"
        )

    def three():
        version, found = npm("three", "three.mjs", "usd", path)
        off = 1000 * largest(found, {f"{name}@rest": corners for name, corners in first.items()})
        return Row(
            f"three.js {version}",
            f"{len(first)} meshes, the first frame alone: it plays no time samples",
            off,
            "mm",
            0.001,
            "glTF, to play",
        )

    return [three, tinyusdz]


def array_rows(held, exports):
    name = list(held.folders)[-1]
    path = exports / f"h5/animate/garments/{name}.h5"
    counts = [len(held.ids), len(held.vertices(name, 0)), len(held.faces[name])]
    boxes = {f"frame:{frame}": box(held.vertices(name, frame)) for frame in held.shown}
    read = f"HDF5: {counts[0]} frames of {counts[1]:,} vertices, {counts[2]:,} triangles"

    def by_h5py():
        with h5py.File(path) as file:
            assert [*file["vertices"].shape[:2], len(file["faces"])] == counts and file["fps"][0] == held.fps
            assert isinstance(file.attrs["units"], str)
            off = max(
                float(numpy.abs(file["vertices"][frame] - held.vertices(name, frame)).max()) for frame in held.shown
            )
        return Row(f"h5py {h5py.__version__}", read + ", each vertex", 1000 * off, "mm", 0.001)

    def h5wasm():
        version, found = npm("h5wasm", "h5wasm.mjs", path, *held.shown)
        assert found["counts"] == counts and found["fps"] == [held.fps], found
        return Row(f"h5wasm {version}", read, 1000 * largest(found, boxes), "mm", 0.001)

    def h5dump():
        text = output("h5dump", "-H", "-d", "vertices", path)
        shape = [int(word) for word in re.search(r"SIMPLE \{ \( (\d+), (\d+), (\d+) \)", text).groups()]
        assert shape == [*counts[:2], 3], text
        return Row(f"h5dump {debian('hdf5-tools')}", read, 0, "", 0)

    def by_numpy():
        motion = numpy.load(exports / "ply/animate/motion.npz")
        assert list(motion["joint_names"]).index("pelvis") == 0 and list(motion["schema"]) == ["atelier-motion-1"]
        off = float(numpy.abs(motion["rotations"] - held.motion["rotations"]).max())
        return Row(
            f"NumPy {numpy.__version__}",
            f"npz: rotations of {len(motion['joint_names'])} joints in {len(held.ids)} frames, names as str",
            off,
            "rad",
            0,
        )

    return [by_h5py, h5wasm, h5dump, by_numpy]


def video_rows(held, exports):
    path = exports / "ply/animate/animation.mp4"
    pictures = sorted((exports / "ply/animate/pictures").glob("*.png"))

    def size():
        from PIL import Image

        return list(Image.open(pictures[0]).size)

    def ffprobe():
        text = output("ffprobe", "-v", "error", "-count_frames", "-of", "json", "-show_streams", path)
        (stream,) = json.loads(text)["streams"]
        over, under = map(int, stream["avg_frame_rate"].split("/"))
        assert int(stream["nb_read_frames"]) == len(held.ids), stream
        off = abs(float(stream["duration"]) - len(held.ids) / held.fps)
        return Row(
            f"ffprobe {debian('ffmpeg')}",
            f"MP4: {len(held.ids)} frames at {over / under:g} a second, duration, {stream['width']} x {stream['height']}",
            1000 * off,
            "ms",
            1,
        )

    def opencv():
        found = python("cv2", "opencv_judge.py", "video", path, *pictures)
        assert found["frames"] == [len(held.ids)], found
        return Row(
            f"OpenCV {debian('python3-opencv')}",
            f"MP4: {len(held.ids)} frames through H.264, each beside its PNG",
            found["mean"][0],
            "of 255 on average",
            3,
        )

    return [ffprobe, opencv]
