"""Captures and triangulation."""

import json
import unittest

import numpy as np

import atelier
from support import Temporary

FRAMES = [3, 4, 7]


def ring(count, radius=3.0):
    """Cameras round the origin at 1 m that look inwards."""
    cameras = []
    for at in range(count):
        angle = 2 * np.pi * at / count
        center = np.array([radius * np.sin(angle), 1.2, radius * np.cos(angle)])
        z = np.array([0, 1, 0]) - center
        z /= np.linalg.norm(z)
        x = np.cross(z, [0, 1, 0])
        x /= np.linalg.norm(x)
        R = np.stack([x, np.cross(z, x), z])
        camera = atelier.Camera()
        camera.id = f"cam{at}"
        camera.width, camera.height = 320, 240
        camera.fx = camera.fy = 250
        camera.cx, camera.cy = 160, 120
        camera.camera_from_world_rotation = R
        camera.camera_from_world_translation = -R @ center
        cameras.append(camera)
    return cameras


def points_of(frame):
    """25 points of a person who moves."""
    model = points_of.model = getattr(points_of, "model", None) or atelier.default_human({"shape_basis": False})
    joints = atelier.forward_kinematics(model.skeleton, atelier.rest_pose(model.skeleton)).positions
    names = {"nose": "head", "neck": "neck", "mid_hip": "pelvis"}
    rows = []
    for point in atelier.keypoint_schema("body_25").points:
        name = names.get(point, point)
        side = "left_" if "left" in point else "right_" if "right" in point else ""
        if name not in model.skeleton.names:
            name = (side + "foot") if side and any(part in point for part in ("toe", "heel")) else "head"
        rows.append(joints[atelier.find_joint(model.skeleton, name)])
    return np.array(rows) + [0.01 * frame, 0, 0] + 1e-3 * np.arange(25)[:, None]


def write_capture(folder, more="", held_out="held_out_cameras = []\nheld_out_frames = []\n"):
    """A native capture of grey images, with detections; `more` is added to capture.toml."""
    cameras = ring(5)
    text = {"schema": "atelier-cameras", "version": 1, "units": "m", "up_axis": "y", "pixel_origin": "corner",
            "cameras": [{"id": c.id, "width": c.width, "height": c.height, "fx": c.fx, "fy": c.fy, "cx": c.cx,
                         "cy": c.cy, "distortion_model": "none", "distortion": [0.0] * 8,
                         "camera_from_world": {"rotation": c.camera_from_world_rotation.tolist(),
                                               "translation": c.camera_from_world_translation.tolist()},
                         "gain": [1.0, 1.0, 1.0]} for c in cameras]}
    (folder / "cameras.json").write_text(json.dumps(text))
    for camera in cameras:
        for kind in ("images", "keypoints2d"):
            (folder / kind / camera.id).mkdir(parents=True)
        for frame in FRAMES:
            image = np.full((camera.height, camera.width, 3), 10 * frame, np.uint8)
            atelier.write_image(folder / "images" / camera.id / f"{frame:06}.png", image)
            pixels = atelier.project(camera, points_of(frame))
            row = np.concatenate([pixels, np.full((25, 1), 0.9)], 1).ravel().tolist()
            (folder / "keypoints2d" / camera.id / f"{frame:06}.json").write_text(
                json.dumps({"people": [{"person_id": [-1], "pose_keypoints_2d": row}]}))
    (folder / "capture.toml").write_text(
        'schema = "atelier-capture"\nversion = 1\nunits = "m"\nup_axis = "y"\nsubject = "nobody"\n'
        'synthetic = false\nimage_format = "png"\nkeypoint_schema = "body_25"\nlabel_taxonomy = "atelier"\n'
        + held_out +
        f'[[sequence]]\nname = "walk"\nkind = "clothed"\nfps = 30.0\nframe_ids = {FRAMES}\n' + more)
    return cameras


