"""Simulation of cloth, and what long calls owe to Python: its lock, its signals, its callbacks."""

import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
import unittest

import numpy as np

import atelier
from support import grid


def solver_of(quads=12, substeps=10, device="cpu", **options):
    garment = atelier.Garment("towel", atelier.Mesh(*grid(quads, 0.6)), atelier.fabric_material("cotton"))
    cloth = atelier.make_cloth(garment, [0, quads])
    return atelier.create_solver(atelier.SimulationModel(cloth), {"xpbd": {"substeps": substeps}, **options}, device)


class ClothOfCpu(unittest.TestCase):
    device = "cpu"

    def setUp(self):
        if self.device == "cuda" and not atelier.cuda_available():
            self.skipTest("no CUDA device here")

    def test_thousand_frames_come_to_rest_below_the_pins(self):
        solver = solver_of(device=self.device, velocity_damping=1.0)
        done = atelier.simulate(solver, 1000, every=100)
        self.assertEqual(done.positions.shape, (10, 169, 3))
        self.assertEqual(len(done.reports), 1000)
        self.assertEqual(done.reports[-1].frame, 1000)
        last = done.positions[-1]
        np.testing.assert_allclose(last[[0, 12]], atelier.Mesh(*grid(12, 0.6)).vertices[[0, 12]], atol=1e-6)
        self.assertLess(last[:, 1].min(), 0.6)
        self.assertLess(np.abs(last - done.positions[-2]).max(), 0.02)
        self.assertEqual(solver.device, self.device)

    def test_step_by_step_is_the_same(self):
        a, b = solver_of(device=self.device), solver_of(device=self.device)
        many = atelier.simulate(a, 5)
        for at in range(5):
            b.step(atelier.Control())
            np.testing.assert_array_equal(many.positions[at], b.state.positions)

    def test_state_is_a_checkpoint(self):
        a, b = solver_of(device=self.device), solver_of(device=self.device)
        atelier.simulate(a, 3)
        b.state = a.state
        np.testing.assert_array_equal(atelier.simulate(a, 4).positions, atelier.simulate(b, 4).positions)
        self.assertEqual(b.state.frame, 7)


class ClothOfCuda(ClothOfCpu):
    device = "cuda"


class Cloth(unittest.TestCase):
    def test_control_by_function_moves_pins_and_body(self):
        solver = solver_of()
        start = solver.state.positions

        def control(frame):
            targets = start + [0, 0.01 * (frame + 1), 0]
            return atelier.Control(pin_targets=targets)

        done = atelier.simulate(solver, 10, control)
        np.testing.assert_allclose(done.positions[-1, 0], start[0] + [0, 0.1, 0], atol=1e-6)

    def test_body_holds_the_cloth(self):
        vertices, faces = grid(10, 0.4)
        garment = atelier.Garment("towel", atelier.Mesh(vertices, faces), atelier.fabric_material("cotton"))
        ground, ground_faces = grid(4, 4)
        ground = ground + [-1.8, -0.5, -1.8]
        model = atelier.SimulationModel(atelier.make_cloth(garment), ground_faces)
        solver = atelier.create_solver(model)
        done = atelier.simulate(solver, 60, atelier.Control(body_start=ground, body_end=ground))
        self.assertGreater(done.positions[-1, :, 1].min(), 0.49)
        self.assertGreater(done.reports[-1].body_contacts, 0)

    def test_progress_is_told_of_every_frame(self):
        told = []
        atelier.simulate(solver_of(4), 7, progress=lambda done, total: told.append((done, total)))
        self.assertEqual(told, [(at, 7) for at in range(1, 8)])

    def test_material_has_repr_and_dict(self):
        fabric = atelier.fabric_material("denim")
        self.assertEqual(atelier.Material(name="denim", **fabric.to_dict()).to_dict(), fabric.to_dict())
        self.assertIn("density=", repr(fabric))
        self.assertIn("denim", atelier.fabric_names())


