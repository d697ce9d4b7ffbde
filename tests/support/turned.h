#pragma once

#include <Eigen/Geometry>
#include <numbers>

#include "core/mesh.h"

namespace atelier::fixtures {

/// A mesh turned about the Y axis.
inline Mesh turned(Mesh mesh, double degrees) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Eigen::Vector3d::UnitY())
          .toRotationMatrix();
  mesh.vertices = mesh.vertices * turn.transpose();
  return mesh;
}

}  // namespace atelier::fixtures
