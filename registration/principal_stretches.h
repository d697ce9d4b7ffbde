#pragma once

#include <Eigen/Core>

namespace atelier {

/// Singular values of a triangle's deformation, the larger first: lengths of the half axes of the
/// ellipse that a unit circle becomes. In closed form: (s1 +- s2)^2 = |F|^2 +- 2 area factor.
/// @param deformation  [3,2] the flat triangle's two directions, in space
Eigen::Vector2d principal_stretches(const Eigen::Matrix<double, 3, 2>& deformation);

}  // namespace atelier
