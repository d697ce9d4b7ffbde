#pragma once

#include <Eigen/Core>
#include <array>

namespace atelier {

/// Rotations as rotation vectors r = t a (angle t in radians about the unit axis a). All formulas
/// use their series near t = 0, so that values and derivatives are smooth there.

/// The matrix of the cross product: cross_matrix(a) b = a x b.
Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& a);

/// R(r), by Rodrigues' formula.
Eigen::Matrix3d rotation_matrix(const Eigen::Vector3d& r);

/// Left Jacobian L(r) of the rotation group: R(r + d) = R(L(r) d) R(r) to first order in d
/// (Chirikjian, "Stochastic Models, Information Theory, and Lie Groups 2", eq. 10.86).
Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& r);

/// The derivatives of R(r) by the three components of r.
std::array<Eigen::Matrix3d, 3> rotation_matrix_jacobian(const Eigen::Vector3d& r);

/// (x, y, z, w) of the unit quaternion (a sin(t/2), cos(t/2)); smooth in r, so w < 0 beyond pi.
Eigen::Vector4d quaternion_of(const Eigen::Vector3d& r);

/// d quaternion_of(r) / d r, [4,3].
Eigen::Matrix<double, 4, 3> quaternion_jacobian(const Eigen::Vector3d& r);

/// The rotation vector with angle in [0, pi] of a rotation matrix; exact at 0 and stable at pi.
Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation);

/// The rotation matrix of a unit quaternion (x, y, z, w).
Eigen::Matrix3d matrix_of_quaternion(const Eigen::Vector4d& quaternion);

/// (x, y, z, w), w >= 0, of a rotation matrix (Shepperd, "Quaternion from rotation matrix", 1978).
Eigen::Vector4d quaternion_of_matrix(const Eigen::Matrix3d& rotation);

/// The shortest rotation that takes direction `from` to direction `to` (need not be unit length,
/// not zero). Opposite directions turn about an axis perpendicular to both.
Eigen::Matrix3d rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// r shifted by multiples of a full turn so that it is nearest to `near`: keeps the curves of a
/// motion continuous.
Eigen::Vector3d nearest_equivalent(const Eigen::Vector3d& r, const Eigen::Vector3d& near);

}  // namespace atelier
