#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <string>
#include <vector>

#include "core/camera.h"

namespace atelier::fixtures {

/// Cameras "00", "01", ... of 800 x 600 in a ring, with numbers that no short decimal is equal to.
inline std::vector<Camera> few_cameras(int count) {
  std::vector<Camera> cameras(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    Camera& camera = cameras[static_cast<std::size_t>(i)];
    camera.id = "0" + std::to_string(i);
    camera.width = 800;
    camera.height = 600;
    camera.fx = 900 + 1.0 / (3 + i);
    camera.fy = 901 + std::sqrt(2.0 + i);
    camera.cx = 400 + 1.0 / 7;
    camera.cy = 300 - 1.0 / 9;
    camera.distortion_model = Distortion::Brown;
    camera.distortion.fill(0.01 / (3 + i));
    camera.camera_from_world_rotation =
        (Eigen::AngleAxisd(std::sqrt(3.0) + i, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(std::sqrt(0.1), Eigen::Vector3d::UnitX()))
            .toRotationMatrix();
    camera.camera_from_world_translation = Eigen::Vector3d(0.1 / 3, std::sqrt(0.5), 2 + 0.1 * i);
    camera.gain = Eigen::Vector3d(0.9, 1, 1.1 + 0.01 * i);
  }
  return cameras;
}

}  // namespace atelier::fixtures
