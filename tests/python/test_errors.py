"""Errors of C++ as exceptions with their fields."""

import pickle
import unittest

import numpy as np

import atelier
from support import Temporary


class ErrorsRefused(Temporary):
    def test_missing_file_says_which(self):
        missing = self.folder / "none.obj"
        with self.assertRaises(atelier.Error) as raised:
            atelier.read_mesh(missing)
        self.assertIn(str(missing), str(raised.exception))

    def test_damaged_file_says_where_what_and_what_was_expected(self):
        path = self.folder / "bad.obj"
        path.write_text("v 0 0 0\nv 1 0 zero\n")
        with self.assertRaises(atelier.DataError) as raised:
            atelier.read_mesh(path)
        error = raised.exception
        self.assertEqual(error.file, str(path))
        self.assertIn("2", error.where)
        self.assertTrue(error.found)
        self.assertTrue(error.expected)
        self.assertIn(error.found, str(error))

    def test_images_of_an_unknown_ending_are_refused_with_those_there_are(self):
        for image in (np.zeros((2, 2, 3)), np.zeros((2, 2, 3), np.uint8)):
            with self.assertRaises(atelier.DataError) as raised:
                atelier.write_image(self.folder / "a.xyz", image)
            self.assertIn("'.xyz'; expected .png, .jpg", str(raised.exception))
            self.assertIsInstance(raised.exception, ValueError)

    def test_missing_folders_are_refused(self):
        for read in (atelier.open_dataset, atelier.open_sequence, atelier.read_cameras,
                     atelier.read_garment_archive, atelier.read_motion_file, atelier.read_body_file,
                     atelier.workspace_status, atelier.read_image, atelier.read_tracked_motion):
            with self.subTest(read.__name__), self.assertRaises(atelier.Error):
                read(self.folder / "nothing.here")

    def test_wrong_kind_of_file_is_refused(self):
        path = self.folder / "text.h5"
        path.write_text("no archive")
        for read in (atelier.read_mesh_archive, atelier.read_garment_archive, atelier.read_tracked_motion):
            with self.subTest(read.__name__), self.assertRaises(atelier.DataError) as raised:
                read(path)
            self.assertEqual(raised.exception.file, str(path))

    def test_paths_of_another_type_are_refused(self):
        with self.assertRaises(TypeError):
            atelier.read_mesh(12)

    def test_unknown_names_are_refused_with_what_there_is(self):
        with self.assertRaises(atelier.DataError) as raised:
            atelier.keypoint_schema("body_26")
        self.assertIn("body_25", str(raised.exception))
        with self.assertRaises(atelier.UsageError) as raised:
            atelier.run_stage("simulat", self.folder, self.folder / "w")
        self.assertIn("simulate", str(raised.exception))

    def test_names_that_are_not_there_are_refused_with_what_there_is(self):
        model = atelier.default_human({"shape_basis": False})
        with self.assertRaises(atelier.DataError) as raised:
            atelier.find_joint(model.skeleton, "left_elbo")
        self.assertIn("left_elbow", raised.exception.expected)
        with self.assertRaises(atelier.DataError) as raised:
            atelier.fabric_material("x")
        self.assertIn("cotton", raised.exception.expected)
        with self.assertRaises(atelier.DataError) as raised:
            atelier.write_mesh(self.folder / "m.xyz", atelier.Mesh())
        self.assertIn(".ply", raised.exception.expected)

    def test_faces_of_vertices_that_are_not_there_are_refused_with_their_row(self):
        vertices, faces = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 1, 3]]
        for call in (atelier.vertex_normals, atelier.build_tree):
            with self.subTest(call.__name__), self.assertRaises(atelier.DataError) as raised:
                call(vertices, faces)
            self.assertEqual(raised.exception.where, "faces, row 1")
            self.assertEqual(raised.exception.found, "3")
        with self.assertRaises(atelier.DataError) as raised:
            atelier.write_mesh(self.folder / "m.ply", atelier.Mesh(vertices, faces))
        self.assertEqual(raised.exception.where, "faces, row 1")

    def test_numbers_out_of_range_are_refused_with_their_argument(self):
        vertices, faces = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]
        tree = atelier.build_tree(vertices, faces)
        for call, where in ((lambda: atelier.build_tree(vertices, faces, leaf_size=0), "leaf_size"),
                            (lambda: atelier.closest_points(tree, vertices, max_distance=-1), "max_distance"),
                            (lambda: atelier.first_hits(tree, [[0, 0, 1]], [[0, 0, 0]]), "directions, row 0"),
                            (lambda: atelier.linear_points([atelier.Camera()], []), "detections")):
            with self.subTest(where), self.assertRaises(atelier.DataError) as raised:
                call()
            self.assertEqual(raised.exception.where, where)

    def test_logic_errors_are_words_without_the_place_in_the_source(self):
        tree = atelier.build_tree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        with self.assertRaises(atelier.LogicError) as raised:
            atelier.refit_tree(tree, [[0, 0, 0]])
        self.assertNotIn(".cpp", str(raised.exception))
        self.assertTrue(str(raised.exception))

    def test_options_of_the_wrong_shape_are_refused(self):
        for wrong in ({"friction": {"a": 1}}, {"friction.a": 1}, {"xpbd.substeps.x": 1}, {"xpbd": 3}):
            with self.subTest(str(wrong)), self.assertRaises(atelier.UsageError):
                atelier.SolverOptions.from_dict(wrong)

    def test_device_of_another_name_is_refused(self):
        tree = atelier.build_tree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        with self.assertRaises(atelier.DataError) as raised:
            atelier.closest_points(tree, [[0, 0, 0]], device="gpu")
        self.assertEqual(raised.exception.where, "device")

    def test_absent_device_is_refused(self):
        if atelier.cuda_available():
            self.skipTest("a CUDA device is here")
        tree = atelier.build_tree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        with self.assertRaises(atelier.EnvironmentError) as raised:
            atelier.closest_points(tree, [[0, 0, 0]], device="cuda")
        self.assertTrue(raised.exception.place)
        self.assertTrue(raised.exception.reason)
        self.assertIsInstance(raised.exception, OSError)


class Errors(unittest.TestCase):
    def test_pickled_errors_keep_their_fields(self):
        error = pickle.loads(pickle.dumps(atelier.DataError("a.obj", "line 2", "x", "a number")))
        self.assertEqual((error.file, error.where, error.found, error.expected),
                         ("a.obj", "line 2", "x", "a number"))
        self.assertEqual(str(error), "a.obj: line 2: x; expected a number")
        error = pickle.loads(pickle.dumps(atelier.EnvironmentError("/disk", "full")))
        self.assertEqual((error.place, error.reason), ("/disk", "full"))


if __name__ == "__main__":
    unittest.main()
