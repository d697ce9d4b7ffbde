"""NumPy in and out: what is shared, what is copied, what is refused."""

import copy
import gc
import unittest

import numpy as np

import atelier
from support import grid


class Arrays(unittest.TestCase):
    def setUp(self):
        self.vertices, self.faces = grid(4)
        self.mesh = atelier.Mesh(self.vertices, self.faces)

    def test_field_read_shares_memory_of_the_struct(self):
        a, b = self.mesh.vertices, self.mesh.vertices
        self.assertTrue(np.shares_memory(a, b))
        a[3, 1] = 7
        self.assertEqual(self.mesh.vertices[3, 1], 7)

    def test_result_owns_its_memory(self):
        normals = atelier.vertex_normals(self.vertices, self.faces)
        self.assertEqual(normals.dtype, np.float64)
        self.assertTrue(normals.flags.c_contiguous)
        np.testing.assert_allclose(normals, np.broadcast_to([0, 1, 0], normals.shape), atol=1e-12)

    def test_field_outlives_the_struct(self):
        view = atelier.Mesh(self.vertices, self.faces).vertices
        gc.collect()
        np.testing.assert_array_equal(view, self.vertices)

    def test_assignment_of_one_shape_goes_to_the_same_memory(self):
        view = self.mesh.vertices
        self.mesh.vertices = self.vertices + 1
        self.assertTrue(np.shares_memory(view, self.mesh.vertices))
        np.testing.assert_array_equal(view, self.vertices + 1)

    def test_assignment_of_another_shape_leaves_older_arrays_sound(self):
        view = self.mesh.vertices
        self.mesh.vertices = np.zeros((100000, 3))
        np.testing.assert_array_equal(view, self.vertices)
        self.assertEqual(self.mesh.vertices.shape, (100000, 3))

    def test_struct_in_a_struct_is_seen_in_place(self):
        garment = atelier.Garment("towel", self.mesh)
        garment.mesh.vertices[0, 0] = 5
        self.assertEqual(garment.mesh.vertices[0, 0], 5)
        self.assertEqual(self.mesh.vertices[0, 0], 0)  # the constructor copied it
        view = garment.mesh.vertices
        garment.mesh = atelier.Mesh(np.zeros((3, 3)), [[0, 1, 2]])
        self.assertEqual(view[0, 0], 5)
        self.assertEqual(garment.mesh.vertices.shape, (3, 3))
        garment.material.density = 0.3
        self.assertEqual(garment.material.density, 0.3)

    def test_lists_of_structs_are_copies(self):
        garment = atelier.Garment("towel", self.mesh)
        garment.seams = [atelier.Seam("hem", [0, 1], [2, 3])] * 50
        seam = garment.seams[0]
        seam.name = "other"
        self.assertEqual(garment.seams[0].name, "hem")
        garment.seams = []  # the one in hand is of nobody else's memory
        gc.collect()
        self.assertEqual((seam.name, seam.b.tolist()), ("other", [2, 3]))
        scene = atelier.Scene([atelier.RenderMesh(self.mesh)])
        held = scene.meshes[0].mesh
        scene.meshes = []
        gc.collect()
        np.testing.assert_array_equal(held.vertices, self.vertices)

    def test_copies_are_apart(self):
        for other in (copy.copy(self.mesh), copy.deepcopy(self.mesh)):
            other.vertices[0] = 9
            self.assertEqual(self.mesh.vertices[0, 0], 0)

    def test_any_layout_is_taken(self):
        expected = atelier.vertex_normals(self.vertices, self.faces)
        wide = np.zeros((len(self.vertices), 6))
        wide[:, ::2] = self.vertices
        for vertices in (np.asfortranarray(self.vertices), wide[:, ::2], self.vertices.tolist(),
                         self.vertices[::-1][::-1], self.vertices.astype(">f8")):
            np.testing.assert_array_equal(atelier.vertex_normals(vertices, self.faces), expected)
        for faces in (self.faces.astype(np.int64), self.faces.astype(np.uint8), self.faces.tolist(),
                      np.asfortranarray(self.faces)):
            np.testing.assert_array_equal(atelier.vertex_normals(self.vertices, faces), expected)
        single = atelier.vertex_normals(self.vertices.astype(np.float32), self.faces)
        np.testing.assert_allclose(single, expected, atol=1e-6)

    def test_points_of_the_same_layout_are_seen_in_place(self):
        address = atelier._atelier._address_of_points
        self.assertEqual(address(self.vertices), self.vertices.ctypes.data)
        part = self.vertices[2:5]
        self.assertEqual(address(part), part.ctypes.data)
        frozen = self.vertices.copy()
        frozen.flags.writeable = False
        self.assertEqual(address(frozen), frozen.ctypes.data)
        self.assertEqual(address(self.mesh.vertices), self.mesh.vertices.ctypes.data)

    def test_points_of_other_layouts_are_copied(self):
        address = atelier._atelier._address_of_points
        shifted = np.frombuffer(b"\0" + self.vertices.tobytes(), np.uint8)[1:].view(np.float64).reshape(-1, 3)
        self.assertFalse(shifted.flags.aligned)
        expected = atelier.vertex_normals(self.vertices, self.faces)
        for points in (np.asfortranarray(self.vertices), self.vertices[::2], self.vertices.astype(np.float32),
                       self.vertices.astype(">f8"), shifted):
            self.assertNotEqual(address(points), points.ctypes.data)
        np.testing.assert_array_equal(atelier.vertex_normals(shifted, self.faces), expected)

    def test_views_give_the_bits_of_copies(self):
        tree = atelier.build_tree(self.vertices, self.faces)
        camera = atelier.turntable_cameras(self.vertices, 1)[0]
        queries = np.random.default_rng(1).uniform(0, 1, (50, 3))
        for call in (lambda p: atelier.closest_points(tree, p).point, lambda p: atelier.project(camera, p),
                     lambda p: atelier.first_hits(tree, p, p - 2).t):
            np.testing.assert_array_equal(call(queries), call(np.asfortranarray(queries)))
        moved = np.asfortranarray(self.vertices + 1)
        np.testing.assert_array_equal(
            atelier.closest_points(atelier.refit_tree(tree, self.vertices + 1), queries).point,
            atelier.closest_points(atelier.refit_tree(tree, moved), queries).point)

    def test_nothing_is_an_array_without_rows(self):
        for nothing in (None, [], np.zeros((0, 3))):
            self.assertEqual(atelier.Mesh(nothing, nothing).vertices.shape, (0, 3))

    def test_closest_points_are_views_of_one_result(self):
        tree = atelier.build_tree(self.vertices, self.faces)
        found = atelier.closest_points(tree, self.vertices + [0, 0.5, 0])
        np.testing.assert_allclose(found.point, self.vertices, atol=1e-12)
        np.testing.assert_allclose(found.squared_distance, 0.25)
        self.assertTrue(np.shares_memory(found.point, found.point))
        self.assertFalse(found.point.flags.owndata)
        self.assertEqual(len(found), len(self.vertices))


