#pragma once

#include <Eigen/Core>

namespace atelier {

/// z of the cross product of two vectors of the plane: twice the signed area that they span,
/// positive where b lies counter-clockwise of a.
inline double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

}  // namespace atelier
