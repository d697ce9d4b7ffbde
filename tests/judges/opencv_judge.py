"""What OpenCV makes of a file.
    opencv_judge.py video FILE PICTURE...                      frames, and their mean difference from pictures, of 255
    opencv_judge.py yaml INTRINSICS EXTRINSICS POINTS OUT      of EasyMocap's files: pixels (.npz) of points (.npy)
    opencv_judge.py tables CAMERAS POINTS OUT                  the same of Pose2Sim's tables, as JSON
"""
import json
import sys

import cv2
import numpy

kind, *files = sys.argv[1:]


def pixels_of(points, turn, shift, matrix, distortion, fisheye=False):
    if fisheye:
        places, _ = cv2.fisheye.projectPoints(points[:, None], turn, shift, matrix, distortion[:4])
    else:
        places, _ = cv2.projectPoints(points, turn, shift, matrix, distortion)
    return places[:, 0]


if kind == "video":
    video = cv2.VideoCapture(files[0])
    frames, differences = 0, []
    while True:
        good, image = video.read()
        if not good:
            break
        if frames < len(files) - 1:
            differences.append(numpy.abs(image.astype(float) - cv2.imread(files[1 + frames])).mean())
        frames += 1
    print("frames", frames)
    print("mean", max(differences))
elif kind == "yaml":
    intrinsics, extrinsics = (cv2.FileStorage(file, cv2.FILE_STORAGE_READ) for file in files[:2])
    names = intrinsics.getNode("names")
    found = {}
    for name in (names.at(i).string() for i in range(names.size())):
        matrix, distortion = intrinsics.getNode("K_" + name).mat(), intrinsics.getNode("dist_" + name).mat()
        turn, shift = extrinsics.getNode("R_" + name).mat(), extrinsics.getNode("T_" + name).mat()
        found[name] = pixels_of(numpy.load(files[2]), turn, shift, matrix, distortion)
    numpy.savez(files[3], **found)
else:
    with open(files[0]) as text:
        tables = json.load(text)
    found = {}
    for name, table in tables.items():
        matrix, distortion, turn, shift = (
            numpy.array(table[key]) for key in ("matrix", "distortions", "rotation", "translation")
        )
        found[name] = pixels_of(numpy.load(files[1]), turn, shift, matrix, distortion, table["fisheye"])
    numpy.savez(files[2], **found)
