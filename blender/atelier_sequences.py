"""Imports sequences of bodies, garments and scans of Atelier into Blender (3.4 and later).

Edit > Preferences > Add-ons > Install, then File > Import > Atelier sequence. Opens a folder of a workspace
(`animate/current/body`, `register/current/...`, anything with `sequence.h5`), one file of a sequence (`T.h5` of
`atelier simulate`, `export --format h5`, `.npz` of other programs), a folder of meshes (`export --format ply` or `obj`),
or one mesh. Texture coordinates, colours and the material stay on the object: a frame replaces places of vertices alone,
also in a render. Frames are the capture's own numbers.

Scripts: atelier_sequences.import_sequence(path, texture="skin.png") -> object
"""

bl_info = {
    "name": "Atelier sequences",
    "author": "The authors of Atelier",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "File > Import > Atelier sequence",
    "description": "Bodies, garments and scans over time, with UV, colours and materials",
    "category": "Import-Export",
}

import bisect
import contextlib
import hashlib
import math
import pathlib
import re
import zipfile
import zlib

import numpy as np

TYPES = {"bool": "?", "int8": "i1", "uint8": "u1", "int16": "<i2", "uint16": "<u2", "int32": "<i4", "uint32": "<u4",
         "int64": "<i8", "uint64": "<u8", "float32": "<f4", "float64": "<f8"}


class SequenceError(ValueError):
    """A file that cannot be read, with what is wrong."""


# --- files ---------------------------------------------------------------------------------------


def read_archive(path):
    """Schema, numbers and arrays of an archive of Atelier (docs/reference/formats.md), without HDF5."""
    data = pathlib.Path(path).read_bytes()
    end = data.find(b"\n")
    first = data[:max(end, 0)].split(b" ")
    if len(first) != 3 or first[0] != b"ATELIER-ARCHIVE":
        raise SequenceError(f"{path}: no archive of Atelier")
    if hashlib.sha256(data[end + 1:]).hexdigest().encode() != first[2]:
        raise SequenceError(f"{path}: damaged; its digest is another")
    schema, numbers, arrays = "", {}, {}
    for line in data[end + 1:].split(b"\n"):
        words = line.decode().split(" ")
        if words[0] == "end":
            return schema, numbers, arrays
        if words[0] == "schema":
            schema = words[1]
        elif words[0] == "number":
            numbers[words[1]] = float(words[2])
        elif words[0] == "dataset" and words[2] in TYPES:
            shape = [int(size) for size in words[3].split(",")]
            kind = np.dtype(TYPES[words[2]])
            array = np.empty(shape, kind)
            rows, at = int(words[4]), 0
            for offset in words[5:]:
                part = array[at:at + rows]
                part[...] = np.frombuffer(data, kind, part.size, int(offset)).reshape(part.shape)
                at += rows
            arrays[words[1]] = array
    raise SequenceError(f"{path}: its index has no end")


def read_ply(path):
    """Arrays of a binary PLY of triangles, by the names of an archive."""
    data = pathlib.Path(path).read_bytes()
    header = re.search(rb"end_header\r?\n", data)
    if not data.startswith(b"ply") or not header:
        raise SequenceError(f"{path}: no PLY")
    kinds = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
             "double": "f8", "int8": "i1", "uint8": "u1", "int32": "i4", "float32": "f4", "float64": "f8"}
    order, elements = "<", []
    for line in data[:header.start()].decode("ascii", "replace").splitlines():
        words = line.split()
        if words[:1] == ["format"]:
            if words[1] == "ascii":
                raise SequenceError(f"{path}: text PLY; export it again, which writes binary")
            order = ">" if "big" in words[1] else "<"
        elif words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            elements[-1][2].append(words[1:])
    arrays, at = {}, header.end()
    for element, count, properties in elements:
        fields = []
        for words in properties:
            if words[0] == "list":  # triangles: the same count in every row
                length = 6 if words[3] == "texcoord" else 3
                fields += [(words[3] + "_count", order + kinds[words[1]]), (words[3], order + kinds[words[2]], length)]
            else:
                fields.append((words[1], order + kinds[words[0]]))
        rows = np.frombuffer(data, np.dtype(fields), count, at)
        at += rows.nbytes
        if element == "vertex":
            arrays["vertices"] = np.stack([rows[name] for name in "xyz"], 1).astype(float)
            if "red" in rows.dtype.names:
                colors = np.stack([rows[name] for name in ("red", "green", "blue")], 1)
                arrays["colors"] = linear(colors / 255) if colors.dtype == np.uint8 else colors.astype(float)
            if "s" in rows.dtype.names:
                arrays["uvs"] = np.stack([rows["s"], rows["t"]], 1).astype(float)
        elif element == "face":
            if count and (rows["vertex_indices_count"] != 3).any():
                raise SequenceError(f"{path}: faces that are no triangles")
            arrays["faces"] = rows["vertex_indices"].astype(np.int32)
            if "texcoord" in rows.dtype.names:
                arrays["uvs"] = rows["texcoord"].reshape(-1, 2).astype(float)
                arrays["uv_faces"] = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    if "uvs" in arrays and "uv_faces" not in arrays:
        arrays["uv_faces"] = arrays["faces"]
    return arrays


