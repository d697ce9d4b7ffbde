"""What Atelier holds: the animation of a workspace, and comparisons with it."""

import pathlib
import sys

import h5py
import numpy


def box(places):
    return [*numpy.min(places, axis=0).tolist(), *numpy.max(places, axis=0).tolist()]


def largest(found, held):
    """Largest difference over all that is held; what was not found is an error."""
    return max(float(numpy.abs(numpy.subtract(found[key], held[key])).max()) for key in held)


def rotation(vector):
    angle = float(numpy.linalg.norm(vector))
    if angle == 0:
        return numpy.eye(3)
    x, y, z = numpy.asarray(vector) / angle
    cross = numpy.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return numpy.eye(3) + numpy.sin(angle) * cross + (1 - numpy.cos(angle)) * cross @ cross


class Held:
    """The animation of a workspace, metres: meshes by name, frame by frame, and the joints."""

    def __init__(self, workspace):
        result = pathlib.Path(workspace) / "animate/current"
        if not (result / "motion.npz").exists():
            sys.exit(f"opens-in: {workspace} has no result of animate: atelier run CAPTURE WORKSPACE")
        # The exported body is the seen one, with hair and shoes, where the person has an avatar.
        seen = result / "seen"
        self.folders = {"body": seen if seen.exists() else result / "body"}
        self.folders |= {one.name: one for one in sorted((result / "garments").iterdir())}
        with h5py.File(result / "body/sequence.h5") as header:
            self.ids = header["frame_ids"][:].tolist()
            self.fps = float(header.attrs["fps"])
        self.faces, self.textured = {}, {}  # triangles; pairs of vertex and texture coordinate
        for name, folder in self.folders.items():
            with h5py.File(folder / "sequence.h5") as header:
                self.faces[name] = faces = header["faces"][:]
                corners = header["uv_faces"][:] if "uv_faces" in header else faces
                self.textured[name] = len(set(zip(faces.ravel().tolist(), corners.ravel().tolist())))
        self.motion = dict(numpy.load(result / "motion.npz"))
        self.shown = [0, len(self.ids) // 2, len(self.ids) - 1]  # the frames that are compared
        self.result = result

    def vertices(self, name, frame):
        with h5py.File(self.folders[name] / f"frames/{self.ids[frame]:06d}.h5") as mesh:
            return mesh["vertices"][:]

    def time(self, frame):
        return f"{frame / self.fps:.9g}"

    def frames(self):
        return f"frames {', '.join(str(self.ids[frame]) for frame in self.shown)} of {len(self.ids)}"

    def boxes(self, key):
        """Boxes of all meshes in the frames shown, by `key(name, frame)`."""
        return {key(name, frame): box(self.vertices(name, frame)) for name in self.folders for frame in self.shown}

    def joints(self, frame):
        """Places of all joints by name, metres."""
        motion, turns, places = self.motion, [], {}
        for j, name in enumerate(motion["joint_names"].tolist()):
            parent = int(motion["parents"][j])
            before = numpy.eye(3) if parent < 0 else turns[parent]
            base = motion["root_translation"][frame] if parent < 0 else list(places.values())[parent]
            places[str(name)] = base + before @ motion["offsets"][j]
            rest = rotation(motion["rest_rotations"][j]) if len(motion["rest_rotations"]) else numpy.eye(3)
            turns.append(before @ rest @ rotation(motion["rotations"][frame][j]))
        return places
