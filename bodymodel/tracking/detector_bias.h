#pragma once

#include <vector>

#include "bodymodel/tracking/frame_energy.h"

namespace atelier {

/// Frames from which on what keypoints are off by alike can be told from their noise.
inline constexpr int kBiasFrames = 3;

/// m, what it is taken for where there are fewer: detectors put joints about so far off, the same
/// way in every frame (a real trial, docs/results/tracking.md).
inline constexpr double kDetectorBias = 0.02;

/// [J] m, by how much the keypoints of a joint are off its pose alike in all frames, seen from the
/// joint: no number of frames averages it away, so that without a scan it is part of what a pose is
/// off by. Noise that was averaged is taken from it. Joints without keypoints that kBiasFrames
/// frames show have the rms of the others, and all have kDetectorBias where none has. Our
/// choice. `frames` [F] with their keypoints, `x` [F] their poses. Throws LogicError on sizes that
/// do not agree. O(F (K + J)).
Eigen::VectorXd detector_bias(const FittedPerson& person, const std::vector<FrameTargets>& frames,
                              const std::vector<Eigen::VectorXd>& x);

}  // namespace atelier
