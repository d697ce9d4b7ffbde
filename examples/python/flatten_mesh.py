"""A surface becomes a sewing pattern: how its strain falls with every cut.

    python3 flatten_mesh.py [OUT] [MESH]
"""

# %% A surface: the file that was given, or a cap
import pathlib
import sys

import numpy as np

import atelier
from plot import out_folder, plot

out = out_folder()
if len(sys.argv) > 2:
    mesh = atelier.read_mesh(pathlib.Path(sys.argv[2]))
else:
    RINGS, AROUND = 9, 32
    turn, tilt = np.meshgrid(2 * np.pi * np.arange(AROUND) / AROUND, np.linspace(0.1, 1, RINGS) * np.pi / 2)
    ring = 0.09 * np.stack([np.sin(tilt) * np.sin(turn), np.cos(tilt), np.sin(tilt) * np.cos(turn)], -1)
    vertices = np.concatenate([[[0, 0.09, 0]], ring.reshape(-1, 3)])
    faces = [[0, 1 + i, 1 + (i + 1) % AROUND] for i in range(AROUND)]
    for r in range(RINGS - 1):
        for i in range(AROUND):
            a, b = 1 + r * AROUND + i, 1 + r * AROUND + (i + 1) % AROUND
            faces += [[a, a + AROUND, b], [b, a + AROUND, b + AROUND]]
    mesh = atelier.Mesh(vertices, faces)
atelier.check_flattenable(mesh)

# %% Seams and darts, a few at a time
cuts, strains = list(range(0, 7)), []
for count in cuts:
    seams = atelier.find_seams(mesh, options={"cuts": count, "stretch": 0.01, "front_and_back": False})
    pattern = atelier.flatten_surface(mesh, seams.cut)
    measures = atelier.measure_flat(mesh, pattern)
    strains.append(100 * measures.strain_p99)
    print(f"{seams.added} cuts, {len(pattern.panel_names)} panels: strain of 99 % of the area below {strains[-1]:.2f} %")
plot(out / "flatten_mesh.svg", {"strain": (cuts, strains)}, "A cap laid flat", "cuts at most",
     "strain of 99 % of the area (%)")

# %% The pattern at true scale
layout = atelier.lay_out_pattern(pattern, {"seam_allowance": 0.01, "fabric_width": 1.4})
(out / "pattern.svg").write_text(atelier.pattern_svg(layout, "cap"))
print(f"{layout.length:.2f} m of fabric of {layout.width:.2f} m")
