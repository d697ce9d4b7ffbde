#pragma once

#include <vector>

#include "bodymodel/tracking/frame_energy.h"
#include "core/tensor.h"

namespace atelier {

/// How smooth motions are.
struct MotionWeights {
  double acceleration = 20;  ///< m/s2 of a joint, spread, [0.01, 1e6]; smaller: smoother
  double turning = 200;      ///< rad/s2 of a joint's rotation, spread, [0.1, 1e7]
};
OptionTable describe(MotionWeights& weights);

/// Consecutive frames that are solved together.
struct TrackWindow {
  std::vector<const FrameTargets*> targets;  ///< [F]
  std::vector<double> times;                 ///< [F] seconds, increasing
  std::vector<Eigen::VectorXd> start;        ///< [F] variables, see pose_variables
};

struct WindowSolution {
  std::vector<Eigen::VectorXd> x;  ///< [F]
  bool converged = false;
  int iterations = 0;
};

/// Least squares over all frames of a window by Ceres (trust region, sparse Cholesky; variables in
/// blocks by limb, frames evaluated in parallel): every frame's energy, and for three frames in a
/// row the acceleration of joints and rotations.
/// A frame's thousands of residuals go to Ceres as the square root of their normal matrix, which
/// has the same cost, gradient and Gauss-Newton step. At most `iterations`. The same digits on any
/// number of threads. Throws LogicError on sizes that differ or times that do not increase.
WindowSolution solve_window(const FittedPerson& person, const TrackWindow& window,
                            const FrameWeights& weights, const MotionWeights& motion,
                            int iterations);

/// Standard deviations of joints' places, metres, [F,A] in order of FittedPerson::joints: from the
/// normal matrix of the whole window, other frames marginalised. O(F A^3).
RowMatrix joint_deviations(const FittedPerson& person, const TrackWindow& window,
                           const std::vector<Eigen::VectorXd>& x, const FrameWeights& weights,
                           const MotionWeights& motion);

/// The temporal residual of three frames, in standard deviations: accelerations of joints [3A],
/// then of rotations but the root's [3A-3]; and its derivatives by the three frames' variables.
struct Acceleration {
  Eigen::VectorXd residual;
  std::array<Eigen::MatrixXd, 3> jacobian;  ///< empty unless asked for
};
Acceleration acceleration(const FittedPerson& person, const std::array<Eigen::VectorXd, 3>& x,
                          const std::array<double, 3>& times, const MotionWeights& motion,
                          bool derivatives);

}  // namespace atelier
