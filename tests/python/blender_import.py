"""Run by Blender: imports sequences, renders frames, writes what it saw as JSON.

    blender --background --factory-startup --python blender_import.py -- ADDON JOB.json OUT.json
"""

import importlib.util
import json
import pathlib
import sys

import bpy
import numpy as np

addon_path, job_path, out_path = sys.argv[sys.argv.index("--") + 1:]
spec = importlib.util.spec_from_file_location("atelier_sequences", addon_path)
addon = importlib.util.module_from_spec(spec)
sys.modules["atelier_sequences"] = addon
spec.loader.exec_module(addon)
addon.register()
job = json.loads(pathlib.Path(job_path).read_text())
for thing in list(bpy.data.objects):
    bpy.data.objects.remove(thing)
scene = bpy.context.scene
answers = []


def state(thing):
    mesh = thing.data
    vertices = np.empty(3 * len(mesh.vertices))
    mesh.vertices.foreach_get("co", vertices)
    answer = {"vertices": vertices.reshape(-1, 3).tolist(), "faces": len(mesh.polygons),
              "materials": [material.name for material in mesh.materials], "uv": None, "color": None}
    if mesh.uv_layers:
        uv = np.empty(2 * len(mesh.loops))
        mesh.uv_layers["UVMap"].data.foreach_get("uv", uv)
        answer["uv"] = uv.reshape(-1, 2).tolist()
    if mesh.color_attributes.get("Col"):
        color = np.empty(4 * len(mesh.vertices))
        mesh.color_attributes["Col"].data.foreach_get("color", color)
        answer["color"] = color.reshape(-1, 4).tolist()
    return answer


def count():
    return sum(len(kind) for kind in (bpy.data.objects, bpy.data.meshes, bpy.data.materials, bpy.data.images))


for one in job["sequences"]:
    before = count()
    try:
        if one.get("operator"):
            bpy.ops.import_scene.atelier_sequence(filepath=one["path"], texture=one.get("texture") or "")
            thing = bpy.context.scene.objects[-1]
        else:
            thing = addon.import_sequence(one["path"], texture=one.get("texture"))
    except (addon.SequenceError, RuntimeError) as error:
        answers.append({"error": str(error), "left": count() - before})
        continue
    frames = {}
    for frame in one["frames"]:
        scene.frame_set(frame)
        frames[frame] = state(thing)
    answers.append({"frames": frames, "range": [scene.frame_start, scene.frame_end],
                    "fps": scene.render.fps / scene.render.fps_base, "name": thing.name,
                    "others": {other.name: state(other)["vertices"] for other in scene.objects if other != thing}})

if "render" in job:
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    bpy.context.collection.objects.link(camera)
    camera.data.type, camera.data.ortho_scale = "ORTHO", job["render"]["scale"]
    camera.location, camera.rotation_euler = (0, -5, 0), (np.pi / 2, 0, 0)
    scene.camera = camera
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (0, 0, 0, 1)
    light = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    light.data.energy = 3
    light.rotation_euler = (np.pi / 2, 0, 0)
    bpy.context.collection.objects.link(light)
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 4
    scene.cycles.use_denoising = False  # Debian's has no denoiser
    scene.cycles.device = "CPU"
    scene.render.resolution_x = scene.render.resolution_y = 48
    scene.view_settings.view_transform = "Standard"
    scene.frame_start, scene.frame_end = job["render"]["frames"]
    scene.render.filepath = job["render"]["out"]
    saved = job["render"].get("save")
    if saved:  # as a user does: save, open, render
        bpy.ops.wm.save_as_mainfile(filepath=saved)
        bpy.ops.wm.open_mainfile(filepath=saved)
    bpy.ops.render.render(animation=True)

pathlib.Path(out_path).write_text(json.dumps(answers))
