"""Rows of cameras: COLMAP, OpenCV, nerfstudio, Pose2Sim."""

import json
import pathlib
import re
import shutil
import tomllib

import numpy
from programs import ATELIER, Row, debian, output, python

LENSES = {
    "brown": ("brown", None),
    "rational": ("brown", [0.15, -0.05, 0.0008, -0.0005, 0.01, 0.25, -0.02, 0.01]),
    "fisheye": ("fisheye", [0.02, -0.003, 0.001, 0.0005, 0, 0, 0, 0]),
}


def lens_captures(capture, folder):
    """The first instant of a native capture, three times: with its own lenses, rational ones and fisheyes."""
    info = tomllib.loads((capture / "capture.toml").read_text())
    cameras = json.loads((capture / "cameras.json").read_text())
    frame = info["sequence"][0]["frame_ids"][0]
    for name, (model, numbers) in LENSES.items():
        out = folder / name
        out.mkdir(parents=True)
        for camera in cameras["cameras"]:
            camera["gain"] = [1, 1, 1]
            camera["distortion_model"] = model
            camera["distortion"] = numbers or camera["distortion"]
            (out / "images" / camera["id"]).mkdir(parents=True)
            for image in (capture / "images" / camera["id"]).glob(f"{frame:06d}.*"):
                shutil.copy(image, out / "images" / camera["id"])
        (out / "cameras.json").write_text(json.dumps(cameras))
        (out / "capture.toml").write_text(
            'schema = "atelier-capture"\nversion = 1\nunits = "m"\nup_axis = "y"\nsubject = "s"\nsynthetic = false\n'
            f'image_format = "{info["image_format"]}"\nkeypoint_schema = "body_25"\nlabel_taxonomy = "atelier"\n'
            "held_out_cameras = []\nheld_out_frames = []\n"
            f'[[sequence]]\nname = "s"\nkind = "clothed"\nfps = 30.0\nframe_ids = [{frame}]\n'
        )


def pixels_of(camera, points):
    """Atelier's own projection (docs/reference/conventions.md): pixels, the first one's centre at 0.5."""
    rigid = camera["camera_from_world"]
    p = points @ numpy.array(rigid["rotation"]).T + rigid["translation"]
    x, y = p[:, 0] / p[:, 2], p[:, 1] / p[:, 2]
    d, r2 = camera["distortion"], None
    if camera["distortion_model"] == "fisheye":
        r = numpy.hypot(x, y)
        t = numpy.arctan(r)
        scale = t * (1 + t**2 * (d[0] + t**2 * (d[1] + t**2 * (d[2] + t**2 * d[3])))) / r
        x, y = x * scale, y * scale
    elif camera["distortion_model"] == "brown":
        r2 = x * x + y * y
        radial = (1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]))) / (1 + r2 * (d[5] + r2 * (d[6] + r2 * d[7])))
        x, y = (
            x * radial + 2 * d[2] * x * y + d[3] * (r2 + 2 * x * x),
            y * radial + d[2] * (r2 + 2 * y * y) + 2 * d[3] * x * y,
        )
    return numpy.stack([camera["fx"] * x + camera["cx"], camera["fy"] * y + camera["cy"]], axis=1)


def z_up(points):
    return points[:, [0, 2, 1]] * [1, -1, 1]


class Rig:
    """Cameras of a lens, points that they see, and an export of them."""

    def __init__(self, folder, lens):
        self.lens, self.capture, self.folder = lens, folder / lens, folder
        self.cameras = json.loads((self.capture / "cameras.json").read_text())["cameras"]
        self.points = numpy.random.default_rng(1).uniform([-0.8, 0, -0.8], [0.8, 1.9, 0.8], (200, 3))
        self.pixels = {camera["id"]: pixels_of(camera, self.points) for camera in self.cameras}

    def exported(self, layout):
        """The folder of the layout, and what was said of lenses."""
        out = self.folder / f"{self.lens}-{layout}"
        text = "" if out.exists() else output(ATELIER, "convert-capture", self.capture, out, "--to", layout)
        (folder,) = [one for one in out.iterdir() if one.is_dir()]
        return folder, text


def colmap_error(rig, folder):
    """Mean error in COLMAP of points that we project, px: a bundle adjustment that may turn nothing tells its cost."""
    model, sparse = folder / "points", folder / "sparse/0"
    for place in (model, folder / "adjusted"):
        place.mkdir()
    shutil.copy(sparse / "cameras.txt", model)
    images, tracks = [], {}
    rows = [line for line in (sparse / "images.txt").read_text().splitlines() if not line.startswith("#")]
    for row in rows[::2]:
        words = row.split()
        camera = next(one for one in rig.cameras if one["id"] == words[9].split("/")[0])
        seen = []
        for number, (x, y) in enumerate(rig.pixels[camera["id"]].tolist()):
            if 0 < x < camera["width"] and 0 < y < camera["height"]:
                tracks.setdefault(number, []).append(f"{words[0]} {len(seen)}")
                seen.append(f"{x!r} {y!r} {number + 1}")
        images.append(row + "\n" + " ".join(seen) + "\n")
    (model / "images.txt").write_text("".join(images))
    (model / "points3D.txt").write_text(
        "".join(
            f"{n + 1} {' '.join(map(repr, rig.points[n].tolist()))} 255 255 255 0 {' '.join(t)}\n"
            for n, t in tracks.items()
        )
    )
    text = output(
        "colmap",
        "bundle_adjuster",
        "--input_path",
        model,
        "--output_path",
        folder / "adjusted",
        "--BundleAdjustment.refine_focal_length",
        0,
        "--BundleAdjustment.refine_extra_params",
        0,
        "--BundleAdjustment.max_num_iterations",
        0,
    )
    residuals = int(re.search(r"Residuals : (\d+)", text)[1])
    return float(re.search(r"Initial cost : (\S+)", text)[1]), residuals


