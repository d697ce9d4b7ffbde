"""Bodies, motions, skinning and its derivatives."""

import unittest

import numpy as np

import atelier
from support import Temporary


def rotation_of(vector):
    """Rodrigues' formula."""
    angle = np.linalg.norm(vector)
    if angle == 0:
        return np.eye(3)
    x, y, z = vector / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


class Body(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.model = atelier.default_human(atelier.female_human())
        cls.body = atelier.shape_body(cls.model)
        random = np.random.default_rng(3)
        cls.pose = atelier.Pose(0.3 * random.standard_normal((atelier.joint_count(cls.model), 3)), [0.1, 0.2, 0.3])

    def test_linear_skinning_is_that_of_numpy(self):
        skeleton = self.model.skeleton
        rotations, positions = [], []
        joints = self.body.joints
        for j, parent in enumerate(skeleton.parents):
            R = rotation_of(self.pose.rotations[j])
            if parent < 0:
                rotations.append(R)
                positions.append(joints[0] + self.pose.root_translation)
            else:
                rotations.append(rotations[parent] @ R)
                positions.append(positions[parent] + rotations[parent] @ (joints[j] - joints[parent]))
        R, p = np.array(rotations), np.array(positions)
        moved = np.einsum("vkij,vkj->vki", R[self.model.skin_joints],
                          self.body.vertices[:, None] - joints[self.model.skin_joints])
        moved += p[self.model.skin_joints]
        expected = (self.model.skin_weights[..., None] * moved).sum(1)
        posed = atelier.skin_vertices(self.model, self.body, self.pose, {"correctives": False})
        np.testing.assert_allclose(posed, expected, atol=1e-9)
        frames = atelier.forward_kinematics(self.body.skeleton, self.pose)
        np.testing.assert_allclose(frames.positions, p, atol=1e-12)
        np.testing.assert_allclose(frames.rotations, R, atol=1e-12)

    def test_derivatives_are_finite_differences(self):
        posed = atelier.pose_body(self.model, self.body, self.pose)
        chains = atelier.skin_chains(self.model)
        vertices = np.array([10, 4000, 9000])
        directions = np.random.default_rng(4).standard_normal((3, 3))
        rows = atelier.skin_jacobian_rows(self.model, posed, chains, vertices, directions)
        values = atelier.pose_vector(self.pose)
        step = 1e-6
        for row, (vertex, direction) in enumerate(zip(vertices, directions)):
            joints = rows.joints[rows.begin[row]:rows.begin[row + 1]]
            self.assertGreater(len(joints), 1)
            for at, joint in enumerate(joints):
                for axis in range(3):
                    sides = []
                    for sign in (1, -1):
                        moved = values.copy()
                        moved[3 + 3 * joint + axis] += sign * step
                        sides.append(atelier.skin_vertices(self.model, self.body, atelier.pose_of_vector(moved))[vertex])
                    expected = direction @ (sides[0] - sides[1]) / (2 * step)
                    self.assertAlmostEqual(rows.values[rows.begin[row] + at, axis], expected, delta=2e-6)

    def test_shape_derivatives_are_finite_differences(self):
        posed = atelier.pose_body(self.model, self.body, self.pose)
        vertices, directions = np.array([10, 4000]), np.eye(3)[:2]
        rows = atelier.skin_shape_rows(self.model, self.body, posed, vertices, directions)
        shape = atelier.neutral_shape(self.model)
        self.assertEqual(rows.shape, (2, len(shape)))
        for s in (0, len(shape) - 1):
            step = 1e-5
            sides = []
            for sign in (1, -1):
                other = shape.copy()
                other[s] += sign * step
                sides.append(atelier.skin_vertices(self.model, atelier.shape_body(self.model, other), self.pose))
            difference = (sides[0] - sides[1])[vertices] / (2 * step)
            np.testing.assert_allclose(rows[:, s], (difference * directions).sum(1), atol=1e-5)

    def test_whole_motion_is_its_frames(self):
        poses = [self.pose, atelier.rest_pose(self.model.skeleton)]
        motion = atelier.Motion(poses, 30, [4, 7])
        all_of_it = atelier.skin_motion(self.model, self.body, motion)
        for at, pose in enumerate(poses):
            np.testing.assert_array_equal(all_of_it[at], atelier.skin_vertices(self.model, self.body, pose))
        self.assertEqual(motion.rotations().shape, (2, atelier.joint_count(self.model), 3))
        self.assertEqual(len(motion), 2)
        self.assertEqual([pose.rotations.shape for pose in motion], 2 * [self.pose.rotations.shape])

    def test_shape_moves_what_it_says(self):
        self.assertEqual(len(self.model.shape_names), len(atelier.neutral_shape(self.model)))
        stature = atelier.find_shape(self.model, "stature")
        shape = atelier.neutral_shape(self.model)
        shape[stature] = 1.80
        self.assertAlmostEqual(atelier.measure_body(self.model, shape)["stature"], 1.80, delta=0.01)

    def test_percentiles_order_bodies(self):
        small, large = (atelier.percentile_human(1, [share] * 12) for share in (0.05, 0.95))
        self.assertLess(small.stature, large.stature)
        self.assertLess(small.waist_girth, large.waist_girth)
        self.assertLess(small.mass, large.mass)

    def test_dual_quaternions_differ_and_are_near(self):
        linear = atelier.skin_vertices(self.model, self.body, self.pose)
        dual = atelier.skin_vertices(self.model, self.body, self.pose, atelier.SkinOptions(method="dual_quaternion"))
        apart = np.linalg.norm(linear - dual, axis=1)
        self.assertGreater(apart.max(), 1e-4)
        self.assertLess(apart.max(), 0.1)


class BodyFiles(Temporary):
    def test_body_and_motion_are_read_as_they_were_written(self):
        model = atelier.default_human({"shape_basis": False})
        atelier.write_body(self.folder / "body.npz", model)
        again = atelier.read_body_file(self.folder / "body.npz")
        np.testing.assert_array_equal(again.mesh.vertices, model.mesh.vertices)
        np.testing.assert_array_equal(again.skin_weights, model.skin_weights)
        self.assertEqual(again.skeleton.names, model.skeleton.names)

    def test_motion_moves_another_body(self):
        (self.folder / "arm.bvh").write_text(BVH)
        clip = atelier.read_motion_file(self.folder / "arm.bvh", {"metres_per_unit": 0.01})
        self.assertEqual(len(clip.motion), 2)
        self.assertEqual(clip.motion.fps, 30)
        atelier.write_motion_file(self.folder / "again.npz", clip)
        again = atelier.read_motion_file(self.folder / "again.npz")
        np.testing.assert_allclose(again.motion.rotations(), clip.motion.rotations(), atol=1e-9)


class BodyRefused(unittest.TestCase):
    def setUp(self):
        self.model = atelier.default_human({"shape_basis": False, "correctives": False})
        self.body = atelier.shape_body(self.model)

    def test_pose_of_another_skeleton_is_refused(self):
        for call in (atelier.skin_vertices, atelier.pose_body):
            with self.subTest(call.__name__), self.assertRaises(atelier.DataError) as raised:
                call(self.model, self.body, atelier.Pose(np.zeros((3, 3))))
            error = raised.exception
            self.assertEqual((error.where, error.found, error.expected),
                             ("pose", "3 rows", "55, the joints of the skeleton"))

    def test_number_written_into_a_pose_that_is_not_finite_is_refused(self):
        pose = atelier.rest_pose(self.model.skeleton)
        pose.rotations[5, 1] = np.nan
        with self.assertRaises(atelier.DataError) as raised:
            atelier.skin_vertices(self.model, self.body, pose)
        self.assertEqual(raised.exception.where, "row 5, column 1")

    def test_pose_that_is_not_finite_is_refused(self):
        rotations = np.zeros((atelier.joint_count(self.model), 3))
        rotations[5, 1] = np.nan
        with self.assertRaises(atelier.DataError) as raised:
            atelier.Pose(rotations)
        self.assertEqual(raised.exception.where, "row 5, column 1")

    def test_arrays_of_a_model_are_copies_and_skeletons_are_checked(self):
        mesh = self.model.mesh
        mesh.vertices = np.zeros((5, 3))
        mesh.faces = [[0, 1, 90_000_000]]
        self.assertGreater(len(self.model.mesh.vertices), 5)
        self.assertIn("stature", atelier.measure_body(self.model))
        with self.assertRaises(AttributeError):
            self.model.mesh = mesh
        skeleton = self.model.skeleton
        parents = np.array(skeleton.parents)
        parents[5] = 999_999
        skeleton.parents = parents
        with self.assertRaises(atelier.DataError):
            atelier.forward_kinematics(skeleton, atelier.rest_pose(skeleton))

    def test_shape_of_another_length_is_refused(self):
        for call in (atelier.shape_body, atelier.measure_body, atelier.at_shape):
            with self.subTest(call.__name__), self.assertRaises(atelier.DataError) as raised:
                call(self.model, [1.0, 2.0])
            self.assertEqual((raised.exception.where, raised.exception.found), ("shape", "2 rows"))

    def test_body_that_nobody_has_is_refused(self):
        with self.assertRaises(atelier.Error):
            atelier.default_human({"stature": 1.7, "mass": 20})

    def test_none_and_other_types_are_refused(self):
        for arguments in ((None, self.body, atelier.rest_pose(self.model.skeleton)),
                          (self.model, self.model, atelier.rest_pose(self.model.skeleton)),
                          (self.model, self.body, "pose")):
            with self.assertRaises(TypeError):
                atelier.skin_vertices(*arguments)


BVH = """HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Spine
  {
    OFFSET 0 20 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 30 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.0333333
0 90 0 0 0 0 0 0 0
0 91 0 10 0 0 5 0 0
"""

if __name__ == "__main__":
    unittest.main()