class Capture(Temporary):
    def test_capture_is_read_and_triangulated(self):
        cameras = write_capture(self.folder)
        dataset = atelier.open_dataset(self.folder)
        self.assertEqual((dataset.layout, dataset.info.subject), ("native", "nobody"))
        self.assertEqual(atelier.frame_ids(dataset).tolist(), FRAMES)
        self.assertEqual([c.id for c in dataset.cameras], [c.id for c in cameras])
        self.assertEqual(dataset.info.sequences[0].frame_ids.tolist(), FRAMES)

        reader = atelier.FrameReader(dataset)
        self.assertEqual(reader.byte_image(1, 4)[0, 0].tolist(), [40, 40, 40])
        self.assertEqual(reader.image(1, 4).dtype, np.float32)
        self.assertIsNone(reader.image(1, 5))
        self.assertIsNone(reader.mask(0, 3))
        self.assertEqual(reader.keypoints(0, 3)[0].points.shape, (25, 3))

        detections = atelier.main_person(atelier.read_detections(reader, FRAMES))
        schema = atelier.keypoint_schema(dataset.info.keypoint_schema)
        found = atelier.triangulate(dataset.cameras, detections, schema, 30, {"distances": False})
        self.assertEqual(found.points.shape, (3, 25, 3))
        expected = np.array([points_of(frame) for frame in FRAMES])
        np.testing.assert_allclose(found.points, expected, atol=1e-4)
        self.assertTrue((found.views >= 2).all())
        self.assertEqual(found.covariance.shape, (3, 25, 3, 3))
        self.assertEqual(found.camera_error.shape, (5,))

    def test_linear_points_are_those_of_exact_detections(self):
        cameras = ring(4)
        points = np.random.default_rng(3).uniform((-0.5, 0, -0.5), (0.5, 1.8, 0.5), (30, 3))
        detections = [np.column_stack([atelier.project(camera, points), np.ones(len(points))]) for camera in cameras]
        np.testing.assert_allclose(atelier.linear_points(cameras, detections), points, atol=1e-9)

    def test_info_is_what_the_capture_says_of_itself(self):
        write_capture(self.folder, '[[consent]]\nwho = "P. Doe"\nscope = "research"\nuntil = "2999-12-31"\n',
                      'held_out_cameras = ["cam1"]\nheld_out_frames = [4]\n')
        dataset = atelier.open_dataset(self.folder)
        info = dataset.info
        self.assertEqual((info.subject, info.keypoint_schema, info.label_taxonomy), ("nobody", "body_25", "atelier"))
        self.assertEqual((info.held_out_cameras, info.held_out_frames.tolist()), (["cam1"], [4]))
        self.assertEqual((info.synthetic, info.image_format), (False, "png"))
        one, = info.consent
        self.assertEqual((one.who, one.scope, one.until, one.signature), ("P. Doe", "research", "2999-12-31", ""))
        self.assertIn("P. Doe, research, until 2999-12-31", repr(info))
        self.assertEqual(dataset.world_convention.up, "y")
        self.assertEqual(dataset.corrections, {})
        for thing, name in ((info, "subject"), (dataset, "info"), (one, "until"), (info, "held_out_frames")):
            with self.assertRaises(AttributeError):
                setattr(thing, name, None)
        with self.assertRaises(ValueError):
            info.held_out_frames[0] = 3
        dataset.cameras[0].fx = 1
        self.assertEqual(dataset.cameras[0].fx, 250)
        del dataset
        self.assertEqual(info.sequences[0].name, "walk")  # what an attribute gave outlives its owner

    def test_info_of_another_layout_names_its_unit(self):
        write_capture(self.folder)
        dataset = atelier.open_dataset(self.folder, {"metres_per_unit": 1})
        self.assertEqual(dataset.world_convention.metres_per_unit, 1)

    def test_label_names_are_those_of_the_taxonomy(self):
        names = atelier.label_names()
        self.assertEqual((names[0], names[1], names[5]), ("background", "skin", "dress"))

    def test_stages_run_on_a_capture(self):
        folder = self.folder / "capture"
        folder.mkdir()
        write_capture(folder)
        told = []
        report = atelier.run_stage("validate", folder, self.folder / "work", say=told.append,
                                   progress=lambda *counts: told.append(counts))
        self.assertEqual(report.end, "done")
        self.assertTrue(told)
        self.assertTrue((report.folder / "manifest.json").exists())
        self.assertEqual(atelier.run_stage("validate", folder, self.folder / "work").end, "already_done")


class CaptureRefused(Temporary):
    def test_camera_that_is_not_there_is_refused(self):
        write_capture(self.folder)
        reader = atelier.FrameReader(atelier.open_dataset(self.folder))
        for read in (reader.image, reader.byte_image, reader.mask, reader.labels, reader.keypoints):
            for camera in (-1, 99):
                with self.assertRaises(atelier.DataError) as raised:
                    read(camera, 0)
                self.assertEqual((raised.exception.where, raised.exception.found), ("camera_idx", str(camera)))

    def test_numbers_that_do_not_agree_are_refused(self):
        cameras, schema = ring(3), atelier.keypoint_schema("body_25")
        for detections in ([[np.zeros((25, 3))] * 2], [[np.zeros((24, 3))] * 3]):
            with self.assertRaises(atelier.DataError) as raised:
                atelier.triangulate(cameras, detections, schema, 30)
            self.assertIn("detections, frame 0", raised.exception.where)
        with self.assertRaises(atelier.DataError):
            atelier.triangulate(cameras, [[np.zeros((25, 2))] * 3], schema, 30)

    def test_damaged_calibration_is_refused_with_its_place(self):
        write_capture(self.folder)
        path = self.folder / "cameras.json"
        path.write_text(path.read_text().replace('"fx": 250', '"fx": "wide"', 1))
        with self.assertRaises(atelier.DataError) as raised:
            atelier.open_dataset(self.folder)
        self.assertIn("cameras.json", raised.exception.file)
        self.assertTrue(raised.exception.where)

    def test_camera_that_is_not_there_is_refused(self):
        write_capture(self.folder)
        reader = atelier.FrameReader(atelier.open_dataset(self.folder))
        with self.assertRaises(atelier.Error):
            reader.image(99, 3)


if __name__ == "__main__":
    unittest.main()