def row_of(index, count):
    """Of an index of OBJ: from 1, or, below 0, back from the last of `count` so far."""
    number = int(index)
    return number - 1 if number > 0 else count + number if number < 0 else -1


def read_obj(path):
    """Arrays of an OBJ of triangles; colours stand behind the vertices, in sRGB."""
    vertices, colors, uvs, faces, uv_faces = [], [], [], [], []
    for line in pathlib.Path(path).read_text("utf-8", "replace").splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append([float(word) for word in words[1:4]])
            if len(words) >= 7:
                colors.append([float(word) for word in words[4:7]])
        elif words[:1] == ["vt"]:
            uvs.append([float(word) for word in words[1:3]])
        elif words[:1] == ["f"]:
            if len(words) != 4:
                raise SequenceError(f"{path}: faces that are no triangles")
            corners = [word.split("/") for word in words[1:]]
            faces.append([row_of(corner[0], len(vertices)) for corner in corners])
            if len(corners[0]) > 1 and corners[0][1]:
                uv_faces.append([row_of(corner[1], len(uvs)) for corner in corners])
    arrays = {"vertices": np.array(vertices, float).reshape(-1, 3), "faces": np.array(faces, np.int32).reshape(-1, 3)}
    if uv_faces and len(uv_faces) == len(faces):
        arrays |= {"uvs": np.array(uvs, float), "uv_faces": np.array(uv_faces, np.int32)}
    if colors and len(colors) == len(vertices):
        arrays["colors"] = linear(colors)
    return arrays


def read_npz(path, part):
    """Arrays of meshes over time: `vertices` [F,V,3], `faces`, `uv`, or those of a part, "body_vertices" and so on."""
    with np.load(path) as file:  # no pickles
        names = {name.removeprefix(part + "_"): name for name in file.files if not part or name.startswith(part + "_")}
        arrays = {name: file[names[name]] for name in ("vertices", "faces", "uv") if name in names}
        arrays |= {name: file[name] for name in ("fps", "frame_ids") if name in file.files}
    for name, columns in (("vertices", 3), ("faces", 3), ("uv", 2)):
        if name in arrays and (arrays[name].ndim != (3 if name == "vertices" else 2) or arrays[name].shape[-1] != columns):
            raise SequenceError(f"{path}: {name} of shape {arrays[name].shape}")
    if "vertices" not in arrays or "faces" not in arrays:
        raise SequenceError(f"{path}: no vertices [F,V,3] and faces [N,3]")
    return arrays


def parts_of(path):
    """Meshes that a file keeps beside each other: "body", "cloth"; "" of one that has no such names."""
    if path.suffix.lower() != ".npz" or not path.is_file():
        return [""]
    with damage_named(path), np.load(path) as file:
        parts = [part for part in ("body", "cloth") if f"{part}_vertices" in file.files]
        return parts if parts and "vertices" not in file.files else [""]


def checked(path, arrays):
    """The arrays, if all faces are of vertices that are there: Blender dies of others."""
    for faces, rows in (("faces", "vertices"), ("uv_faces", "uvs")):
        if faces in arrays and arrays[faces].size:
            low, high = int(arrays[faces].min()), int(arrays[faces].max())
            if rows not in arrays or low < 0 or high >= len(arrays[rows]):
                raise SequenceError(f"{path}: {faces} name rows {low} to {high} of {len(arrays.get(rows, ()))} {rows}")
    if not np.isfinite(arrays["vertices"]).all():
        raise SequenceError(f"{path}: vertices that are no numbers")
    return arrays


def linear(srgb):
    srgb = np.asarray(srgb, float)
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


