"""A square of cloth, held by two corners, swings: two fabrics side by side.

    python3 simulate_cloth.py [OUT]
"""

# %% A square of 60 cm
import numpy as np

import atelier
from plot import out_folder, plot

out = out_folder()
QUADS = 20
z, x = np.mgrid[0:QUADS + 1, 0:QUADS + 1] * (0.6 / QUADS)
vertices = np.stack([x, np.ones_like(x), z], -1).reshape(-1, 3)
a = (np.arange(QUADS)[:, None] * (QUADS + 1) + np.arange(QUADS)).ravel()
faces = np.concatenate([np.stack([a, a + QUADS + 1, a + 1], 1),
                        np.stack([a + 1, a + QUADS + 1, a + QUADS + 2], 1)])
towel = atelier.Garment("towel", atelier.Mesh(vertices, faces))

# %% A thousand frames of 1/60 s would do as well; Ctrl-C ends them, and other threads run meanwhile
FRAMES = 120
device = "cuda" if atelier.cuda_available() else "cpu"
curves = {}
for fabric in ("silk", "denim"):
    towel.material = atelier.fabric_material(fabric)
    model = atelier.SimulationModel(atelier.make_cloth(towel, pins=[0, QUADS]))
    solver = atelier.create_solver(model, {"xpbd": {"substeps": 30}}, device)
    done = atelier.simulate(solver, FRAMES, progress=lambda now, total: None)
    curves[fabric] = np.arange(1, FRAMES + 1) / 60, done.positions[:, :, 1].min(axis=1)
    print(f"{fabric} on {device}: strain of 95 % of the edges below {100 * done.reports[-1].strain_p95:.2f} %")
plot(out / "simulate_cloth.svg", curves, "A cloth held by two corners", "time (s)", "lowest point (m)")

# %% The last frame, rendered
image = atelier.picture_of([atelier.RenderMesh(atelier.Mesh(done.positions[-1], faces))],
                           options={"width": 240, "height": 320, "samples": 4})
atelier.write_image(out / "simulate_cloth.png", image)
