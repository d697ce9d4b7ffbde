#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "capture/dataset.h"
#include "core/camera.h"
#include "core/finding.h"

namespace atelier {

/// A camera in OpenCV's terms, which most layouts share: x right, y down, z forward, the first
/// pixel's centre at (0, 0), world in the layout's own unit and axes.
struct OpencvCamera {
  std::string id;
  int width = 0;  ///< pixels; 0: the layout does not say
  int height = 0;
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();  ///< K
  std::vector<double>
      distortion;  ///< k1 k2 p1 p2 k3 k4 k5 k6, or a beginning of it; fisheye: k1..k4
  bool fisheye = false;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< camera from world
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();   ///< camera from world
};

/// Ours, still in the layout's world. Of 12 or 14 coefficients those of the thin prism and of the
/// tilted sensor must be 0, of a fisheye those beyond the fourth. Throws DataError (`file`, camera)
/// for a K that is no matrix of focal lengths and principal point (skew beyond 1e-6 of the focal
/// length, another last row) and for a number of coefficients that OpenCV does not have.
Camera camera_of(const OpencvCamera& camera, const std::string& file);

/// The warning of a camera that is left out of a capture because `why`: "it has no pose".
Finding camera_left_out(const std::string& id, const std::string& why);

/// DataError (`file`, camera) for a number that is not finite, as computing with hostile ones
/// gives.
void check_numbers(const Camera& camera, const std::string& file);

/// A camera of ours in OpenCV's terms. `distortion` has 0 (none), 5 or 8 (brown), or 4 numbers.
OpencvCamera opencv_of(const Camera& camera);

/// One sentence on a lens that a layout has no place for, with the largest distance in pixels
/// between its image and that of the same rays through a pinhole (over a grid of 33 by 33; our
/// choice).
std::string lens_left_out(const Camera& camera);

/// k1, k2, ... of a camera without a fisheye, where the layout's lens is a polynomial of `count`
/// coefficients (3 or more): its own, or those that come nearest to a rational lens over its image,
/// and a sentence of how near.
std::vector<double> polynomial_radial(const Camera& camera, int count,
                                      std::vector<std::string>& lost);

/// The five numbers k1 k2 p1 p2 k3 that most layouts hold, and one sentence for what they leave
/// out.
std::array<double, 5> five_distortion(const Camera& camera, std::vector<std::string>& lost);

/// Rotation vector (axis times angle, radians) and back; of one that is not finite NaN.
Eigen::Matrix3d rotation_of_vector(const Eigen::Vector3d& vector);
Eigen::Vector3d vector_of_rotation(const Eigen::Matrix3d& rotation);

/// Rotation that takes a world whose `up` ("x", "-z", ...) points up to ours. Throws LogicError for
/// another name.
Eigen::Matrix3d y_up_from(const std::string& up);

/// A point of the layout's world in ours (metres, Y up), and cameras from one world to the other.
Camera in_our_world(Camera camera, const WorldConvention& world);
Camera in_file_world(Camera camera, const WorldConvention& world);

/// The camera of images that were turned clockwise by quarter turns after they were calibrated: the
/// same rays through other pixels. Any number of turns; negative: the other way.
Camera turned_camera(const Camera& camera, int quarters);

/// The same camera for images of another size: everything in pixels times the factor, which is
/// exact where the first pixel's centre is at (0.5, 0.5).
Camera scaled_camera(Camera camera, int width, int height);

}  // namespace atelier
