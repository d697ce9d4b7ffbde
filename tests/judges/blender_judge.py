"""What Blender makes of a file: lines of a word and numbers, in the file's axes. Run inside of Blender:
    blender --background --python blender_judge.py -- gltf FILE [FRAME...]     each mesh's box, at frames of 24 a second
    blender --background --python blender_judge.py -- mesh FILE                vertices, triangles, box
    blender --background --python blender_judge.py -- bvh FILE [FRAME...]      the scene's frames a second; each joint's
                                                                               place, m, of a file in centimetres, Y up
    blender --background --python blender_judge.py -- svg FILE                 box of each named curve, mm
    blender --background --python blender_judge.py -- arm OUT.bvh             Blender's own BVH of an arm, and the place
                                                                             of each bone in each of its frames
"""
import builtins
import math
import sys

import bpy
import mathutils
import numpy

numpy.bool = bool  # the glTF reader of Blender 3.4 wants the name that NumPy 1.24 dropped
plain_open = builtins.open


def open_without_u(file, mode="r", *rest, **more):
    """Blender 3.4's BVH and SVG readers want the mode 'rU', which Python 3.11 dropped."""
    return plain_open(file, mode.replace("U", "") or "r", *rest, **more)


def say(word, *numbers):
    print("judged", word.replace(" ", "_"), *(f"{float(number):.9g}" for number in numbers))


def box(places):
    places = numpy.asarray(places)
    return [*places.min(0), *places.max(0)]


def evaluated(thing):
    return thing.evaluated_get(bpy.context.evaluated_depsgraph_get())


def y_up(place):
    return place[0], place[2], -place[1]


def gltf(path, frames):
    bpy.ops.import_scene.gltf(filepath=path)
    scene = bpy.context.scene
    for frame in frames:
        scene.frame_set(math.floor(float(frame)), subframe=float(frame) % 1)
        for thing in [one for one in scene.objects if one.type == "MESH" and not one.name.startswith("Icosphere")]:
            shown = evaluated(thing)
            say(
                f"{thing.name.split('.')[0]}@{frame}",
                *box([y_up(shown.matrix_world @ v.co) for v in shown.data.vertices]),
            )


def mesh(path):
    if path.endswith(".obj"):
        bpy.ops.wm.obj_import(filepath=path)
    else:
        bpy.ops.import_mesh.ply(filepath=path)
    data = [one for one in bpy.context.scene.objects if one.type == "MESH"][0].data
    data.calc_loop_triangles()
    say("mesh", len(data.vertices), len(data.loop_triangles), *box([v.co for v in data.vertices]))


def bvh(path, frames):
    builtins.open = open_without_u
    bpy.ops.import_anim.bvh(filepath=path, global_scale=0.01, update_scene_fps=True, rotate_mode="QUATERNION")
    builtins.open = plain_open
    scene = bpy.context.scene
    armature = [one for one in scene.objects if one.type == "ARMATURE"][0]
    say("bones", len(armature.pose.bones), min(bone.length for bone in armature.pose.bones))
    say("fps", scene.render.fps / scene.render.fps_base)
    for frame in frames:
        scene.frame_set(int(frame))
        for bone in evaluated(armature).pose.bones:
            say(f"{bone.name}@{frame}", *y_up(armature.matrix_world @ bone.head))


def svg(path):
    builtins.open = open_without_u
    bpy.ops.import_curve.svg(filepath=path)
    builtins.open = plain_open
    for thing in bpy.data.objects:
        if thing.type == "CURVE" and thing.data.splines:
            places = [thing.matrix_world @ p.co for s in thing.data.splines for p in s.bezier_points]
            say(thing.name, *(1000 * number for number in box([p[:2] for p in places])))


def arm(path):
    """A chain of a root and three bones, one beside them, rotations of any kind, moved for four frames."""
    data = bpy.data.armatures.new("arm")
    thing = bpy.data.objects.new("arm", data)
    bpy.context.collection.objects.link(thing)
    bpy.context.view_layer.objects.active = thing
    bpy.ops.object.mode_set(mode="EDIT")
    heads = {
        "hips": (0, 0, 1),
        "spine": (0, 0, 1.2),
        "chest": (0, 0.05, 1.5),
        "head": (0, 0, 1.8),
        "hand": (0.6, 0, 1.5),
    }
    parents = {"spine": "hips", "chest": "spine", "head": "chest", "hand": "chest"}
    for name, head in heads.items():
        bone = data.edit_bones.new(name)
        bone.head = head
        bone.tail = mathutils.Vector(head) + mathutils.Vector((0.02, 0.01, 0.15))
        if name in parents:
            bone.parent = data.edit_bones[parents[name]]
    bpy.ops.object.mode_set(mode="POSE")
    scene = bpy.context.scene
    scene.render.fps = 30
    scene.frame_start, scene.frame_end = 1, 4
    for frame in range(1, 5):
        for i, bone in enumerate(thing.pose.bones):
            bone.rotation_mode = "XYZ"
            bone.rotation_euler = (0.2 * i * (frame - 2), 0.1 * frame, -0.15 * i + 0.05 * frame)
            bone.keyframe_insert("rotation_euler", frame=frame)
        thing.pose.bones["hips"].location = (0.1 * frame, 0.02 * frame, 0)
        thing.pose.bones["hips"].keyframe_insert("location", frame=frame)
    bpy.ops.export_anim.bvh(filepath=path, frame_start=1, frame_end=4, rotate_mode="NATIVE", root_transform_only=False)
    for frame in range(1, 5):
        scene.frame_set(frame)
        for bone in evaluated(thing).pose.bones:
            say(f"{bone.name}@{frame - 1}", *(thing.matrix_world @ bone.head))


kind, path, *frames = sys.argv[sys.argv.index("--") + 1 :]
bpy.ops.wm.read_factory_settings(use_empty=True)
say("version", *bpy.app.version[:2])
{"gltf": gltf, "bvh": bvh}[kind](path, frames) if frames else {"mesh": mesh, "svg": svg, "arm": arm}[kind](path)
