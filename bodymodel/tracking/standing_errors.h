#pragma once

#include <vector>

#include "bodymodel/tracking/frame_energy.h"

namespace atelier {

/// Frames from which on what keypoints are off by alike can be told from their noise.
inline constexpr int kStandingFrames = 3;

/// m, what it is taken for where there are fewer: detectors put joints about so far off, the same
/// way in every frame (a real trial, docs/results/tracking.md).
inline constexpr double kUsualStandingError = 0.02;

/// [J] m, by how much the keypoints of a joint are off its pose alike in all frames, seen from the
/// joint: no number of frames averages it away, so that without a scan it is part of what a pose is
/// off by. Noise that was averaged is taken from it. Joints without keypoints that kStandingFrames
/// frames show have the rms of the others, and all have kUsualStandingError where none has. Our
/// choice. `frames` [F] with their keypoints, `x` [F] their poses. Throws LogicError on sizes that
/// do not agree. O(F (K + J)).
Eigen::VectorXd standing_errors(const FittedPerson& person, const std::vector<FrameTargets>& frames,
                                const std::vector<Eigen::VectorXd>& x);

}  // namespace atelier
