"""Options as dataclasses, made from describe()."""

import dataclasses
import unittest

import atelier


class OptionsOfStructs(unittest.TestCase):
    def test_options_are_dataclasses_with_the_defaults_of_cpp(self):
        options = atelier.TriangulationOptions()
        self.assertTrue(dataclasses.is_dataclass(options))
        self.assertEqual((options.sigma, options.min_views, options.swaps), (3, 2, True))
        field = {field.name: field for field in dataclasses.fields(options)}["sigma"]
        self.assertEqual(field.metadata["unit"], "px")
        self.assertTrue(field.metadata["help"])

    def test_repr_shows_every_value(self):
        text = repr(atelier.TriangulationOptions(sigma=2))
        self.assertTrue(text.startswith("TriangulationOptions("))
        self.assertIn("sigma=2", text)
        self.assertIn("bridge=0.25", text)

    def test_dict_and_back_is_equal(self):
        for name in atelier.__all__:
            kind = getattr(atelier, name)
            if dataclasses.is_dataclass(kind) and kind._class:
                with self.subTest(name):
                    self.assertEqual(kind.from_dict(kind().to_dict()), kind())

    def test_nested_options_are_dataclasses_and_dicts(self):
        options = atelier.SolverOptions()
        options.xpbd.substeps = 40
        self.assertEqual(options.to_dict()["xpbd"]["substeps"], 40)
        again = atelier.SolverOptions.from_dict({"xpbd.substeps": 40})
        self.assertEqual(again, options)
        self.assertEqual(atelier.SolverOptions.from_dict({"xpbd": {"substeps": 40}}), options)

    def test_every_stage_has_options(self):
        for stage in atelier.stage_names():
            with self.subTest(stage):
                options = atelier.stage_options(stage)
                self.assertTrue(dataclasses.is_dataclass(options))
                options.check()

    def test_options_are_apart(self):
        a, b = atelier.SolverOptions(), atelier.SolverOptions()
        a.xpbd.substeps = 3
        self.assertNotEqual(a, b)


class OptionsRefused(unittest.TestCase):
    def test_unknown_names_are_refused(self):
        with self.assertRaises(TypeError):
            atelier.TriangulationOptions(sigmaa=2)
        with self.assertRaises(AttributeError):
            atelier.TriangulationOptions().sigmaa = 2
        with self.assertRaises(atelier.UsageError):
            atelier.TriangulationOptions.from_dict({"sigmaa": 2})

    def test_unknown_names_are_answered_with_the_near_one(self):
        for make in (lambda: atelier.SolverOptions(frction=5), lambda: atelier.SolverOptions.from_dict({"frction": 5})):
            with self.assertRaises(atelier.UnknownOption) as raised:
                make()
            self.assertEqual(str(raised.exception), "there is no option 'frction'; did you mean 'friction'?")
            self.assertIsInstance(raised.exception, atelier.UsageError)
        with self.assertRaisesRegex(atelier.UsageError, "there are .*friction"):
            atelier.SolverOptions(zzz=1)

    def test_values_out_of_range_are_refused_with_the_range(self):
        for value in (-1, 1e9, float("nan"), "three", None.__class__):
            with self.subTest(value), self.assertRaises(atelier.UsageError) as raised:
                atelier.TriangulationOptions(sigma=value).check()
            self.assertIn("sigma", str(raised.exception))
        with self.assertRaises(atelier.UsageError) as raised:
            atelier.SolverOptions(solver="xpbdd").check()
        self.assertIn("xpbd", str(raised.exception))

    def test_every_wrong_value_has_its_line(self):
        with self.assertRaises(atelier.UsageError) as raised:
            atelier.TriangulationOptions(sigma=-1, min_views=0).check()
        self.assertEqual(len(str(raised.exception).splitlines()), 2)

    def test_functions_refuse_wrong_options(self):
        body = atelier.default_human(atelier.DefaultHumanOptions(shape_basis=False, correctives=False))
        with self.assertRaises(atelier.UsageError):
            atelier.skin_vertices(body, atelier.shape_body(body), atelier.rest_pose(body.skeleton),
                                  {"method": "cubic"})
        with self.assertRaises(atelier.UsageError):
            atelier.default_human(3)
        with self.assertRaises(atelier.UsageError):
            atelier.default_human({"statur": 1.7})

    def test_stage_of_another_name_is_refused(self):
        with self.assertRaises(atelier.UsageError):
            atelier.stage_options("simulat")


if __name__ == "__main__":
    unittest.main()
