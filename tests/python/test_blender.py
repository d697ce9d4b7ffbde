"""The add-on blender/atelier_sequences.py: its readers here, the rest in Blender where that is installed."""

import hashlib
import importlib.util
import json
import shutil
import subprocess
import unittest

import numpy as np

import atelier
from support import PROJECT, Temporary, grid

ADDON = PROJECT / "blender" / "atelier_sequences.py"
JOB = PROJECT / "tests" / "python" / "blender_import.py"


def addon():
    spec = importlib.util.spec_from_file_location("atelier_sequences", ADDON)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def moving(frames=3, colors=False):
    """A square with texture coordinates that moves along x."""
    vertices, faces = grid(2)
    vertices = np.stack([vertices[:, 0] - 0.5, 0.5 - vertices[:, 2], np.zeros(len(vertices))], 1)
    uvs = vertices[:, :2] + 0.5
    shade = np.linspace(0, 1, len(vertices))[:, None] * [1, 0.5, 0.25] if colors else None
    return [atelier.Mesh(vertices + [0.25 * frame, 0, 0], faces, uvs, faces, shade) for frame in range(frames)]


class BlenderReaders(Temporary):
    """Without Blender: archives are read as Atelier wrote them."""

    def test_archives_are_read_without_hdf5(self):
        meshes = moving()
        atelier.write_sequence(self.folder / "s", atelier.sequence_of(meshes, 24, [3, 5, 6]))
        sequence = addon().Sequence(self.folder / "s")
        self.assertEqual((sequence.fps, sequence.frame_ids), (24, [3, 5, 6]))
        arrays = sequence.arrays_of(5)
        np.testing.assert_array_equal(arrays["vertices"], meshes[1].vertices)
        np.testing.assert_array_equal(arrays["faces"], meshes[1].faces)
        self.assertEqual([sequence.nearest(frame) for frame in (0, 3, 4, 5, 99)], [3, 3, 3, 5, 6])

    def test_one_file_and_large_arrays_are_read(self):
        vertices, faces = grid(250)  # of several chunks
        atelier.write_mesh_archive(self.folder / "large.h5", atelier.Mesh(vertices, faces))
        arrays = addon().read_archive(self.folder / "large.h5")[2]
        np.testing.assert_array_equal(arrays["vertices"], vertices)
        atelier.write_one_file_sequence(self.folder / "T.h5", atelier.sequence_of(moving(), 30))
        np.testing.assert_allclose(addon().Sequence(self.folder / "T.h5").arrays_of(2)["vertices"], moving()[2].vertices)

    def test_ply_and_obj_are_read(self):
        for colors in (False, True):
            mesh = moving(colors=colors)[0]
            for extension in ("ply", "obj"):
                with self.subTest(extension, colors=colors):
                    path = self.folder / f"f-000001.{extension}"
                    atelier.write_mesh(path, mesh)
                    arrays = addon().Sequence(self.folder).arrays_of(1)
                    np.testing.assert_allclose(arrays["vertices"], mesh.vertices, atol=1e-6)
                    np.testing.assert_array_equal(arrays["faces"], mesh.faces)
                    np.testing.assert_allclose(arrays["uvs"][arrays["uv_faces"]], mesh.uvs[mesh.uv_faces], atol=1e-6)
                    if colors:
                        np.testing.assert_allclose(arrays["colors"], mesh.colors, atol=0.01)
                    path.unlink()


    def test_body_and_cloth_of_one_file_are_read_apart(self):
        module = addon()
        mesh, frames = moving()[0], np.stack([mesh.vertices for mesh in moving()])
        np.savez(self.folder / "both.npz", body_vertices=frames + 1, body_faces=mesh.faces, fps=25.0, frame_ids=[2, 4, 6],
                 cloth_vertices=frames, cloth_faces=mesh.faces, cloth_uv=mesh.uvs)
        self.assertEqual(module.parts_of(self.folder / "both.npz"), ["body", "cloth"])
        body, cloth = (module.Sequence(self.folder / "both.npz", part) for part in ("body", "cloth"))
        self.assertEqual((body.fps, cloth.frame_ids), (25, [2, 4, 6]))
        np.testing.assert_array_equal(body.arrays_of(4)["vertices"], frames[1] + 1)
        np.testing.assert_array_equal(cloth.arrays_of(4)["vertices"], frames[1])
        np.testing.assert_array_equal(cloth.arrays_of(4)["uv_faces"], mesh.faces)
        self.assertNotIn("uvs", body.arrays_of(4))
        np.savez(self.folder / "one.npz", vertices=frames, faces=mesh.faces)
        self.assertEqual(module.parts_of(self.folder / "one.npz"), [""])
        self.assertEqual(module.Sequence(self.folder / "one.npz").frame_ids, [0, 1, 2])


    def test_texture_is_found_beside_a_sequence_and_in_a_workspace(self):
        find = addon().texture_beside
        work = self.folder / "work"
        for name in ("avatar/current/surface", "animate/current/seen", "animate/current/body"):
            (work / name).mkdir(parents=True)
            self.assertIsNone(find(work / name))
        texture = work / "avatar" / "current" / "texture.png"
        texture.write_bytes(b"")
        self.assertEqual(find(work / "avatar" / "current" / "surface"), texture)
        self.assertEqual(find(work / "animate" / "current" / "seen"), texture)
        self.assertIsNone(find(work / "animate" / "current" / "body"))
        (work / "animate" / "current" / "body.png").write_bytes(b"")
        self.assertEqual(find(work / "animate" / "current" / "body").name, "body.png")


