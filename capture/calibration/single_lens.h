#pragma once

#include <map>
#include <string>
#include <vector>

#include "capture/calibration/bundle.h"
#include "capture/calibration/calibrate.h"

namespace atelier {

/// One model of a lens: which of its numbers are found.
struct LensModel {
  LensChoice choice = LensChoice::None;
  const char* name = "";
  Distortion distortion = Distortion::None;
  LensMask free{};
};

/// Every model but Auto, the simpler first.
const std::vector<LensModel>& lens_models();
const LensModel& lens_model(LensChoice choice);

/// The lens of one camera from its own views.
struct SingleLens {
  bool found = false;
  std::string why_not;  ///< one clause
  Camera camera;        ///< with the lens
  LensModel model;
  double rms = 0;                            ///< px
  double focal_deviation = 0;                ///< relative standard deviation of fx
  std::map<std::string, double> candidates;  ///< information criterion of each model tried
};

/// Focal length from the homographies of all views (Zhang 2000; principal point in the middle),
/// then each model by bundle adjustment over this camera's boards alone, starting from the simpler
/// one before it. @param views  of this camera alone
SingleLens single_lens(const Camera& camera, const std::vector<BoardView>& views,
                       const BoardOptions& board, const CalibrateOptions& options);

/// The model that all of a camera's views speak for, boards given (where the whole rig puts them):
/// lens and pose of this camera alone are found with each. `start` has lens and pose.
SingleLens lens_given_boards(const Camera& start, const LensModel& model,
                             const std::vector<BoardView>& views,
                             const std::map<int, RigidNumbers>& world_from_board,
                             const BoardOptions& board, double loss);

}  // namespace atelier