class ArraysRefused(unittest.TestCase):
    def setUp(self):
        self.vertices, self.faces = grid(4)

    def refused(self, found, expected, call, *arguments):
        with self.assertRaises(atelier.DataError) as raised:
            call(*arguments)
        self.assertIn(found, raised.exception.found)
        self.assertIn(expected, raised.exception.expected)
        self.assertIsInstance(raised.exception, ValueError)
        return raised.exception

    def test_wrong_shapes_are_refused(self):
        for vertices, found in ((np.zeros((5, 2)), "shape (5, 2)"), (np.zeros(6), "shape (6,)"),
                                (np.zeros((2, 3, 3)), "shape (2, 3, 3)"), (3.5, "shape ()")):
            self.refused(found, "[N,3] finite numbers", atelier.vertex_normals, vertices, self.faces)
        self.refused("shape (4,)", "[3] finite numbers", lambda: atelier.Control(gravity=np.zeros(4)))

    def test_wrong_types_are_refused(self):
        for vertices, found in ((np.full((4, 3), "a"), "<U1"), (np.zeros((4, 3), complex), "complex128"),
                                (np.full((4, 3), None), "object"), ("text", "<U4"), (object(), "object")):
            self.refused(found, "[N,3] finite numbers", atelier.vertex_normals, vertices, self.faces)
        self.refused("float64", "[N,3] integers", atelier.vertex_normals, self.vertices,
                     self.faces.astype(float))

    def test_ragged_lists_are_refused(self):
        self.refused("list", "[N,3]", atelier.vertex_normals, [[0, 1, 2], [0, 1]], self.faces)

    def test_numbers_that_are_not_finite_are_refused_with_their_place(self):
        for bad, name in ((np.nan, "NaN"), (np.inf, "infinity"), (-np.inf, "infinity")):
            vertices = self.vertices.copy()
            vertices[7, 2] = bad
            error = self.refused(name, "a finite number", atelier.vertex_normals, vertices, self.faces)
            self.assertEqual(error.where, "row 7, column 2")

    def test_integers_that_do_not_fit_are_refused(self):
        faces = self.faces.astype(np.int64)
        faces[0, 1] = 2**40
        error = self.refused(str(2**40), "32 bits", atelier.vertex_normals, self.vertices, faces)
        self.assertEqual(error.where, "element 1")

    def test_assignments_are_refused_and_change_nothing(self):
        mesh = atelier.Mesh(self.vertices, self.faces)
        with self.assertRaises(atelier.DataError):
            mesh.vertices = np.zeros((4, 2))
        with self.assertRaises(atelier.DataError):
            mesh.faces = [[0.5, 1, 2]]
        np.testing.assert_array_equal(mesh.vertices, self.vertices)

    def test_faces_of_missing_vertices_are_refused(self):
        mesh = atelier.Mesh(self.vertices, [[0, 1, 999]])
        with self.assertRaises(atelier.DataError) as raised:
            atelier.check_mesh(mesh, "towel")
        self.assertEqual(raised.exception.file, "towel")
        with self.assertRaises(atelier.DataError) as raised:
            atelier.vertex_normals(self.vertices, [[0, 1, 999]])
        self.assertEqual(raised.exception.where, "faces, row 0")


if __name__ == "__main__":
    unittest.main()
