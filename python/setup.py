"""A wheel of the package: pip wheel python/ --no-build-isolation --no-deps

CMake builds the module, in build/wheel or in the build folder that ATELIER_BUILD names, from the project's folder on.
"""

import os
import pathlib
import re
import subprocess
import sys

from setuptools import Distribution, setup
from setuptools.command.build_ext import build_ext

PROJECT = pathlib.Path(__file__).resolve().parent.parent
# pip starts this in python/, wherever it was started itself.
BUILD = (PROJECT / os.environ.get("ATELIER_BUILD", "build/wheel")).resolve()


def version() -> str:
    return re.search(r"project\(atelier VERSION ([0-9.]+)", (PROJECT / "CMakeLists.txt").read_text())[1]


class BuildByCmake(build_ext):
    """What `cmake --install --component wheel` takes."""

    def run(self) -> None:
        if not (BUILD / "CMakeCache.txt").exists():
            subprocess.run(["cmake", "-S", PROJECT, "-B", BUILD, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
                            "-DATELIER_TESTS=OFF", "-DATELIER_BENCH=OFF", f"-DPython_EXECUTABLE={sys.executable}"],
                           check=True)
        subprocess.run(["cmake", "--build", BUILD, "--target", "python"], check=True)
        subprocess.run(["cmake", "--install", BUILD, "--component", "wheel", "--prefix",
                        pathlib.Path(self.build_lib).resolve(), "--strip"], check=True)


class BinaryDistribution(Distribution):
    def has_ext_modules(self) -> bool:
        return True


scratch = BUILD / "setuptools"  # nothing is left among the sources
scratch.mkdir(parents=True, exist_ok=True)
setup(version=version(), packages=[], cmdclass={"build_ext": BuildByCmake}, distclass=BinaryDistribution,
      options={"build": {"build_base": str(scratch)}, "egg_info": {"egg_base": str(scratch)}})
