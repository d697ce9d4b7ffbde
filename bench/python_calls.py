#!/usr/bin/env python3
"""What a call from Python costs beside the same call in C++, and beside the usual way in NumPy.

    PYTHONPATH=build/release/python python3 bench/python_calls.py [REPEATS]

Each figure is the least of REPEATS (200) calls, the sides in turn, so that other work on the machine counts
little. Both are given one thread, but for the last column, where Atelier has all.
"""

import itertools
import os
import sys
import time

import numpy as np

import atelier
from atelier import _atelier


def least(sides, repeats):
    """Least seconds of each side; the sides take turns."""
    seconds = [[] for _ in sides]
    for turn in range(repeats + 3):
        for own, side in zip(seconds, sides):
            own.append(side())
    return [min(own[3:]) for own in seconds]


def timed(work):
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def rotations_of(vectors):
    """Rodrigues' formula of [J,3]."""
    angle = np.linalg.norm(vectors, axis=1)[:, None, None]
    axis = vectors[:, :, None] / np.where(angle == 0, 1, angle)
    x, y, z = axis[:, 0, 0], axis[:, 1, 0], axis[:, 2, 0]
    zero = np.zeros_like(x)
    K = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], -1).reshape(-1, 3, 3)
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def numpy_skinning(parents, joints, rest, weights, pose):
    """Linear blend skinning as smplx and its like write it: dense weights [V,J], matrices [J,4,4]."""
    R = rotations_of(pose)
    world = np.zeros((len(parents), 4, 4))
    for j, parent in enumerate(parents):
        local = np.eye(4)
        local[:3, :3] = R[j]
        local[:3, 3] = joints[j] - (joints[parent] if parent >= 0 else 0)
        world[j] = local if parent < 0 else world[parent] @ local
    world[:, :3, 3] -= np.einsum("jab,jb->ja", world[:, :3, :3], joints)
    blended = np.tensordot(weights, world, 1)
    return np.einsum("vab,vb->va", blended[:, :3, :3], rest) + blended[:, :3, 3]


def projections_of(cameras):
    """[3,4] of each camera without distortion."""
    return [np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]])
            @ np.column_stack([camera.camera_from_world_rotation, camera.camera_from_world_translation])
            for camera in cameras]


def linear_point(P, rows):
    """The direct linear transform, weighted by confidence."""
    A = []
    for projection, (u, v, confidence) in zip(P, rows):
        A += [confidence * (u * projection[2] - projection[0]), confidence * (v * projection[2] - projection[1])]
    x = np.linalg.svd(np.array(A))[2][-1]
    return x[:3] / x[3]


def numpy_triangulation(P, detections):
    """Points [F,K,3] by the direct linear transform: every detection counts."""
    return np.array([[linear_point(P, [points[k] for points in frame]) for k in range(len(frame[0]))]
                     for frame in detections])


def numpy_robust_triangulation(P, detections, threshold=15):
    """The same without the cameras that are off, as Pose2Sim does: while the error is above the threshold, every
    set with one camera less is tried, and the best is kept."""
    P, found = np.array(P), []
    for frame in detections:
        for k in range(len(frame[0])):
            rows, best = np.array([points[k] for points in frame]), (np.inf, None)
            for out in range(0, len(P) - 2):
                for left in itertools.combinations(range(len(P)), out):
                    kept = np.delete(np.arange(len(P)), left)
                    point = linear_point(P[kept], rows[kept])
                    pixels = P[kept] @ np.append(point, 1)
                    error = np.linalg.norm(pixels[:, :2] / pixels[:, 2:] - rows[kept, :2], axis=1).mean()
                    if error < best[0]:
                        best = (error, point)
                if best[0] < threshold:
                    break
            found.append(best[1])
    return np.array(found).reshape(len(detections), -1, 3)


