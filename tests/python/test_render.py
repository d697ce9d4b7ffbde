"""Images: rendered, read and written."""

import unittest

import numpy as np

import atelier
from support import Temporary, grid


class Render(Temporary):
    def test_mesh_is_where_its_camera_sees_it(self):
        vertices, faces = grid(6)
        mesh = atelier.Mesh(vertices[:, [0, 2, 1]] * [1, 1, 0], faces[:, ::-1])  # upright, facing +Z
        camera = atelier.camera_around(mesh.vertices, 0, 0, 60, 60)
        scene = atelier.Scene([atelier.RenderMesh(mesh, atelier.Look(color=[1, 0.5, 0], specular=0))],
                              environment=[1, 1, 1])
        image = atelier.render(scene, camera, {"samples": 4, "alpha": True})
        self.assertEqual((image.shape, image.dtype), ((60, 60, 4), np.float32))
        pixels = atelier.project(camera, mesh.vertices)
        low, high = pixels.min(0), pixels.max(0)
        covered = np.argwhere(image[..., 3] > 0.5)
        np.testing.assert_allclose(covered.min(0)[::-1], low, atol=1.5)
        np.testing.assert_allclose(covered.max(0)[::-1], high, atol=1.5)
        middle = image[30, 30]
        self.assertGreater(middle[0], 1.5 * middle[1])

    def test_images_are_read_as_they_were_written(self):
        random = np.random.default_rng(5)
        bytes_ = random.integers(0, 256, (7, 9, 3)).astype(np.uint8)
        atelier.write_image(self.folder / "a.png", bytes_)
        np.testing.assert_array_equal(atelier.read_byte_image(self.folder / "a.png"), bytes_)
        linear = random.random((7, 9, 3)).astype(np.float32)
        atelier.write_image(self.folder / "b.png", linear, bit_depth=16)
        np.testing.assert_allclose(atelier.read_image(self.folder / "b.png"), linear, atol=1e-3)
        atelier.write_image(self.folder / "c.png", linear[..., 0])
        self.assertEqual(atelier.read_image(self.folder / "c.png").shape, (7, 9))

    def test_camera_projects_its_own_axes(self):
        camera = atelier.Camera()
        camera.id, camera.width, camera.height = "a", 100, 80
        camera.fx = camera.fy = 50
        camera.cx, camera.cy = 50, 40
        pixels = atelier.project(camera, [[0, 0, 2], [1, 0, 2], [0, 0, -2]])
        np.testing.assert_allclose(pixels[:2], [[50, 40], [75, 40]])
        self.assertTrue(np.isnan(pixels[2]).all())
        camera.camera_from_world_translation = [0, 0, 3]
        np.testing.assert_allclose(atelier.camera_center(camera), [0, 0, -3])


class RenderRefused(Temporary):
    def test_images_of_other_shapes_and_types_are_refused(self):
        for image in (np.zeros((2, 2, 5), np.uint8), np.zeros(4), np.zeros((2, 2, 3), complex),
                      np.zeros((0, 4, 3), np.uint8), np.zeros((2, 2, 3), np.uint16), np.full((2, 2), np.nan)):
            with self.subTest(image.shape), self.assertRaises(atelier.DataError):
                atelier.write_image(self.folder / "a.png", image)

    def test_extensions_that_are_not_known_are_refused(self):
        with self.assertRaisesRegex(atelier.DataError, r"\.xyz'; expected \.png"):
            atelier.write_image(self.folder / "a.xyz", np.zeros((2, 2, 3), np.uint8))

    def test_camera_and_options_that_cannot_be_are_refused(self):
        scene = atelier.Scene([])
        with self.assertRaises(atelier.DataError):
            atelier.render(scene, atelier.Camera())
        with self.assertRaises(atelier.UsageError):
            atelier.render(scene, atelier.camera_around(np.eye(3)), {"samples": 0})
        with self.assertRaises(atelier.DataError):
            atelier.Camera().distortion_model = "pinhole"

    def test_texture_without_uvs_is_refused(self):
        look = atelier.Look(texture=np.ones((4, 4, 3)))
        scene = atelier.Scene([atelier.RenderMesh(atelier.Mesh(*grid(2)), look)])
        with self.assertRaises(atelier.DataError):
            atelier.render(scene, atelier.camera_around(np.eye(3), width=8, height=8))


if __name__ == "__main__":
    unittest.main()