class BlenderReadersRefused(Temporary):
    def test_files_of_numpy_that_are_no_meshes_are_refused(self):
        module = addon()
        np.savez(self.folder / "pose.npz", poses=np.zeros((3, 4)))
        np.savez(self.folder / "flat.npz", vertices=np.zeros((4, 3)), faces=np.zeros((2, 3), int))
        np.savez(self.folder / "pickle.npz", vertices=np.array([{}], object), faces=np.zeros((2, 3), int))
        (self.folder / "text.npz").write_text("no zip")
        for name, words in (("pose", "no vertices"), ("flat", "vertices of shape"), ("pickle", "damaged"), ("text", "damaged")):
            path = self.folder / f"{name}.npz"
            with self.subTest(name), self.assertRaisesRegex(module.SequenceError, f"{name}.npz: {words}"):
                [module.Sequence(path, part) for part in module.parts_of(path)]

    def test_folder_of_several_sequences_is_answered_with_theirs(self):
        module = addon()
        for name in ("body", "garments/dress"):
            atelier.write_sequence(self.folder / name, atelier.sequence_of(moving(), 30))
        with self.assertRaisesRegex(module.SequenceError, "import those of a folder in it: body, garments/dress$"):
            module.Sequence(self.folder)
        work = self.folder / "work"
        for name in ("body/0123456789abcdef", "body/current"):
            atelier.write_sequence(work / name, atelier.sequence_of(moving(), 30))
        with self.assertRaisesRegex(module.SequenceError, "import those of a folder in it: body/current$"):
            module.Sequence(work)

    def test_damaged_and_other_files_are_refused(self):
        module = addon()
        atelier.write_mesh_archive(self.folder / "a.h5", moving()[0])
        data = bytearray((self.folder / "a.h5").read_bytes())
        data[-1] ^= 1
        (self.folder / "b.h5").write_bytes(data)
        (self.folder / "c.h5").write_bytes(b"\x89HDF\r\n")
        (self.folder / "empty").mkdir()
        (self.folder / "d.ply").write_bytes(b"plyx")
        for path in ("b.h5", "c.h5", "empty"):
            with self.subTest(path), self.assertRaises(module.SequenceError):
                module.Sequence(self.folder / path)
        with self.assertRaises(module.SequenceError):
            module.read_ply(self.folder / "d.ply")

    def test_what_is_missing_is_said_in_a_sentence(self):
        module = addon()
        with self.assertRaisesRegex(module.SequenceError, "gone.h5: nothing is there"):
            module.Sequence(self.folder / "gone.h5")
        atelier.write_mesh(self.folder / "dress.ply", moving()[0])
        with self.assertRaisesRegex(module.SequenceError, "dress.ply: no number of a frame"):
            module.Sequence(self.folder)

    def test_words_in_place_of_numbers_are_named_with_their_file(self):
        module = addon()
        (self.folder / "word.obj").write_text("v a b c\n")
        with self.assertRaisesRegex(module.SequenceError, "word.obj: damaged: .*'a'"):
            module.Sequence(self.folder / "word.obj").arrays_of(0)
        body = b"schema atelier.mesh_sequence 1\nnumber frames many\nend\n"
        (self.folder / "T.h5").write_bytes(b"ATELIER-ARCHIVE 1 " + hashlib.sha256(body).hexdigest().encode() + b"\n" + body)
        with self.assertRaisesRegex(module.SequenceError, "T.h5: damaged: .*many"):
            module.Sequence(self.folder / "T.h5")

    def test_faces_of_vertices_that_are_not_there_are_refused(self):
        module = addon()
        for name, face in (("far", "1 2 99"), ("zero", "0 1 2"), ("back", "-9 -2 -1")):
            folder = self.folder / name
            folder.mkdir()
            (folder / "f-000001.obj").write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\nf {face}\n")
            with self.subTest(name), self.assertRaisesRegex(module.SequenceError, "of 3 vertices"):
                module.Sequence(folder).arrays_of(1)

    def test_truncated_files_are_refused_in_a_sentence(self):
        module = addon()
        mesh = moving()[0]
        atelier.write_mesh(self.folder / "f-000001.ply", mesh)
        data = (self.folder / "f-000001.ply").read_bytes()
        (self.folder / "f-000001.ply").write_bytes(data[:-20])
        with self.assertRaisesRegex(module.SequenceError, "damaged"):
            module.Sequence(self.folder).arrays_of(1)

    def test_frames_of_several_meshes_in_one_folder_are_refused(self):
        module = addon()
        for name in ("body-0001.obj", "dress-0001.obj"):
            (self.folder / name).write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        with self.assertRaisesRegex(module.SequenceError, "body-, dress-"):
            module.Sequence(self.folder)


