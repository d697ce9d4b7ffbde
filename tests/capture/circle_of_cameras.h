#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <string>
#include <vector>

#include "core/camera.h"

namespace atelier::fixtures {

/// Cameras in a circle, two heights in turn, that look at the middle of a person. The first stands
/// on the z axis.
struct CircleOfCameras {
  int count = 8;
  int width = 800;  ///< px
  int height = 1000;
  double focal = 1250;  ///< px
  double radius = 3;    ///< m
  double low = 0.7;     ///< m
  double high = 1.9;
};

inline std::vector<Camera> circle_of_cameras(const CircleOfCameras& circle = {}) {
  std::vector<Camera> cameras;
  for (int i = 0; i < circle.count; ++i) {
    const double azimuth = 6.283185307 * i / circle.count;
    const Eigen::Vector3d centre(circle.radius * std::sin(azimuth),
                                 i % 2 == 0 ? circle.low : circle.high,
                                 circle.radius * std::cos(azimuth));
    Camera camera;
    camera.id = "cam" + std::to_string(i);
    camera.width = circle.width;
    camera.height = circle.height;
    camera.fx = camera.fy = circle.focal;
    camera.cx = 0.5 * circle.width;
    camera.cy = 0.5 * circle.height;
    const Eigen::Vector3d z = (Eigen::Vector3d(0, 1, 0) - centre).normalized();
    const Eigen::Vector3d x = Eigen::Vector3d(0, -1, 0).cross(z).normalized();
    camera.camera_from_world_rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
    camera.camera_from_world_translation = -camera.camera_from_world_rotation * centre;
    cameras.push_back(camera);
  }
  return cameras;
}

}  // namespace atelier::fixtures
