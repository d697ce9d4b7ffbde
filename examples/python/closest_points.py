"""How far one surface is from another: a scan's error over its vertices.

    python3 closest_points.py [OUT]
"""

# %% A body, and a scan of it that is off by a few millimetres
import numpy as np

import atelier
from plot import out_folder, plot

out = out_folder()
random = np.random.default_rng(2)
model = atelier.default_human({"shape_basis": False})
mesh = model.mesh
normals = atelier.vertex_normals(mesh.vertices, mesh.faces)
NOISE = 0.003  # metres
scan = mesh.vertices + normals * NOISE * random.standard_normal((len(normals), 1))

# %% Nearest points: no loop in Python, and the answers are views of one result
tree = atelier.build_tree(mesh.vertices, mesh.faces)
found = atelier.closest_points(tree, scan)
distance = np.sqrt(found.squared_distance)
print(f"{len(scan)} points, mean {1000 * distance.mean():.2f} mm, 95 % below {1000 * np.quantile(distance, 0.95):.2f} mm")

# %% The share of points within a distance
grid = np.linspace(0, 0.01, 101)
share = np.searchsorted(np.sort(distance), grid) / len(distance)
plot(out / "closest_points.svg", {"share": (1000 * grid, 100 * share)}, "Distance of a scan from its body",
     "distance (mm)", "points within it (%)")

# %% The error as colour
hot = np.clip(distance / 0.008, 0, 1)[:, None]
colors = (1 - hot) * [0.8, 0.8, 0.8] + hot * [0.8, 0.1, 0.05]
image = atelier.picture_of([atelier.RenderMesh(atelier.Mesh(scan, mesh.faces, colors=colors), atelier.Look([1, 1, 1]))],
                           options={"width": 240, "height": 320, "samples": 4})
atelier.write_image(out / "closest_points.png", image)