class BlenderReadersAccept(Temporary):
    def test_one_mesh_without_a_number_is_a_frame(self):
        for ending in ("ply", "obj"):
            path = self.folder / f"dress.{ending}"
            atelier.write_mesh(path, moving()[0])
            sequence = addon().Sequence(path)
            self.assertEqual(sequence.frame_ids, [0])
            np.testing.assert_allclose(sequence.arrays_of(0)["vertices"], moving()[0].vertices, atol=1e-6)

    def test_indices_back_from_the_last_and_headers_of_windows(self):
        module = addon()
        (self.folder / "f-000001.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n")
        np.testing.assert_array_equal(module.Sequence(self.folder).arrays_of(1)["faces"], [[0, 1, 2]])
        (self.folder / "f-000001.obj").unlink()
        mesh = moving()[0]
        atelier.write_mesh(self.folder / "f-000001.ply", mesh)
        data = (self.folder / "f-000001.ply").read_bytes()
        end = data.index(b"end_header\n") + len(b"end_header\n")
        (self.folder / "f-000001.ply").write_bytes(data[:end].replace(b"\n", b"\r\n") + data[end:])
        np.testing.assert_array_equal(module.Sequence(self.folder).arrays_of(1)["faces"], mesh.faces)


class Blender(Temporary):
    def run_job(self, job):
        if not shutil.which("blender"):
            self.skipTest("no program blender (scripts/setup --judges)")
        (self.folder / "job.json").write_text(json.dumps(job))
        done = subprocess.run(["blender", "--background", "--factory-startup", "--python-exit-code", "3", "--python", JOB,
                               "--", ADDON, self.folder / "job.json", self.folder / "out.json"],
                              capture_output=True, text=True, timeout=600)
        self.assertEqual(done.returncode, 0, done.stdout[-3000:] + done.stderr[-3000:])
        return json.loads((self.folder / "out.json").read_text())

    def test_sequences_keep_uvs_colours_and_materials(self):
        meshes = moving()
        atelier.write_sequence(self.folder / "body", atelier.sequence_of(meshes, 12.5, [3, 5, 6]))
        scans = self.folder / "scans"
        scans.mkdir()
        coloured = moving(2, colors=True)
        coloured.append(atelier.Mesh(coloured[1].vertices[:5], coloured[1].faces[:2], colors=coloured[1].colors[:5]))
        for frame, mesh in enumerate(coloured):
            atelier.write_mesh_archive(scans / f"{frame:06}.h5", mesh)
        (self.folder / "none").mkdir()
        frames = np.stack([mesh.vertices for mesh in meshes])
        np.savez(self.folder / "both.npz", body_vertices=frames[:, :5] + 1, body_faces=meshes[0].faces[:1],
                 cloth_vertices=frames, cloth_faces=meshes[0].faces, cloth_uv=meshes[0].uvs)
        body, scan, error, by_menu, both = self.run_job({"sequences": [
            {"path": str(self.folder / "body"), "frames": [3, 4, 5, 6]},
            {"path": str(scans), "frames": [0, 1, 2, 0]},
            {"path": str(self.folder / "none"), "frames": []},
            {"path": str(self.folder / "body" / "sequence.h5"), "frames": [6], "operator": True},
            {"path": str(self.folder / "both.npz"), "frames": [2]}]})
        self.assertEqual((body["range"], body["name"]), ([3, 6], "body"))
        self.assertAlmostEqual(body["fps"], 12.5, places=5)
        corners = meshes[0].uvs[meshes[0].uv_faces].reshape(-1, 2)
        for frame, at in (("3", 0), ("4", 0), ("5", 1), ("6", 2)):
            np.testing.assert_allclose(body["frames"][frame]["vertices"], meshes[at].vertices, atol=1e-6)
            np.testing.assert_allclose(body["frames"][frame]["uv"], corners, atol=1e-6)
            self.assertEqual(body["frames"][frame]["materials"], ["body"])
        for frame in range(3):  # the last has another topology
            seen = scan["frames"][str(frame)]
            np.testing.assert_allclose(seen["vertices"], coloured[frame].vertices, atol=1e-6)
            np.testing.assert_allclose(np.array(seen["color"])[:, :3], coloured[frame].colors, atol=1e-6)
            self.assertEqual(seen["faces"], len(coloured[frame].faces))
            self.assertEqual(seen["materials"], ["scans"])
        self.assertEqual(both["name"], "both-cloth")
        np.testing.assert_allclose(both["frames"]["2"]["vertices"], meshes[2].vertices, atol=1e-6)
        np.testing.assert_allclose(both["frames"]["2"]["uv"], corners, atol=1e-6)
        np.testing.assert_allclose(both["others"]["both-body"], meshes[2].vertices[:5] + 1, atol=1e-6)
        self.assertIn("no frames", error["error"])
        np.testing.assert_allclose(by_menu["frames"]["6"]["vertices"], meshes[2].vertices, atol=1e-6)

    def test_what_is_wrong_is_reported_and_leaves_nothing_behind(self):
        atelier.write_sequence(self.folder / "body", atelier.sequence_of(moving(), 30, [1, 2, 3]))
        (self.folder / "text.png").write_text("no image")
        body = str(self.folder / "body" / "sequence.h5")
        answers = self.run_job({"sequences": [
            {"path": body, "texture": str(self.folder / "gone.png"), "frames": [], "operator": True},
            {"path": body, "texture": str(self.folder / "text.png"), "frames": [], "operator": True},
            {"path": str(self.folder / "text.png"), "frames": [], "operator": True}]})
        for answer, words in zip(answers, ("gone.png: no texture is there", "text.png: no image, as a texture has to be",
                                           "text.png: no archive of Atelier")):
            self.assertIn(words, answer["error"])
            self.assertNotIn("Traceback", answer["error"])
            self.assertEqual(answer["left"], 0)

    def test_render_of_a_saved_file_shows_every_frame_with_its_texture(self):
        atelier.write_sequence(self.folder / "body", atelier.sequence_of(moving(), 30, [1, 2, 3]))
        texture = np.zeros((8, 8, 3), np.uint8)
        texture[:4, :, 0] = texture[4:, :, 1] = 255  # red above, green below
        atelier.write_image(self.folder / "body.png", texture)
        self.run_job({"sequences": [{"path": str(self.folder / "body"), "frames": [1]}],
                      "render": {"frames": [1, 3], "scale": 2.0, "out": str(self.folder / "shot-"),
                                 "save": str(self.folder / "a.blend")}})
        centers = []
        for frame in (1, 2, 3):
            image = atelier.read_byte_image(self.folder / f"shot-{frame:04}.png").astype(int)
            lit = image.max(-1) > 40
            rows, columns = np.nonzero(lit)
            centers.append(columns.mean())
            upper, lower = image[rows.min() + 4, int(columns.mean())], image[rows.max() - 4, int(columns.mean())]
            self.assertGreater(upper[0], 2 * upper[1])
            self.assertGreater(lower[1], 2 * lower[0])
        np.testing.assert_allclose(np.diff(centers), 0.25 / 2.0 * 48, atol=0.7)

    def test_render_shows_the_colours_of_scans_whose_faces_change(self):
        scans = self.folder / "scans"
        scans.mkdir()
        for frame, color in ((1, [0.8, 0, 0]), (2, [0, 0.8, 0])):
            mesh = moving()[0]
            faces = mesh.faces if frame == 1 else mesh.faces[:4]
            colors = np.broadcast_to(color, mesh.vertices.shape)
            atelier.write_mesh_archive(scans / f"{frame:06}.h5", atelier.Mesh(mesh.vertices, faces, colors=colors))
        self.run_job({"sequences": [{"path": str(scans), "frames": [1]}],
                      "render": {"frames": [1, 2], "scale": 2.0, "out": str(self.folder / "shot-")}})
        for frame, channel in ((1, 0), (2, 1)):
            image = atelier.read_byte_image(self.folder / f"shot-{frame:04}.png").astype(int)
            lit = image[image.max(-1) > 40]
            self.assertGreater(len(lit), 40)
            self.assertTrue((lit[:, channel] > 2 * lit[:, 1 - channel]).all(), lit)


if __name__ == "__main__":
    unittest.main()