@contextlib.contextmanager
def damage_named(path):
    """What a reader stumbles over, as a sentence that names the file."""
    try:
        yield
    except SequenceError:
        raise
    except (ValueError, IndexError, KeyError, TypeError, AttributeError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise SequenceError(f"{path}: damaged: {error}") from error


class Sequence:
    """Frames of a path: `fps` (0: not known), `frame_ids`, `arrays_of(frame_id)`. `part`: of parts_of."""

    def __init__(self, path, part=""):
        self.path, self.part = pathlib.Path(path), part
        if self.path.name == "sequence.h5" and self.path.parent.joinpath("frames").is_dir():
            self.path = self.path.parent
        self.fps, self.shared, self.all = 0.0, {}, None
        self.files = {}
        with damage_named(self.path):
            self.find_frames()
        self.frame_ids = sorted(self.files)
        if not self.frame_ids:
            raise SequenceError(f"{self.path}: no frames; " + self.where_frames_are())

    def where_frames_are(self):
        found = sorted(str(file.parent.relative_to(self.path)) for pattern in ("*", "*/*", "*/*/*") if self.path.is_dir()
                       for file in self.path.glob(pattern + "/sequence.h5"))
        newest = [name for name in found if not re.search(r"(^|/)[0-9a-f]{16}(/|$)", name)]  # by "current"
        found = newest or found
        if found:
            return f"import those of a folder in it: {', '.join(found[:8])}"
        return "a folder of a workspace, or of PLY or OBJ files, has some"

    def find_frames(self):
        if self.path.is_dir() and (self.path / "sequence.h5").exists():
            schema, numbers, arrays = read_archive(self.path / "sequence.h5")
            if schema != "atelier.sequence":
                raise SequenceError(f"{self.path}: sequence.h5 is of schema {schema}")
            self.fps = numbers["fps"]
            self.shared = {name: arrays[name] for name in ("faces", "uvs", "uv_faces") if name in arrays}
            self.files = {int(frame): self.path / "frames" / f"{frame:06}.h5" for frame in arrays["frame_ids"]}
        elif self.path.is_dir():
            names, unnumbered = set(), []
            for file in sorted(self.path.iterdir()):
                number = re.search(r"^(.*?)(\d+)\.(ply|obj|h5)$", file.name, re.IGNORECASE)
                if number:
                    self.files[int(number[2])] = file
                    names.add(number[1])
                elif file.suffix.lower() in (".ply", ".obj"):
                    unnumbered.append(file.name)
            if unnumbered and not self.files:
                raise SequenceError(f"{self.path / unnumbered[0]}: no number of a frame at the end of its name; a single "
                                    "mesh is opened by its file, frames are named like frame_000012.ply")
            if len(names) > 1:
                raise SequenceError(f"{self.path}: frames of several meshes ({', '.join(sorted(names))}); "
                                    "give each a folder of its own")
        elif not self.path.exists():
            raise SequenceError(f"{self.path}: nothing is there; a sequence is a folder, or a file .h5, .npz, .ply or .obj")
        elif self.path.suffix.lower() in (".ply", ".obj"):
            self.files = {0: self.path}
        elif self.path.suffix.lower() == ".npz":
            arrays = read_npz(self.path, self.part)
            self.fps = float(np.ravel(arrays.get("fps", 0))[0])
            self.all = arrays["vertices"].astype(float)
            self.shared = {"faces": arrays["faces"].astype(np.int32)}
            if "uv" in arrays:
                self.shared |= {"uvs": arrays["uv"].astype(float), "uv_faces": self.shared["faces"]}
            ids = arrays.get("frame_ids", np.arange(len(self.all)))
            if len(ids) != len(self.all):
                raise SequenceError(f"{self.path}: {len(ids)} frame_ids of {len(self.all)} frames")
            self.files = {int(frame): at for at, frame in enumerate(ids)}
        else:
            schema, _, arrays = read_archive(self.path)
            if schema == "atelier.mesh_sequence":
                self.fps = float(arrays["fps"][0])
                self.all = arrays["vertices"]
                self.shared = {name: arrays[name] for name in ("faces", "uvs", "uv_faces") if name in arrays}
                self.files = {int(frame): at for at, frame in enumerate(arrays["frame_ids"])}
            elif schema == "atelier.mesh":
                self.files = {0: self.path}
            else:
                raise SequenceError(f"{self.path}: of schema {schema}, which is no mesh")

    def nearest(self, frame):
        """The last frame that is not after `frame`; before the first one, the first."""
        return self.frame_ids[max(bisect.bisect_right(self.frame_ids, frame) - 1, 0)]

    def arrays_of(self, frame_id):
        if self.all is not None:
            return checked(self.path, self.shared | {"vertices": self.all[self.files[frame_id]]})
        file = self.files[frame_id]
        read = {".ply": read_ply, ".obj": read_obj}.get(file.suffix.lower(), lambda path: read_archive(path)[2])
        with damage_named(file):
            return checked(file, self.shared | read(file))


# --- Blender -------------------------------------------------------------------------------------

try:
    import bpy
    from bpy.app.handlers import persistent
    from bpy.props import BoolProperty, StringProperty
    from bpy_extras.io_utils import ImportHelper
except ImportError:  # the readers alone, without Blender
    bpy = None

opened = {}  # sequences by path and part, for frames that follow each other


def sequence_at(path, part):
    if (path, part) not in opened:
        opened[path, part] = Sequence(path, part)
    return opened[path, part]


def fill_mesh(mesh, arrays):
    """Topology, texture coordinates and colours of a mesh that is new or cleared."""
    vertices, faces = arrays["vertices"], arrays.get("faces", np.zeros((0, 3), np.int32))
    mesh.from_pydata(vertices.tolist(), [], faces.tolist())
    mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), bool))
    if "uvs" in arrays and "uv_faces" in arrays:
        layer = mesh.uv_layers.get("UVMap") or mesh.uv_layers.new(name="UVMap")
        layer.data.foreach_set("uv", np.ascontiguousarray(arrays["uvs"][arrays["uv_faces"].ravel()], np.float32).ravel())
    set_colors(mesh, arrays)
    mesh.update()


