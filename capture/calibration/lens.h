#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "core/camera.h"

namespace atelier {

/// The numbers that a calibration of one lens finds: fx fy cx cy, then the distortion in the order
/// of Camera::distortion. Pixels, and the rest without unit.
using LensNumbers = Eigen::Matrix<double, 12, 1>;

/// A rigid motion as six numbers: rotation vector (rad), then translation (m).
using RigidNumbers = Eigen::Matrix<double, 6, 1>;

LensNumbers lens_of(const Camera& camera);
Camera with_lens(Camera camera, Distortion model, const LensNumbers& lens);
RigidNumbers rigid_of(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation);
Eigen::Matrix3d rotation_of(const RigidNumbers& rigid);

/// a_from_b times b_from_c, and the inverse.
RigidNumbers chained(const RigidNumbers& a_from_b, const RigidNumbers& b_from_c);
RigidNumbers inverse_of(const RigidNumbers& a_from_b);

/// The point moved: rotation times point plus translation.
Eigen::Vector3d moved(const RigidNumbers& a_from_b, const Eigen::Vector3d& point_in_b);

/// Derivative of `moved` with respect to the six numbers: -R [x] J_r(r) of the rotation vector
/// (Gallego and Yezzi 2015, "A compact formula for the derivative of a 3-D rotation in exponential
/// coordinates"), identity of the translation.
Eigen::Matrix<double, 3, 6> moved_jacobian(const RigidNumbers& a_from_b,
                                           const Eigen::Vector3d& point_in_b);

/// Standard deviations of a camera's centre along the world's axes from the covariance of the six
/// numbers of its pose, to first order, in the pose's unit of length.
Eigen::Vector3d centre_deviation(const RigidNumbers& camera_from_world,
                                 const Eigen::Matrix<double, 6, 6>& covariance);

/// Pixel of a point in the camera's frame by the models of core/camera.h; nothing behind the
/// camera. Beyond a fold of the lens it goes on smoothly, so that an optimiser can come back.
std::optional<Eigen::Vector2d> lens_pixel(Distortion model, const LensNumbers& lens,
                                          const Eigen::Vector3d& point_in_camera);

/// Its derivatives with respect to the point and to the lens.
struct LensJacobian {
  Eigen::Matrix<double, 2, 3> by_point;
  Eigen::Matrix<double, 2, 12> by_lens;
};
LensJacobian lens_jacobian(Distortion model, const LensNumbers& lens,
                           const Eigen::Vector3d& point_in_camera);

/// True if every pixel of the image has one ray: the distortion is inverted on a grid that
/// reaches its corners.
bool is_invertible(const Camera& camera);

}  // namespace atelier
