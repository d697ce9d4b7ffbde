"""Atelier: from multi-view captures of clothed people to avatars with simulated clothing.

Names, shapes and units are those of the C++ libraries: metres, seconds, kilograms, radians, Y up; rows of
arrays are vertices, faces, joints, frames. Options are dataclasses (`help(atelier.SolverOptions)`); a dict
with the same names, or None for the defaults, does as well.
"""

import os as _os
import shutil as _shutil

try:
    import numpy as _numpy  # noqa: F401
except ImportError as _error:
    raise ImportError("atelier needs NumPy, which this Python has not: apt install python3-numpy, or pip install numpy") from _error

from . import _atelier
from ._atelier import *  # noqa: F403
from ._atelier import __version__
from .errors import (DataError, EnvironmentError, Error, LogicError, NotConverged, UnknownOption, UnknownValue,
                     UsageError)
from .options import Options, all_classes as _all_classes

globals().update(_all_classes())

_networks = _shutil.which("atelier-appearance")
if _networks:
    _atelier.set_program_folder(_os.path.dirname(_os.path.realpath(_networks)))


def stage_options(stage: str) -> Options:
    """The default options of a stage, by its name ("simulate")."""
    if stage not in stage_names():  # noqa: F405
        raise UsageError(f"there is no stage '{stage}'; there are {', '.join(stage_names())}")  # noqa: F405
    words = stage.replace("-", "_").split("_")
    return globals()["".join(word.capitalize() for word in words) + "StageOptions"]()


__all__ = [name for name in globals() if not name.startswith("_")]