class ClothRefused(unittest.TestCase):
    def test_sizes_that_do_not_agree_are_refused(self):
        garment = atelier.Garment("towel", atelier.Mesh(*grid(4)), atelier.fabric_material("cotton"))
        model = atelier.SimulationModel(atelier.make_cloth(garment), [[0, 1, 2]])
        solver = atelier.create_solver(model)
        for control in (atelier.Control(pin_targets=np.zeros((3, 3))),
                        atelier.Control(body_start=np.zeros((3, 3)), body_end=np.zeros((2, 3))),
                        atelier.Control(body_start=np.zeros((2, 3)), body_end=np.zeros((2, 3)))):
            with self.assertRaises(atelier.LogicError):
                solver.step(control)
        with self.assertRaises(atelier.LogicError):
            solver.state = atelier.ClothState(np.zeros((2, 3)), np.zeros((2, 3)))

    def test_counts_out_of_range_are_refused(self):
        for frames, every, name in ((-1, 1, "frames"), (3, 0, "every")):
            with self.assertRaises(atelier.DataError) as raised:
                atelier.simulate(solver_of(), frames, every=every)
            self.assertEqual(raised.exception.where, name)

    def test_pins_and_fabrics_that_are_not_there_are_refused(self):
        garment = atelier.Garment("towel", atelier.Mesh(*grid(4)))
        with self.assertRaises(atelier.DataError) as raised:
            atelier.make_cloth(garment, [2, 999])
        self.assertEqual((raised.exception.where, raised.exception.found), ("pins, row 1", "999"))
        with self.assertRaises(atelier.DataError):
            atelier.fabric_material("tinfoil")
        with self.assertRaises(atelier.UsageError):
            atelier.Material(densitty=3)

    def test_control_of_another_type_is_refused(self):
        for control in (3, lambda frame: 3):
            with self.assertRaises(atelier.DataError) as raised:
                atelier.simulate(solver_of(4), 2, control)
            self.assertEqual(raised.exception.where, "control")

    def test_what_a_callback_raises_ends_the_simulation(self):
        class Mine(Exception):
            pass

        def progress(done, total):
            if done == 3:
                raise Mine

        solver = solver_of(4)
        with self.assertRaises(Mine):
            atelier.simulate(solver, 100, progress=progress)
        self.assertEqual(solver.state.frame, 3)
        self.assertEqual(len(atelier.simulate(solver, 2).reports), 2)  # it goes on


class LongCalls(unittest.TestCase):
    def counted_while(self, call):
        """How often another thread of Python came round meanwhile."""
        count, done = [0], threading.Event()

        def work():
            while not done.is_set():
                count[0] += 1
                time.sleep(0.001)

        thread = threading.Thread(target=work)
        thread.start()
        time.sleep(0.01)
        before = count[0]
        call()
        after = count[0]
        done.set()
        thread.join()
        return after - before

    def test_other_threads_run_during_long_calls(self):
        solver = solver_of(30, 40)
        self.assertGreater(self.counted_while(lambda: atelier.simulate(solver, 30)), 5)
        mesh = atelier.RenderMesh(atelier.Mesh(*grid(40)))
        self.assertGreater(self.counted_while(lambda: atelier.picture_of([mesh], options={"samples": 16})), 5)

    def interrupted(self, work):
        """Starts `work` in a process of its own, sends SIGINT, and returns how it ended."""
        source = textwrap.dedent("""
            import sys, threading
            sys.path.insert(0, {here!r})
            import numpy as np
            import atelier
            from test_cloth import grid, solver_of
            try:
                {prepare}
                print("ready", flush=True)
                while True:
                    {work}
            except KeyboardInterrupt:
                print("interrupted", flush=True)
                {after}
        """)
        prepare, work, after = work
        child = subprocess.Popen(
            [sys.executable, "-c", source.format(here=os.path.dirname(__file__), prepare=prepare, work=work, after=after)],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.assertEqual(child.stdout.readline().strip(), "ready", child.stderr)
        time.sleep(0.5)
        child.send_signal(signal.SIGINT)
        try:
            out, err = child.communicate(timeout=60)
        except subprocess.TimeoutExpired:
            child.kill()
            child.communicate()
            self.fail("it went on after SIGINT")
        self.assertEqual(child.returncode, 0, err)
        return out.split()

    def test_interrupt_ends_a_simulation_at_a_whole_frame(self):
        out = self.interrupted(("solver = solver_of(20)", "atelier.simulate(solver, 100000, every=100000)",
                                "print(solver.state.frame > 0, len(atelier.simulate(solver, 2).reports))"))
        self.assertEqual(out, ["interrupted", "True", "2"])

    def test_interrupt_ends_a_loop_without_callbacks(self):
        out = self.interrupted(("scene = atelier.studio_scene([atelier.RenderMesh(atelier.Mesh(*grid(60)))])\n    "
                                "camera = atelier.camera_around(grid(60)[0], width=4000, height=4000)",
                                "atelier.render(scene, camera, {'samples': 1024})", "pass"))
        self.assertEqual(out, ["interrupted"])


if __name__ == "__main__":
    unittest.main()
