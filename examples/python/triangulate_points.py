"""Keypoints of several cameras become points in space: how the error falls with the number of views.

    python3 triangulate_points.py [OUT]

With a capture of your own:

    reader = atelier.FrameReader(atelier.open_dataset("CAPTURE"))
    frames = atelier.frame_ids(reader.dataset)
    detections = atelier.main_person(atelier.read_detections(reader, frames))
"""

# %% Cameras round a person
import numpy as np

import atelier
from plot import out_folder, plot

out = out_folder()
random = np.random.default_rng(1)
model = atelier.default_human({"shape_basis": False})
joints = atelier.forward_kinematics(model.skeleton, atelier.rest_pose(model.skeleton)).positions
cameras = atelier.turntable_cameras(joints, 12, width=1000, height=1000)
schema = atelier.keypoint_schema("coco_17")
points = joints[random.integers(0, len(joints), len(schema.points))]

# %% Detections with an error of two pixels
FRAMES = 20
NOISE = 2.0
truth = points + np.linspace(0, 0.2, FRAMES)[:, None, None] * [1, 0, 0]


def detections_of(views):
    return [[np.column_stack([atelier.project(camera, frame) + NOISE * random.standard_normal((len(frame), 2)),
                              np.full(len(frame), 0.9)]) for camera in cameras[:: 12 // views]] for frame in truth]


# %% Root mean square error over views
counts = [2, 3, 4, 6, 12]
errors, expected = [], []
for views in counts:
    found = atelier.triangulate(cameras[:: 12 // views], detections_of(views), schema, fps=30,
                                options={"distances": False, "swaps": False, "sigma": NOISE})
    seen = found.confidence > 0
    off = np.linalg.norm(found.points - truth, axis=-1)[seen]
    errors.append(1000 * np.sqrt(np.mean(off**2)) if seen.any() else np.nan)
    expected.append(1000 * np.sqrt(np.mean(np.trace(found.covariance[seen], axis1=1, axis2=2))) if seen.any() else np.nan)
    print(f"{views} views: {errors[-1]:.2f} mm, by its covariance {expected[-1]:.2f} mm, {seen.mean():.0%} found")
plot(out / "triangulate_points.svg", {"measured": (counts, errors), "by the covariance": (counts, expected)},
     "Error of points in space, detections with 2 px", "views", "root mean square error (mm)")
