#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "capture/calibration/bundle.h"
#include "capture/calibration/calibrate.h"
#include "capture/calibration/chain_poses.h"
#include "capture/calibration/single_lens.h"

namespace atelier {

/// One round of bundle adjustment and what its residuals are.
struct AdjustmentRound {
  Bundle bundle;
  std::map<int, int> board_of_frame;
  std::vector<double> errors;  ///< of each sight, px
  bool converged = false;
};

/// Unknowns of bundle adjustment beside the cameras.
struct RigAdjustment {
  std::vector<LensModel> models;  ///< of each camera
  PoseChain chain;
  std::size_t fixed = 0;                   ///< the camera whose frame is the world
  std::set<std::pair<int, int>> left_out;  ///< views: camera, frame
  double allowed = 0;                      ///< px rms beyond which a view is left out
  double loss = 0;                         ///< px, width of the loss
  AdjustmentRound round;                   ///< the last one
};

/// Rounds of bundle adjustment until lenses, loss and the views left out stay what they are.
void adjust_until_settled(const std::vector<RigCamera>& rig, const std::vector<PosedView>& posed,
                          const BoardOptions& board, const CalibrateOptions& options,
                          RigAdjustment& state, Calibration& result);

/// Pixel error of every view of the rig under its present poses, by camera and frame.
std::map<std::pair<int, int>, double> errors_of_views(const std::vector<Camera>& cameras,
                                                      const PoseChain& chain,
                                                      const std::vector<PosedView>& posed,
                                                      const BoardPoints& points);

/// The camera with the pose that the chain gives it.
Camera posed_camera(Camera camera, const PoseChain& chain, std::size_t c);

}  // namespace atelier