def nerfstudio_pixels(file, points):
    """Pixels by the rules of nerfstudio's parser (1.1): the lens model from the top alone, numbers of frames before
    those of the top, k1 to k4 as a polynomial or an equidistant fisheye, cameras that look along -z."""
    root = json.loads(file.read_text())
    fisheye = root.get("camera_model") == "OPENCV_FISHEYE"
    found = {}
    for frame in root["frames"]:
        get = lambda key: float(frame.get(key, root.get(key, 0)))
        to_world = numpy.array(frame["transform_matrix"])
        p = (points - to_world[:3, 3]) @ to_world[:3, :3] * [1, -1, -1]
        x, y = p[:, 0] / p[:, 2], p[:, 1] / p[:, 2]
        k = [get(f"k{i}") for i in (1, 2, 3, 4)]
        if fisheye:
            r = numpy.hypot(x, y)
            t = numpy.arctan(r)
            scale = t * (1 + t**2 * (k[0] + t**2 * (k[1] + t**2 * (k[2] + t**2 * k[3])))) / r
            x, y = x * scale, y * scale
        else:
            r2, p1, p2 = x * x + y * y, get("p1"), get("p2")
            radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * (k[2] + r2 * k[3])))
            x, y = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + 2 * p2 * x * y + p1 * (
                r2 + 2 * y * y
            )
        found[pathlib.PurePath(frame["file_path"]).stem.split("_")[0]] = numpy.stack(
            [get("fl_x") * x + get("cx"), get("fl_y") * y + get("cy")], axis=1
        )
    return found


def said_pixels(text):
    """The largest number of pixels that an export says it is off."""
    return max((float(word) for word in re.findall(r"([\d.e+-]+) px", text)), default=0.0)


def camera_rows(held, exports, folder):
    rigs = {lens: Rig(folder, lens) for lens in LENSES}

    def inside(rig, camera, pixels):
        """Largest distance from our pixels among points that the image has."""
        ours = rig.pixels[camera["id"]]
        seen = ((ours > 0) & (ours < [camera["width"], camera["height"]])).all(axis=1)
        return float(numpy.linalg.norm(pixels - ours, axis=1)[seen].max())

    def colmap(lens):
        folder, _ = rigs[lens].exported("colmap")
        off, residuals = colmap_error(rigs[lens], folder)
        return Row(
            f"COLMAP {debian('colmap')}",
            f"{lens} lenses: {len(rigs[lens].cameras)} cameras, {residuals // 2:,} projections by its bundle adjuster, on average",
            off,
            "px",
            1e-3,
            "a coefficient of 1e-6 where all are zero, or it does not undistort" if lens == "fisheye" else "",
        )

    def opencv(lens):
        rig = rigs[lens]
        folder, text = rig.exported("easymocap")
        points = folder / "points.npy"
        numpy.save(points, z_up(rig.points))
        found = folder / "pixels.npz"
        python("cv2", "opencv_judge.py", "yaml", folder / "intri.yml", folder / "extri.yml", points, found)
        pixels = numpy.load(found)
        off = max(inside(rig, camera, pixels[camera["id"]] + 0.5) for camera in rig.cameras)
        said = said_pixels(text)
        reason = f"five numbers hold no fisheye; the export says up to {said:.3g} px" if lens == "fisheye" else ""
        assert lens != "fisheye" or 0 < off <= said, (off, text)
        return Row(
            f"OpenCV {debian('python3-opencv')}",
            f"{lens} lenses, `intri.yml` and `extri.yml` of EasyMocap",
            off,
            "px",
            1e-3 if lens == "brown" else 0.01,
            "layouts with fisheyes: native, COLMAP, nerfstudio, Caliscope" if lens == "fisheye" else "",
            reason,
        )

    def nerfstudio(lens):
        rig = rigs[lens]
        folder, _ = rig.exported("nerfstudio")
        found = nerfstudio_pixels(folder / "transforms.json", z_up(rig.points))
        off = max(inside(rig, camera, found[camera["id"]]) for camera in rig.cameras)
        return Row("nerfstudio 1.1, its parser's rules", f"{lens} lenses, transforms.json", off, "px", 0.01)

    def pose2sim(lens):
        rig = rigs[lens]
        folder, _ = rig.exported("pose2sim")
        tables = tomllib.loads((folder / "calibration/Calib.toml").read_text())
        points = folder / "points.npy"
        numpy.save(points, z_up(rig.points))
        found = folder / "pixels.npz"
        cameras = folder / "cameras.json"
        cameras.write_text(json.dumps({key: table for key, table in tables.items() if key != "metadata"}))
        python("cv2", "opencv_judge.py", "tables", cameras, points, found)
        pixels = numpy.load(found)
        off = max(inside(rig, camera, pixels[camera["id"]] + 0.5) for camera in rig.cameras)
        return Row(
            "Pose2Sim 0.10, its TOML's rules", f"{lens} lenses, Calib.toml, projected by OpenCV", off, "px", 1e-3
        )

    rows = [lambda lens=lens, judge=judge: judge(lens) for judge in (colmap, opencv, nerfstudio) for lens in LENSES]
    return [*rows, lambda: pose2sim("brown")]
