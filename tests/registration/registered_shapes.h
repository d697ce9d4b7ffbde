#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "core/mesh.h"
#include "core/topology.h"
#include "registration/tracking/photometric.h"
#include "tests/support/shapes.h"

namespace atelier::fixtures {

/// An open tube of cloth around the Y axis: radius 0.15 m, y in [0.8, 1.3].
inline Mesh cloth_tube(int around, int along) {
  Mesh mesh = tube(around, along, 1);
  mesh.vertices.col(0) *= 0.15;
  mesh.vertices.col(2) *= 0.15;
  mesh.vertices.col(1) = 0.5 * mesh.vertices.col(1).array() + 0.8;
  return mesh;
}

/// One more triangle at the tube's lower rim, of three around a vertex, two of which are turned
/// over: what smoothing left at the hem of a dress.
inline Mesh with_fold_at_rim(Mesh tube) {
  const std::vector<int> rim =
      boundary_loops(topology_of(tube.faces, tube.vertices.rows())).front();
  const int from = rim[1];
  const int to = rim[0];
  const Eigen::RowVector3d middle = 0.5 * (tube.vertices.row(from) + tube.vertices.row(to));
  const auto tip = static_cast<int>(tube.vertices.rows());
  tube.vertices.conservativeResize(tip + 2, 3);
  tube.vertices.row(tip) = middle + Eigen::RowVector3d(0, -0.001, 0);
  tube.vertices.row(tip + 1) = middle + Eigen::RowVector3d(0, -0.003, 0);
  const Index faces = tube.faces.rows();
  tube.faces.conservativeResize(faces + 3, 3);
  tube.faces.bottomRows(3) << from, to, tip + 1, to, tip, tip + 1, tip, from, tip + 1;
  return tube;
}

/// A camera of `size` pixels square that looks at `target` from `eye`, the world's Y up.
inline Camera looking_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target, int size) {
  Camera camera;
  camera.width = camera.height = size;
  camera.fx = camera.fy = 1.5 * size;
  camera.cx = camera.cy = 0.5 * size;
  const Eigen::Vector3d forward = (target - eye).normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitY()).normalized();
  camera.camera_from_world_rotation.row(0) = right.transpose();
  camera.camera_from_world_rotation.row(1) = forward.cross(right).transpose();
  camera.camera_from_world_rotation.row(2) = forward.transpose();
  camera.camera_from_world_translation = -camera.camera_from_world_rotation * eye;
  return camera;
}

/// What a camera sees of the infinite cylinder around the Y axis whose light at angle and height
/// `shade` gives; black beside it.
inline Image picture_of_cylinder(const Camera& camera, double radius,
                                 const std::function<double(double angle, double y)>& shade) {
  Image image(camera.width, camera.height, 1);
  const Eigen::Vector3d eye = camera_center(camera);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      double sum = 0;
      for (int s = 0; s < 4; ++s) {
        const Eigen::Vector3d d =
            ray_direction(camera, {x + 0.25 + 0.5 * (s % 2), y + 0.25 + 0.5 * (s / 2)}).value();
        const double a = d.x() * d.x() + d.z() * d.z();
        const double b = eye.x() * d.x() + eye.z() * d.z();
        const double c = eye.x() * eye.x() + eye.z() * eye.z() - radius * radius;
        if (b * b > a * c) {
          const Eigen::Vector3d p = eye + (-b - std::sqrt(b * b - a * c)) / a * d;
          sum += shade(std::atan2(-p.z(), p.x()), p.y());
        }
      }
      image.at(x, y) = static_cast<float>(sum / 4);
    }
  }
  return image;
}

/// Blotches of 3 to 8 cm, no two places alike.
inline double blotches(double angle, double y) {
  const double u = 0.15 * angle;
  return 0.4 + 0.1 * (std::sin(110 * u + 3 * std::sin(61 * y)) +
                      std::sin(140 * y + 2 * std::cos(45 * u)) + std::sin(90 * u - 75 * y));
}

/// Turned about the Y axis by an angle and lifted.
inline Points screwed(const Points& points, double angle, double lift) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
  return (points * turn.transpose()).rowwise() + Eigen::RowVector3d(0, lift, 0);
}

/// Four cameras round the cylinder, 1.2 m away, and what they see of its blotches.
inline std::vector<ViewPyramid> cylinder_views(int levels,
                                               const std::function<double(double, double)>& shade) {
  std::vector<ViewPyramid> views;
  for (int i = 0; i < 4; ++i) {
    const double angle = std::numbers::pi / 2 * i + 0.3;
    PhotoView view;
    view.camera =
        looking_at({1.2 * std::cos(angle), 1.2, -1.2 * std::sin(angle)}, {0, 1.05, 0}, 160);
    view.image = picture_of_cylinder(view.camera, 0.15, shade);
    views.push_back(view_pyramid(view, levels));
  }
  return views;
}

}  // namespace atelier::fixtures