def set_colors(mesh, arrays):
    colors = arrays.get("colors")
    if colors is None or len(colors) != len(mesh.vertices):
        return
    attribute = mesh.color_attributes.get("Col") or mesh.color_attributes.new("Col", "FLOAT_COLOR", "POINT")
    rgba = np.ones((len(colors), 4), np.float32)
    rgba[:, :3] = colors
    attribute.data.foreach_set("color", rgba.ravel())


def show_frame(thing, frame):
    """Gives an object the vertices of a frame; what hangs on its topology stays."""
    sequence = sequence_at(thing["atelier_sequence"], thing.get("atelier_part", ""))
    frame_id = sequence.nearest(frame - thing.get("atelier_offset", 0))
    if thing.get("atelier_frame") == frame_id:
        return
    arrays = sequence.arrays_of(frame_id)
    mesh = thing.data
    faces = arrays.get("faces")
    same = len(arrays["vertices"]) == len(mesh.vertices) and (faces is None or len(faces) == len(mesh.polygons))
    if same and faces is not None and not sequence.shared:  # scans may agree by chance
        corners = np.empty(len(mesh.loops), np.int32)
        mesh.loops.foreach_get("vertex_index", corners)
        same = np.array_equal(corners, faces.ravel())
    if same:
        mesh.vertices.foreach_set("co", np.ascontiguousarray(arrays["vertices"], np.float32).ravel())
        set_colors(mesh, arrays)
        mesh.update()
    else:
        mesh.clear_geometry()  # materials stay
        fill_mesh(mesh, arrays)
    thing["atelier_frame"] = frame_id


def material_for(name, mesh, texture):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    shader = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Roughness"].default_value = 0.7
    if texture:
        source = nodes.new("ShaderNodeTexImage")
        source.image = texture
        links.new(source.outputs["Color"], shader.inputs["Base Color"])
    elif mesh.color_attributes.get("Col"):
        source = nodes.new("ShaderNodeVertexColor")
        source.layer_name = "Col"
        links.new(source.outputs["Color"], shader.inputs["Base Color"])
    return material


def texture_beside(path):
    """NAME.png or .jpg beside a sequence, texture.png in it, or, of an avatar in a workspace, the texture of the stage."""
    of_avatar = {"surface": path.parent, "seen": path.parent.parent.parent / "avatar" / "current"}.get(path.name, path)
    for image in (path.with_suffix(".png"), path.with_suffix(".jpg"), path / "texture.png", of_avatar / "texture.png"):
        if image.is_file():
            return image
    return None


def texture_at(path):
    """The image of a file."""
    if not pathlib.Path(path).is_file():
        raise SequenceError(f"{path}: no texture is there")
    image = bpy.data.images.load(str(path), check_existing=True)
    if 0 in image.size:
        bpy.data.images.remove(image)
        raise SequenceError(f"{path}: no image, as a texture has to be")
    return image


