"""The package as a whole: stubs, examples, a wheel."""

import ast
import inspect
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
import unittest.mock
import xml.dom.minidom
import zipfile

import atelier
from atelier import _atelier
from support import PROJECT, Temporary


# What a user writes, as mypy --strict reads it.
TYPED = """
import numpy as np
import atelier

model = atelier.default_human(atelier.female_human())
body = atelier.shape_body(model)
pose = atelier.rest_pose(model.skeleton)
pose.rotations[atelier.find_joint(model.skeleton, "left_elbow")] = [0, -1.2, 0]
vertices = atelier.skin_vertices(model, body, pose, {"correctives": False})
lowest: float = float(vertices[:, 1].min())

dataset = atelier.open_dataset("capture")
names: list[str] = [consent.who for consent in dataset.info.consent]
for sequence in dataset.info.sequences:
    detections = atelier.main_person(atelier.read_detections(atelier.FrameReader(dataset), sequence.frame_ids))
    schema = atelier.keypoint_schema(dataset.info.keypoint_schema)
    found = atelier.triangulate(dataset.cameras, detections, schema, sequence.fps)

options = atelier.SolverOptions.from_dict({"xpbd.substeps": 40})
options.friction = 0.5
garment = atelier.read_garment_archive("dress.h5")
cloth = atelier.SimulationModel(atelier.make_cloth(garment), model.mesh.faces)
solver = atelier.create_solver(cloth, options, "cpu")
control = atelier.Control(body_start=vertices, body_end=vertices)
done = atelier.simulate(solver, 10, lambda frame: control, progress=lambda done, total: print(done, total))
mesh = atelier.Mesh(done.positions[-1], np.asarray(garment.mesh.faces))
mesh.colors = np.ones((3, 3), np.float32)

stage = atelier.stage_options("simulate")
stage = atelier.SimulateStageOptions.from_dict(stage.to_dict())
try:
    atelier.run_stage("simulate", "scene", "work", stage, say=print)
except atelier.DataError as error:
    print(error.file, error.where)
"""


