#pragma once

#include <vector>

#include "capture/calibration/calibrate.h"
#include "capture/dataset.h"
#include "core/options.h"

namespace atelier {

struct KeypointRigOptions {
  double stature = 0;           ///< m, of the person: it sets the scale, [0.5, 2.5]; 0: not said
  double min_confidence = 0.3;  ///< of a detection that is used, [0, 1]
  int max_frames = 400;         ///< spread evenly over the capture, 10 to 100000
};
OptionTable describe(KeypointRigOptions& options);

/// Poses of cameras with known lenses from the 2D keypoints of one person in a capture
/// (rig_from_points): for recordings without a board that several cameras saw at once. In each
/// image the person with the most confident points counts.
///
/// Scale: thigh, shank, upper arm and forearm (medians over the frames) are together 0.823 of the
/// stature on a side (Drillis and Contini 1966, in Winter, "Biomechanics and motor control of human
/// movement", 2009, 4.1); statures scatter by some 3% about that. Up is the mean direction from the
/// ankles to the shoulders, the origin under the mean of the hips, the ground at the height that a
/// twentieth of the feet's points are below (our choice).
///
/// @param rig  cameras of the capture, in its order, lenses known
/// Findings: "calibration-unconnected", "-converged", "-residual" of `calibrate`. Throws DataError
/// where the capture has no keypoints, or no two cameras can be posed by them; LogicError for
/// another number of cameras or no stature.
Calibration calibrate_by_keypoints(const std::vector<RigCamera>& rig, const Dataset& capture,
                                   const KeypointRigOptions& options);

}  // namespace atelier