def import_sequence(path, texture=None, name=None, set_scene=True):
    """An object that follows the scene's frame. `texture`: an image file; None: the one beside the sequence, if any.
    `set_scene`: frame range and rate become the sequence's. Of a file with a body and cloth both come; the cloth, which
    takes the texture, is returned."""
    path = pathlib.Path(path).absolute()  # `current` stays what it is: the newest result
    sequences = [Sequence(path, part) for part in parts_of(path)]
    path = sequences[-1].path
    firsts = [sequence.arrays_of(sequence.frame_ids[0]) for sequence in sequences]
    texture = texture or texture_beside(path)
    image = texture_at(texture) if texture else None
    if not name:
        name = path.stem if path.stem != "current" else path.parent.name
    things = []
    for sequence, arrays in zip(sequences, firsts):
        opened[str(path), sequence.part] = sequence
        things.append(add_object(sequence, arrays, "-".join(filter(None, (name, sequence.part))),
                                 image if sequence is sequences[-1] else None))
    scene = bpy.context.scene
    if set_scene:
        scene.frame_start, scene.frame_end = sequence.frame_ids[0], sequence.frame_ids[-1]
        if sequence.fps > 0:
            scene.render.fps = max(round(sequence.fps), 1)
            scene.render.fps_base = scene.render.fps / sequence.fps
    scene.render.use_lock_interface = True  # a render reads the mesh that frames write
    follow_frames()
    for thing in things:
        show_frame(thing, scene.frame_current)
    return things[-1]


def add_object(sequence, arrays, name, image):
    """An object with the first frame."""
    mesh = bpy.data.meshes.new(name)
    fill_mesh(mesh, arrays)
    thing = bpy.data.objects.new(name, mesh)
    thing.rotation_euler = (math.pi / 2, 0, 0)  # Y up to Z up
    thing["atelier_sequence"] = str(sequence.path)
    thing["atelier_part"] = sequence.part
    thing["atelier_frame"] = sequence.frame_ids[0]
    thing["atelier_offset"] = 0
    bpy.context.collection.objects.link(thing)
    mesh.materials.append(material_for(name, mesh, image))
    return thing


if bpy:

    @persistent
    def on_frame(scene, *_):
        """Before Blender evaluates a frame, in playback and in renders alike."""
        for thing in scene.objects:
            if thing.type == "MESH" and "atelier_sequence" in thing:
                try:
                    show_frame(thing, scene.frame_current)
                except (OSError, SequenceError) as error:
                    print("Atelier sequences:", error)

    @persistent
    def on_load(*_):
        opened.clear()
        follow_frames()

    class ImportAtelierSequence(bpy.types.Operator, ImportHelper):
        """Import a body, garment or scan over time"""

        bl_idname = "import_scene.atelier_sequence"
        bl_label = "Import Atelier sequence"
        bl_options = {"REGISTER", "UNDO"}
        filter_glob: StringProperty(default="*.h5;*.npz;*.ply;*.obj", options={"HIDDEN"})
        texture: StringProperty(name="Texture", description="Image on the surface; empty: the one beside the sequence",
                                subtype="FILE_PATH")
        set_scene: BoolProperty(name="Set frame range", default=True,
                                description="Give the scene the sequence's frames and rate")

        def execute(self, context):
            path = pathlib.Path(self.filepath)
            numbered = path.suffix.lower() in (".ply", ".obj") and re.search(r"\d$", path.stem)
            if numbered or (path.suffix == ".h5" and path.parent.name == "frames"):
                path = path.parent.parent if path.parent.name == "frames" else path.parent
            try:
                import_sequence(path, bpy.path.abspath(self.texture) or None, set_scene=self.set_scene)
            except (OSError, SequenceError) as error:
                self.report({"ERROR"}, str(error))
                return {"CANCELLED"}
            return {"FINISHED"}

    def menu(self, _context):
        self.layout.operator(ImportAtelierSequence.bl_idname, text="Atelier sequence (.h5, .npz, .ply, .obj)")


def follow_frames():
    # Before the frame is evaluated: what a handler behind it changes is not in that frame's render.
    for handlers, handler in ((bpy.app.handlers.frame_change_pre, on_frame), (bpy.app.handlers.load_post, on_load)):
        if handler not in handlers:
            handlers.append(handler)


def register():
    bpy.utils.register_class(ImportAtelierSequence)
    bpy.types.TOPBAR_MT_file_import.append(menu)
    follow_frames()


def unregister():
    bpy.types.TOPBAR_MT_file_import.remove(menu)
    bpy.utils.unregister_class(ImportAtelierSequence)
    for handlers, handler in ((bpy.app.handlers.frame_change_pre, on_frame), (bpy.app.handlers.load_post, on_load)):
        if handler in handlers:
            handlers.remove(handler)


if __name__ == "__main__":
    register()