class Package(unittest.TestCase):
    def test_stubs_name_everything_there_is(self):
        path = pathlib.Path(atelier.__file__).with_name("__init__.pyi")
        tree = ast.parse(path.read_text())
        named = {node.name for node in tree.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
        named |= {alias.asname for node in tree.body if isinstance(node, ast.ImportFrom) for alias in node.names}
        missing = {name for name in atelier.__all__ if not inspect.ismodule(getattr(atelier, name))} - named
        self.assertEqual(missing, set())
        self.assertTrue(path.with_name("py.typed").exists())

    def test_version_is_the_projects(self):
        self.assertIn(f"project(atelier VERSION {atelier.__version__}", (PROJECT / "CMakeLists.txt").read_text())

    def test_stubs_have_names_of_python_alone(self):
        for name, value in vars(_atelier).items():
            texts = [value.__doc__ or ""] + [str(getattr(member, "__doc__", "")) for member in vars(value).values()] \
                if inspect.isclass(value) else [value.__doc__ or ""] if callable(value) else []
            for text in texts:
                with self.subTest(name):
                    self.assertNotIn("atelier::", text)

    def test_every_function_says_what_it_does(self):
        for name in dir(atelier):
            value = getattr(atelier, name)
            if inspect.isbuiltin(value):  # of C++: its first line is the signature
                with self.subTest(name):
                    self.assertGreater(len((value.__doc__ or "").partition("\n")[2].strip()), 10)

    def test_stubs_are_typed_well(self):
        try:
            import mypy.api
        except ImportError:
            self.skipTest("no mypy here")
        out, err, code = mypy.api.run([str(pathlib.Path(atelier.__file__).with_name("__init__.pyi"))])
        self.assertEqual(code, 0, out + err)

    def test_script_of_a_user_passes_the_strict_checks_of_mypy(self):
        try:
            import mypy.api
        except ImportError:
            self.skipTest("no mypy here")
        place = str(pathlib.Path(atelier.__file__).parents[1])
        with tempfile.TemporaryDirectory(prefix="atelier-python-") as folder, \
                unittest.mock.patch.dict(os.environ, MYPYPATH=place):
            script = pathlib.Path(folder) / "script.py"
            script.write_text(TYPED)
            out, err, code = mypy.api.run(["--strict", "--cache-dir", folder, str(script)])
            self.assertEqual(code, 0, out + err)
            script.write_text('import atelier\natelier.stage_options("simulate").substepz = 3\natelier.Mesh().verts\n')
            out, _, code = mypy.api.run(["--strict", "--cache-dir", folder, str(script)])
            self.assertEqual((code, out.count("error:")), (1, 2), out)

    def test_only_numpy_is_needed(self):
        # Other packages may have themselves loaded at every start (.pth files): these are not asked for.
        source = ("import sys; before = {*sys.modules}; import atelier; "
                  "print(*sorted({name.split('.')[0] for name in {*sys.modules} - before}))")
        loaded = subprocess.run([sys.executable, "-c", source], capture_output=True, text=True, check=True).stdout.split()
        others = [name for name in loaded if name not in sys.stdlib_module_names
                  and name not in ("atelier", "numpy", "mtrand", "cython_runtime")
                  and not name.startswith("_")]
        self.assertEqual(others, [])


class Examples(Temporary):
    """The scripts of examples/python, as a user starts them."""

    def test_examples_run_and_draw_their_plot(self):
        scripts = sorted(path for path in (PROJECT / "examples" / "python").glob("*.py") if path.name != "plot.py")
        self.assertEqual(len(scripts), 6)
        for script in scripts:
            with self.subTest(script.name):
                done = subprocess.run([sys.executable, script, self.folder], capture_output=True, text=True, timeout=600)
                self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
                self.assertIn("# %%", script.read_text())
                plot = self.folder / (script.stem + ".svg")
                self.assertGreater(len(xml.dom.minidom.parse(str(plot)).getElementsByTagName("polyline")), 0)


class Installed(Temporary):
    def test_installed_package_is_imported(self):
        build = os.environ.get("ATELIER_BUILD")
        if not build:
            self.skipTest("no build folder is named")
        subprocess.run(["cmake", "--install", build, "--component", "python", "--prefix", self.folder / "a"], check=True,
                       capture_output=True)
        (self.folder / "a").rename(self.folder / "b")
        site = self.folder / "b" / "lib" / "python3" / "dist-packages"
        self.assertTrue((site / "atelier" / "py.typed").exists())
        out = subprocess.run([sys.executable, "-c", "import atelier; print(len(atelier.fabric_names()))"], check=True,
                             capture_output=True, text=True, env=os.environ | {"PYTHONPATH": str(site)}).stdout
        self.assertGreater(int(out), 5)


class Wheel(Temporary):
    def test_wheel_is_built_and_imported(self):
        build = os.environ.get("ATELIER_BUILD")
        if not build:
            self.skipTest("no build folder is named")
        done = subprocess.run([sys.executable, "-m", "pip", "wheel", PROJECT / "python", "--no-build-isolation", "--no-deps",
                               "--no-index", "-w", self.folder], capture_output=True, text=True, timeout=600)
        if "No module named pip" in done.stderr:
            self.skipTest("no pip here")
        self.assertEqual(done.returncode, 0, done.stdout[-3000:] + done.stderr[-3000:])
        wheel, = self.folder.glob("*.whl")
        with zipfile.ZipFile(wheel) as archive:
            archive.extractall(self.folder / "site")
            names = archive.namelist()
        self.assertIn("atelier/__init__.pyi", names)
        self.assertIn("atelier/py.typed", names)
        source = ("import atelier, numpy; print(atelier.__file__); image = numpy.zeros((4, 4, 3), numpy.uint8);"
                  f"atelier.write_image({str(self.folder / 'a.tif')!r}, image);"  # by a library that is loaded late
                  f"print(atelier.read_byte_image({str(self.folder / 'a.tif')!r}).shape)")
        out = subprocess.run([sys.executable, "-c", source], capture_output=True, text=True,
                             env=os.environ | {"PYTHONPATH": str(self.folder / "site")})
        self.assertEqual(out.returncode, 0, out.stderr)
        self.assertIn(str(self.folder / "site"), out.stdout)


if __name__ == "__main__":
    unittest.main()
