#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "capture/camera_conventions.h"
#include "capture/camera_readings.h"
#include "core/camera.h"

namespace atelier::fixtures {

/// The camera of which a reading makes the given one.
inline Camera misread(const Camera& camera, const WorldConvention& world,
                      const std::string& value) {
  Camera in_file = in_file_world(camera, world);
  Eigen::Matrix3d& rotation = in_file.camera_from_world_rotation;
  Eigen::Vector3d& translation = in_file.camera_from_world_translation;
  if (value == "position") {
    translation = (-rotation.transpose() * translation).eval();
  } else if (value == "inverse_opengl") {
    in_file = read_as(read_as(in_file, "extrinsics", "opengl"), "extrinsics", "inverse");
  } else if (!value.empty()) {
    in_file = read_as(in_file, "extrinsics", value);  // undoes itself
  }
  return in_our_world(in_file, world);
}

/// Values of --capture.extrinsics; "": as read.
inline constexpr std::array kExtrinsicValues = {"",         "inverse", "transposed",
                                                "position", "opengl",  "inverse_opengl"};

/// Whether cameras are those of a rig but for a rigid motion and the size of the world.
inline bool same_rig(const std::vector<Camera>& a, const std::vector<Camera>& b) {
  if (a.size() != b.size()) {
    return false;
  }
  const Eigen::Matrix3d turn =
      a[0].camera_from_world_rotation.transpose() * b[0].camera_from_world_rotation;
  const auto extent = [](const std::vector<Camera>& cameras) {
    double most = 0;
    for (const Camera& camera : cameras) {
      most = std::max(most, (camera_center(camera) - camera_center(cameras[0])).norm());
    }
    return most;
  };
  const double scale = extent(b) / extent(a);
  for (std::size_t c = 0; c < a.size(); ++c) {
    const Eigen::Vector3d from_a = scale * (camera_center(a[c]) - camera_center(a[0]));
    const Eigen::Vector3d from_b = turn * (camera_center(b[c]) - camera_center(b[0]));
    if ((from_a - from_b).norm() > 1e-3 * scale * extent(a) ||
        (a[c].camera_from_world_rotation * turn - b[c].camera_from_world_rotation).norm() > 1e-3) {
      return false;
    }
  }
  return true;
}

}  // namespace atelier::fixtures