def main():
    repeats = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    atelier.set_thread_count(1)
    random = np.random.default_rng(0)
    model = atelier.default_human({"correctives": False, "shape_basis": False})
    body = atelier.shape_body(model)
    pose = atelier.Pose(0.2 * random.standard_normal((atelier.joint_count(model), 3)))

    tree = atelier.build_tree(body.vertices, model.mesh.faces)
    queries = body.vertices[:10000] + 0.01
    n = 99  # 10,000 vertices
    z, x = np.mgrid[0:n + 1, 0:n + 1] / n
    a = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    faces = np.concatenate([np.stack([a, a + n + 1, a + 1], 1), np.stack([a + 1, a + n + 1, a + n + 2], 1)])
    flat = np.stack([x, 0 * x, z], -1).reshape(-1, 3)
    faces = faces.astype(np.int32)
    garment = atelier.Garment("cloth", atelier.Mesh(flat, faces))
    solver = atelier.create_solver(atelier.SimulationModel(atelier.make_cloth(garment, [0, n])))
    control = atelier.Control()

    print("| call | C++ (ms) | from Python (ms) | cost |")
    print("|---|---|---|---|")
    for name, work, inside in (
            (f"`skin_vertices`, {len(body.vertices)} vertices", lambda: atelier.skin_vertices(model, body, pose),
             lambda: _atelier._seconds_of_skinning(model, body, pose, 1)[0]),
            ("`closest_points`, 10000 queries", lambda: atelier.closest_points(tree, queries),
             lambda: _atelier._seconds_of_closest_points(tree, queries, 1)[0]),
            ("`vertex_normals`, 10000 vertices", lambda: atelier.vertex_normals(flat, faces),
             lambda: _atelier._seconds_of_normals(flat, faces, 1)[0]),
            ("`Solver.step`, 10000 vertices", lambda: solver.step(control),
             lambda: _atelier._seconds_of_steps(solver, control, 1)[0])):
        count = repeats if "step" not in name else max(repeats // 10, 10)
        own, called = least((inside, lambda: timed(work)), count)
        print(f"| {name} | {1000 * own:.3f} | {1000 * called:.3f} | {100 * (called / own - 1):+.1f} % |")

    weights = np.zeros((len(body.vertices), atelier.joint_count(model)))
    for slot in range(model.skin_joints.shape[1]):
        np.add.at(weights, (np.arange(len(weights)), model.skin_joints[:, slot]), model.skin_weights[:, slot])
    parents, joints, rest, rotations = model.skeleton.parents, body.joints, body.vertices, pose.rotations
    same = numpy_skinning(parents, joints, rest, weights, rotations)
    assert np.abs(same - atelier.skin_vertices(model, body, pose)).max() < 1e-9

    cameras = atelier.turntable_cameras(rest, 8, width=1000, height=1000)
    schema = atelier.keypoint_schema("body_25")
    P = projections_of(cameras)
    points = joints[random.integers(0, len(joints), 25)] + np.linspace(0, 0.3, 20)[:, None, None]

    def detections_of(outliers):
        noise = lambda: random.standard_normal((25, 2)) + 100 * (random.random((25, 1)) < outliers)
        return [[np.column_stack([atelier.project(camera, frame) + noise(), np.full(25, 0.9)]) for camera in cameras]
                for frame in points]

    clean, spoiled = detections_of(0), detections_of(0.1)
    options = {"distances": False, "swaps": False}
    threads = max(os.cpu_count() or 1, 1)
    print(f"\n| work | NumPy (ms) | Atelier (ms) | times as fast | with {threads} threads (ms) | times as fast |")
    print("|---|---|---|---|---|---|")
    for name, usual, ours, count in (
            (f"skinning of {len(rest)} vertices, {len(parents)} joints",
             lambda: numpy_skinning(parents, joints, rest, weights, rotations),
             lambda: atelier.skin_vertices(model, body, pose), repeats // 4),
            ("`linear_points` of 20 frames, 25 points, 8 cameras", lambda: numpy_triangulation(P, clean),
             lambda: [atelier.linear_points(cameras, frame) for frame in clean], repeats // 10),
            ("`triangulate` of the same; NumPy: every detection counts", lambda: numpy_triangulation(P, clean),
             lambda: atelier.triangulate(cameras, clean, schema, 30, options), repeats // 10),
            ("the same, one detection of ten is off; NumPy: leaves cameras out",
             lambda: numpy_robust_triangulation(P, spoiled),
             lambda: atelier.triangulate(cameras, spoiled, schema, 30, options), repeats // 20)):
        def with_all():
            atelier.set_thread_count(0)
            taken = timed(ours)
            atelier.set_thread_count(1)
            return taken

        slow, fast, wide = least((lambda: timed(usual), lambda: timed(ours), with_all), max(count, 5))
        print(f"| {name} | {1000 * slow:.2f} | {1000 * fast:.2f} | {slow / fast:.1f} "
              f"| {1000 * wide:.2f} | {slow / wide:.1f} |")


if __name__ == "__main__":
    main()
