"""A body in motion: skinning, and a derivative of it.

    python3 skin_body.py [OUT]
"""

# %% A woman of 1.72 m
import numpy as np

import atelier
from plot import out_folder, plot

out = out_folder()
options = atelier.female_human()
options.stature = 1.72  # metres
model = atelier.default_human(options)
body = atelier.shape_body(model)  # the shape is evaluated once, any number of poses follow
print(model, {name: round(value, 3) for name, value in atelier.measure_body(model).items()})

# %% She lifts her left arm: a rotation vector for each joint, relative to its parent
shoulder = atelier.find_joint(model.skeleton, "left_shoulder")
angles = np.linspace(-0.8, 1.2, 41)  # radians; she looks along +Z
poses = []
for angle in angles:
    rotations = np.zeros((atelier.joint_count(model), 3))
    rotations[shoulder, 2] = angle
    poses.append(atelier.Pose(rotations))
motion = atelier.Motion(poses, fps=30, frame_ids=np.arange(len(poses)))
vertices = atelier.skin_motion(model, body, motion)  # [N,V,3] metres
print("vertices", vertices.shape, vertices.dtype)

# %% How high the hand is, and how fast it rises by the derivative
hand = int(np.argmax(body.vertices[:, 0]))
height = vertices[:, hand, 1]
chains = atelier.skin_chains(model)
slope = []
for pose in poses:
    posed = atelier.pose_body(model, body, pose)
    rows = atelier.skin_jacobian_rows(model, posed, chains, [hand], [[0, 1, 0]])
    slope.append(rows.values[rows.joints == shoulder][0, 2])
np.testing.assert_allclose(np.gradient(height, angles)[1:-1], slope[1:-1], atol=2e-3)
plot(out / "skin_body.svg", {"height (m)": (angles, height), "slope (m/rad)": (angles, slope)},
     "A fingertip while the arm is lifted", "angle of the shoulder (rad)", "m, m/rad")

# %% The last pose as a file that every program opens
mesh = atelier.Mesh(vertices[-1], model.mesh.faces, model.mesh.uvs, model.mesh.uv_faces)
atelier.write_mesh(out / "skin_body.glb", mesh)
