"""What Open3D makes of a mesh: vertices, triangles and box.
    open3d_judge.py FILE [OUT]       OUT: written again, as Open3D does by default
"""
import sys

import numpy
import open3d

mesh = open3d.io.read_triangle_mesh(sys.argv[1])
vertices = numpy.asarray(mesh.vertices)
print("mesh", len(vertices), len(mesh.triangles), *map(repr, [*vertices.min(0).tolist(), *vertices.max(0).tolist()]))
if len(sys.argv) > 2:
    open3d.io.write_triangle_mesh(sys.argv[2], mesh)
