"""A stage of the pipeline on data of one's own, and what its workspace says.

    python3 run_stage.py [OUT] [MESHES]

The other stages run the same way: atelier.stage_names() lists them.
"""

# %% Meshes, one file a frame: the folder that was given, or a balloon that is blown up
import pathlib
import sys

import numpy as np

import atelier
from plot import out_folder, plot

out = out_folder()
if len(sys.argv) > 2:
    meshes = pathlib.Path(sys.argv[2])
else:
    meshes = out / "balloon"
    meshes.mkdir(exist_ok=True)
    ball = atelier.default_human({"shape_basis": False}).mesh
    center = ball.vertices.mean(axis=0)
    for frame in range(12):
        size = 1 + 0.05 * frame
        atelier.write_mesh(meshes / f"frame-{frame:03}.ply", atelier.Mesh(center + size * (ball.vertices - center), ball.faces))

# %% Nothing is computed twice: a second run finds the result
options = atelier.stage_options("statistics")
print(options)
report = atelier.run_stage("statistics", meshes, out / "workspace", options, say=print,
                           progress=lambda done, total, unit: print(f"{done} of {total} {unit}"))
print(report.end, report.folder)
print(report.manifest.metrics)

# %% What is in the workspace
for status in atelier.workspace_status(out / "workspace"):
    if status.state != "none":
        print(status.stage, status.state, f"{status.manifest.work_seconds:.2f} s")

# %% The area of every frame, from the result's files
import json

folder = atelier.result_folder(out / "workspace", "statistics")
frames = sorted((folder / "frames").glob("*.json"))
areas = [json.loads(path.read_text())["area"] for path in frames]
plot(out / "run_stage.svg", {"area": ([int(path.stem) for path in frames], areas)}, "Area of a growing body", "frame",
     "m2")
assert np.all(np.diff(areas) > 0) or len(sys.argv) > 2
