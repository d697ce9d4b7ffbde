#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>

namespace atelier {

/// How a ray's direction is bent before the intrinsics apply.
enum class Distortion {
  None,
  Brown,    ///< OpenCV's rational model: k1 k2 p1 p2 k3 k4 k5 k6 in `distortion[0..7]`
  Fisheye,  ///< OpenCV's fisheye (Kannala-Brandt): k1 k2 k3 k4 in `distortion[0..3]`
};

/// One calibrated camera: x right, y down, z forward; pixels, the first pixel's centre at
/// (0.5, 0.5); metres. Formats with other conventions are converted by their adapters.
struct Camera {
  std::string id;
  int width = 0;          ///< pixels
  int height = 0;         ///< pixels
  double fx = 0, fy = 0;  ///< focal lengths, pixels
  double cx = 0, cy = 0;  ///< principal point, pixels
  Distortion distortion_model = Distortion::None;
  std::array<double, 8> distortion{};
  Eigen::Matrix3d camera_from_world_rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d camera_from_world_translation = Eigen::Vector3d::Zero();  ///< metres
  Eigen::Vector3d gain = Eigen::Vector3d::Ones();  ///< per-channel factor on linear RGB
};

/// Where the camera stands, metres in the world.
Eigen::Vector3d camera_center(const Camera& camera);

/// World point to camera frame.
Eigen::Vector3d camera_from_world(const Camera& camera, const Eigen::Vector3d& point_in_world);

/// Pixel of a world point; nothing if it lies behind the camera or where the distortion has
/// folded over.
std::optional<Eigen::Vector2d> project(const Camera& camera, const Eigen::Vector3d& point_in_world);

/// Derivative of the pixel with respect to the world point, [2,3].
std::optional<Eigen::Matrix<double, 2, 3>> project_jacobian(const Camera& camera,
                                                            const Eigen::Vector3d& point_in_world);

/// Unit direction, in the world, of the ray through a pixel; inverts the distortion by Newton
/// iteration. Nothing where the distortion cannot be inverted.
std::optional<Eigen::Vector3d> ray_direction(const Camera& camera, const Eigen::Vector2d& pixel);

/// Throws DataError unless sizes are positive, focal lengths above 0 and up to 1e8 px, the
/// principal point within 1e8 px, every number finite and the rotation orthonormal with determinant
/// 1 to 1e-6.
void check_camera(const Camera& camera, const std::string& file = "");

}  // namespace atelier
