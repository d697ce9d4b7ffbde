"""Seams, flat panels and patterns."""

import unittest

import numpy as np

import atelier
from support import grid


def half_cylinder(n=24, radius=0.1, height=0.3):
    vertices, faces = grid(n)
    angle = np.pi * vertices[:, 0]
    bent = np.stack([radius * np.cos(angle), height * vertices[:, 2], radius * np.sin(angle)], -1)
    return atelier.Mesh(bent, faces)


class Pattern(unittest.TestCase):
    def test_what_can_be_unrolled_is_without_strain(self):
        mesh = half_cylinder()
        edges = atelier.edges_of(mesh.faces, len(mesh.vertices))
        pattern = atelier.flatten_surface(mesh, np.zeros(len(edges), np.int8))
        measures = atelier.measure_flat(mesh, pattern)
        self.assertLess(measures.strain_max, 0.01)
        self.assertEqual(measures.inverted, 0)
        self.assertEqual(len(pattern.panel_names), 1)
        self.assertAlmostEqual(measures.area_ratio, 1, delta=0.01)
        extent = np.ptp(pattern.vertices, axis=0)
        np.testing.assert_allclose(sorted(extent), sorted([0.1 * np.pi, 0.3]), rtol=0.02)

    def test_seams_are_found_and_laid_out(self):
        mesh = half_cylinder()
        lines = []
        seams = atelier.find_seams(mesh, options={"cuts": 2}, say=lines.append)
        pattern = atelier.flatten_surface(mesh, seams.cut, {"equal_seams": True})
        layout = atelier.lay_out_pattern(pattern, atelier.PatternPieceOptions(seam_allowance=0.015))
        self.assertIn("<svg", atelier.pattern_svg(layout, "half"))
        self.assertIn("SECTION", atelier.pattern_dxf(layout, "half"))
        self.assertEqual(len(layout.pieces), len(pattern.panel_names))
        garment = atelier.garment_of(mesh, pattern)
        self.assertEqual(garment.rest_faces.shape, mesh.faces.shape)
        cloth = atelier.make_cloth(garment, options={"membrane": "strain"})
        self.assertEqual(cloth.rest_positions.shape, mesh.vertices.shape)

    def test_given_seams_cut_panels(self):
        mesh = half_cylinder(8)
        edges = atelier.edges_of(mesh.faces, len(mesh.vertices))
        middle = np.isclose(mesh.vertices[edges][:, :, 0], 0, atol=1e-9).all(1)
        pattern = atelier.flatten_surface(mesh, middle.astype(np.int8))
        self.assertEqual(pattern.cut.panel_count, 2)
        self.assertEqual(len(pattern.seams), 1)


class PatternRefused(unittest.TestCase):
    def test_another_number_of_flags_is_refused(self):
        for call in (atelier.flatten_surface, atelier.find_seams):
            with self.subTest(call.__name__), self.assertRaises(atelier.DataError) as raised:
                call(half_cylinder(), [1, 0])
            self.assertEqual(raised.exception.found, "2 rows")

    def test_surface_that_branches_is_refused(self):
        mesh = atelier.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0]],
                            [[0, 1, 2], [0, 1, 3], [0, 1, 4]])
        with self.assertRaises(atelier.DataError) as raised:
            atelier.check_flattenable(mesh, "fan.obj")
        self.assertEqual(raised.exception.file, "fan.obj")

    def test_what_say_raises_ends_the_search(self):
        def say(line):
            raise RuntimeError("enough")

        with self.assertRaises((RuntimeError, AssertionError)):
            vertices, faces = grid(16)
            bump = np.exp(-20 * ((vertices[:, 0] - 0.5) ** 2 + (vertices[:, 2] - 0.5) ** 2))
            atelier.find_seams(atelier.Mesh(vertices + np.outer(bump, [0, 0.4, 0]), faces), say=say)


if __name__ == "__main__":
    unittest.main()
