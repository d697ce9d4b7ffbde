#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/camera.h"

namespace atelier {

/// A point in one camera's image. Sights with the same number are of one place in space, such as a
/// joint of a person in one frame.
struct PointSight {
  int camera_idx = 0;
  int point = 0;          ///< from 0
  Eigen::Vector2d pixel;  ///< as core/camera.h counts
};

struct PointRigOptions {
  double tolerance = 10;  ///< px of an image 1000 rows high that a sight may be off, (0, 100]
  int min_shared = 30;    ///< points that a camera must share with others, 8 to 100000
};

/// Cameras that were posed by points.
struct PointRig {
  std::vector<Camera> cameras;  ///< lenses as given; a pose only where in_rig
  std::vector<bool> in_rig;
  std::vector<int> shared;              ///< [C] points in the rig that each camera sees
  std::vector<Eigen::Vector3d> points;  ///< [P]; NaN: fewer than two cameras agree on it
  std::vector<double> errors;           ///< px of each sight; NaN: it is not used
  /// Of camera_from_world's rotation vector and translation, to first order, for the unit of length
  /// below; zero of the camera that is the world.
  std::vector<Eigen::Matrix<double, 6, 6>> pose_covariance;
  double sigma = 0;  ///< px, deviation of one coordinate that the errors speak for
  bool converged = false;
};

/// Poses of cameras with known lenses from points that several of them see at once: what is left
/// open is one length. The two cameras with the widest agreement are posed by their essential
/// matrix (Nister 2004, in RANSAC, OpenCV), the others one by one by the points that are known
/// (SQPnP, Terzakis and Lourakis 2020, in RANSAC), then poses and points are adjusted together
/// (Ceres, Cauchy's loss), and sights that are far off are left out. World: that of one camera of
/// the rig; the first two cameras of it are one apart.
///
/// Cameras are not in the rig where too few points are shared, or rays of all pairs are nearly
/// parallel (less than 3 degrees). No rig at all: `in_rig` is false throughout. Throws LogicError
/// for sights of cameras that are not there.
PointRig rig_from_points(const std::vector<Camera>& cameras, const std::vector<PointSight>& sights,
                         const PointRigOptions& options = {});

}  // namespace atelier
