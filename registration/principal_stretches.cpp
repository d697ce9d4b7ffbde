#include "registration/principal_stretches.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace atelier {

Eigen::Vector2d principal_stretches(const Eigen::Matrix<double, 3, 2>& deformation) {
  const double squares = deformation.squaredNorm();
  const Eigen::Vector3d across = deformation.col(0).cross(deformation.col(1));
  const double area = across.norm();
  const double larger =
      (std::sqrt(squares + 2 * area) + std::sqrt(std::max(0.0, squares - 2 * area))) / 2;
  // As a quotient: the difference of the two roots would lose a thin triangle's digits.
  return {larger, larger > 0 ? area / larger : 0};
}

}  // namespace atelier
