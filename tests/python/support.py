"""What several tests need."""

import os
import pathlib
import tempfile
import unittest

import numpy as np

PROJECT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = os.environ.get("ATELIER_PROGRAM", "")  # the command-line program, where the build has it


def grid(quads: int, side: float = 1.0):
    """Vertices [V,3] and faces [F,3] of a square in the plane y = 1."""
    n = quads + 1
    z, x = np.mgrid[0:n, 0:n]
    vertices = np.stack([side * x / quads, np.ones_like(x, float), side * z / quads], -1).reshape(-1, 3)
    a = (np.arange(quads)[:, None] * n + np.arange(quads)[None, :]).ravel()
    faces = np.concatenate([np.stack([a, a + n, a + 1], -1), np.stack([a + 1, a + n, a + n + 1], -1)])
    return vertices, faces.astype(np.int32)


class Temporary(unittest.TestCase):
    """Tests that have a folder of their own, `self.folder`."""

    def setUp(self):
        self.held = tempfile.TemporaryDirectory(prefix="atelier-python-")
        self.folder = pathlib.Path(self.held.name)

    def tearDown(self):
        self.held.cleanup()
