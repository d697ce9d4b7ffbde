"""What VTK makes of a file: lines of a word and numbers.
    vtk_judge.py gltf FILE RATE [FRAME...]   box of each mesh, in the order of the file, at frames of RATE a second
    vtk_judge.py ply|obj FILE                vertices, triangles, box
"""
import sys

import vtkmodules.vtkIOGeometry
import vtkmodules.vtkIOPLY
from vtkmodules.vtkCommonCore import vtkVersion

kind, path, *frames = sys.argv[1:]


def say(word, *numbers):
    print(word, *(repr(float(number)) for number in numbers))


def box(data):
    bounds = data.GetBounds()
    return *bounds[::2], *bounds[1::2]


say("version", ".".join(vtkVersion.GetVTKVersion().split(".")[:2]))
if kind == "gltf":
    rate = float(frames.pop(0))
    reader = vtkmodules.vtkIOGeometry.vtkGLTFReader()
    reader.SetFileName(path)
    reader.ApplyDeformationsToGeometryOn()
    reader.SetFrameRate(int(rate))
    reader.UpdateInformation()
    for animation in range(reader.GetNumberOfAnimations()):
        reader.EnableAnimation(animation)
    for frame in frames:
        reader.UpdateTimeStep(int(frame) / rate)
        leaves = reader.GetOutput().NewIterator()
        number = 0
        while not leaves.IsDoneWithTraversal():
            data = leaves.GetCurrentDataObject()
            if data.GetNumberOfPoints():
                say(f"{number}@{frame}", *box(data))
                number += 1
            leaves.GoToNextItem()
else:
    module = vtkmodules.vtkIOPLY if kind == "ply" else vtkmodules.vtkIOGeometry
    reader = getattr(module, f"vtk{kind.upper()}Reader")()
    reader.SetFileName(path)
    reader.Update()
    data = reader.GetOutput()
    say("mesh", data.GetNumberOfPoints(), data.GetNumberOfPolys(), *box(data))
