"""Stages and workspaces."""

import os
import signal
import subprocess
import sys
import time
import unittest

import numpy as np

import atelier
from support import Temporary, grid


class Workspace(Temporary):
    def setUp(self):
        super().setUp()
        self.meshes = self.folder / "meshes"
        self.meshes.mkdir()
        for frame in range(4):
            vertices, faces = grid(3 + frame)
            atelier.write_mesh(self.meshes / f"frame-{frame:03}.obj", atelier.Mesh(vertices, faces))
        self.work = self.folder / "work"

    def test_stage_is_run_once_and_its_result_is_read(self):
        told = []
        report = atelier.run_stage("statistics", self.meshes, self.work, progress=lambda *now: told.append(now))
        self.assertEqual((report.end, report.frames_done, report.frames_total), ("done", 4, 4))
        self.assertEqual(report.manifest.metrics["frames"], 4)
        self.assertTrue(any(unit == "frames" for _, _, unit in told))
        self.assertEqual(atelier.result_folder(self.work, "statistics"), report.folder)
        manifest = atelier.read_manifest(report.folder, "statistics")
        self.assertEqual(manifest.options["input.up"], "y")
        self.assertIn("statistics.json", [output.path for output in manifest.outputs])
        status = {one.stage: one for one in atelier.workspace_status(self.work, digests=True)}
        self.assertEqual(status["statistics"].state, "done")
        self.assertEqual(status["register"].state, "none")
        self.assertEqual(atelier.run_stage("statistics", self.meshes, self.work).end, "already_done")

    def test_options_make_another_result(self):
        first = atelier.run_stage("statistics", self.meshes, self.work)
        options = atelier.stage_options("statistics")
        options.statistics.edge_quantiles = np.array([0.25, 0.75])
        report = atelier.run_stage("statistics", self.meshes, self.work, options)
        self.assertEqual(report.end, "done")
        self.assertNotEqual(report.folder, first.folder)
        self.assertEqual(report.manifest.options["statistics.edge_quantiles"], [0.25, 0.75])

    def test_frames_are_worked_on_in_parts(self):
        self.assertEqual(atelier.run_stage("statistics", self.meshes, self.work, frames="0:2").end, "partial")
        self.assertEqual(atelier.run_stage("statistics", self.meshes, self.work).end, "done")

    def test_sequences_are_written_and_read(self):
        vertices, faces = grid(3)
        meshes = [atelier.Mesh(vertices + frame, faces) for frame in range(3)]
        sequence = atelier.sequence_of(meshes, 30, [2, 5, 9])
        atelier.write_sequence(self.folder / "sequence", sequence)
        again = atelier.open_sequence(self.folder / "sequence")
        self.assertEqual((len(again), again.fps, again.frame_ids.tolist()), (3, 30, [2, 5, 9]))
        np.testing.assert_array_equal(again[-1].vertices, vertices + 2)
        self.assertEqual(sum(1 for _ in again), 3)
        atelier.write_one_file_sequence(self.folder / "one.h5", again)
        np.testing.assert_allclose(atelier.read_mesh_sequence(self.folder / "one.h5")[1].vertices, vertices + 1)

    def test_body_and_cloth_of_one_file_are_read_apart(self):
        vertices, faces = grid(3)
        np.savez(self.folder / "both.npz", body_vertices=vertices[None] + 1, body_faces=faces, cloth_vertices=vertices[None],
                 cloth_faces=faces)
        path = self.folder / "both.npz"
        np.testing.assert_array_equal(atelier.read_mesh_sequence(path)[0].vertices, vertices)
        np.testing.assert_array_equal(atelier.read_mesh_sequence(path, "body")[0].vertices, vertices + 1)
        with self.assertRaisesRegex(atelier.DataError, "what: 'hat'; expected \"cloth\" or \"body\""):
            atelier.read_mesh_sequence(path, what="hat")

    def test_garments_are_written_and_read(self):
        garment = atelier.Garment("towel", atelier.Mesh(*grid(3)), atelier.fabric_material("silk"))
        garment.seams = [atelier.Seam("hem", [0, 1], [2, 3])]
        atelier.write_garment_archive(self.folder / "towel.h5", garment)
        again = atelier.read_garment_archive(self.folder / "towel.h5")
        self.assertEqual((again.name, again.seams[0].name, again.seams[0].b.tolist()), ("towel", "hem", [2, 3]))
        self.assertEqual(again.material.to_dict(), garment.material.to_dict())

    def test_interrupt_ends_a_stage_and_keeps_its_frames(self):
        for frame in range(4, 400):
            vertices, faces = grid(60)
            atelier.write_mesh(self.meshes / f"frame-{frame:03}.obj", atelier.Mesh(vertices, faces))
        source = (f"import atelier\ntry:\n    atelier.run_stage('statistics', {str(self.meshes)!r}, "
                  f"{str(self.work)!r}, progress=lambda done, total, unit: print(unit, flush=True))\n"
                  "except KeyboardInterrupt:\n    print('interrupted')\n")
        child = subprocess.Popen([sys.executable, "-c", source], stdout=subprocess.PIPE, text=True, env=os.environ)
        while child.stdout.readline().strip() != "frames":
            self.assertIsNone(child.poll())
        time.sleep(0.1)
        child.send_signal(signal.SIGINT)
        out, _ = child.communicate(timeout=60)
        self.assertEqual(out.split()[-1], "interrupted")
        status = {one.stage: one for one in atelier.workspace_status(self.work)}["statistics"]
        self.assertEqual(status.state, "unfinished")
        self.assertEqual(atelier.run_stage("statistics", self.meshes, self.work).frames_done, 400)


class WorkspaceRefused(Temporary):
    def test_missing_results_and_inputs_are_refused(self):
        with self.assertRaises(atelier.DataError) as raised:
            atelier.result_folder(self.folder, "register")
        self.assertEqual(raised.exception.where, "register")
        with self.assertRaises(atelier.Error):
            atelier.run_stage("statistics", self.folder / "none", self.folder / "work")

    def test_workspace_inside_its_input_or_among_other_things_is_refused(self):
        (self.folder / "a-0.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        with self.assertRaises(atelier.UsageError):
            atelier.run_stage("statistics", self.folder, self.folder / "work")
        with self.assertRaises(atelier.UsageError):
            atelier.run_stage("statistics", self.folder / "a-0.obj", self.folder)

    def test_wrong_frames_options_and_devices_are_refused(self):
        for arguments in ({"frames": "x:y"}, {"options": {"input": {"up": "w"}}}, {"device": "cuda"}):
            with self.subTest(arguments), self.assertRaises(atelier.UsageError):
                atelier.run_stage("statistics", self.folder, self.folder.parent / "w", **arguments)

    def test_what_a_callback_raises_is_raised(self):
        (self.folder / "in").mkdir()
        (self.folder / "in" / "a-0.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")

        def progress(done, total, unit):
            raise LookupError("mine")

        with self.assertRaises(LookupError):
            atelier.run_stage("statistics", self.folder / "in", self.folder / "work", progress=progress)


if __name__ == "__main__":
    unittest.main()
