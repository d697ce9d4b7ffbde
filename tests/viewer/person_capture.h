#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>

#include "tests/capture/small_capture.h"

namespace atelier::fixtures {

/// A capture whose detections are those of a person who turns, seen by every camera.
inline SmallCapture person_capture() {
  SmallCapture capture;
  capture.cameras =
      dome_cameras({.cameras = 8, .pairs = false, .width = 320, .height = 400, .gain = 0}, {1, 1});
  capture.frames = {0, 1, 2, 3};
  return capture;
}

/// Writes it, with the detections of the person.
inline void write_person(const std::filesystem::path& folder, const SmallCapture& capture) {
  write_small_capture(folder, capture);
  for (const Camera& camera : capture.cameras) {
    for (const int frame : capture.frames) {
      Keypoints2d points = Keypoints2d::Zero(25, 3);
      const Keypoints2d flat = small_people(0).front().points;
      for (Index k = 0; k < 24; ++k) {
        // The flat person of the small capture, 1.7 m tall, with some depth.
        const Eigen::Vector3d place(0.03 * (flat(k, 0) - 10.25),
                                    1.65 - 0.03 * (flat(k, 1) - 20.125),
                                    0.06 * std::sin(static_cast<double>(k)));
        const auto pixel =
            project(camera, Eigen::AngleAxisd(0.3 * frame, Eigen::Vector3d::UnitY()) * place);
        if (pixel) {
          points.row(k) << pixel->x(), pixel->y(), 0.9;
        }
      }
      write_file_atomically(folder / "keypoints2d" / camera.id / (frame_name(frame) + ".json"),
                            openpose_json({{0, points}}));
    }
  }
}

}  // namespace atelier::fixtures
