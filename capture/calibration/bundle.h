#pragma once

#include <array>
#include <vector>

#include "capture/calibration/find_board.h"
#include "capture/calibration/lens.h"
#include "core/types.h"

namespace atelier {

/// Which of the twelve numbers of a lens are found; the others keep their values.
using LensMask = std::array<bool, 12>;

/// Cameras, boards and what the cameras saw of them: the unknowns of a bundle adjustment and their
/// measurements.
struct Bundle {
  /// One camera of it.
  struct Eye {
    Distortion model = Distortion::Brown;
    LensNumbers lens = LensNumbers::Zero();
    LensMask free{};  ///< of the lens
    RigidNumbers camera_from_world = RigidNumbers::Zero();
    bool fixed_pose = false;  ///< one camera at least: it is the world
    double centre_prior = 0;  ///< px: weak pull of cx, cy to `centre`; 0: none
    Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  };
  std::vector<Eye> eyes;
  std::vector<RigidNumbers> world_from_board;
  bool fixed_boards = false;  ///< boards stay where they are, and no camera's pose need be fixed
  struct Sight {
    int eye = 0;
    int board = 0;
    int point = 0;          ///< row of `points`
    Eigen::Vector2d pixel;  ///< as core/camera.h counts
  };
  std::vector<Sight> sights;
  BoardPoints points;  ///< board_points
};

struct BundleOptions {
  double loss = 1;       ///< px beyond which an error counts less and less (Cauchy); 0: squares
  int iterations = 100;  ///< of Levenberg and Marquardt
};

struct BundleSolution {
  Bundle bundle;
  bool converged = false;
  int iterations = 0;
};

/// Least reprojection error over lenses, poses and boards (Ceres; Triggs 2000), one thread, with
/// analytic derivatives. Throws LogicError for indices out of range and where no pose is fixed.
BundleSolution solve_bundle(const Bundle& bundle, const BundleOptions& options = {});

/// Pixel errors of every sight, [N,2]: projection less measurement; NaN behind a camera.
Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor> reprojection_errors(const Bundle& bundle);

/// Standard deviations of what was found, to first order at the solution (inverse of the normal
/// matrix, robust weights included), for measurements with a deviation of `sigma` px in x and y.
struct BundleDeviations {
  bool full_rank = false;  ///< false: the measurements leave something open; the rest is zero
  std::vector<LensNumbers> lens;                             ///< of each eye
  std::vector<Eigen::Matrix<double, 6, 6>> pose_covariance;  ///< of camera_from_world's numbers
};
BundleDeviations bundle_deviations(const Bundle& bundle, double sigma,
                                   const BundleOptions& options = {});

/// The residual and derivatives that the solver is given, of one sight: for tests.
struct SightJacobian {
  Eigen::Vector2d error;
  Eigen::Matrix<double, 2, 12> by_lens;
  Eigen::Matrix<double, 2, 6> by_camera;
  Eigen::Matrix<double, 2, 6> by_board;
};
SightJacobian sight_jacobian(const Bundle& bundle, const Bundle::Sight& sight);

}  // namespace atelier
