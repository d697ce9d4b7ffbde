#pragma once

#include <optional>
#include <vector>

#include "bodymodel/tracking/solve_window.h"

namespace atelier {

/// A pose from keypoints of one frame alone, in closed form, from any pose: the trunk by the rigid
/// motion that brings hips, shoulders and neck to theirs (Kabsch 1976), then every limb bone by the
/// shortest swing, and the turn about it by which the next joint bends the way knees and elbows do.
/// Nothing unless three points of the trunk that are not in line were seen. Throws LogicError on
/// sizes that do not agree. O(K + J).
std::optional<Eigen::VectorXd> closed_form_pose(const FittedPerson& person,
                                                const FrameTargets& targets);

/// How a frame's keypoints were read.
enum class SideReading { AsNamed, Mirrored, LegsMirrored, ArmsMirrored };

/// m, from where a frame's pose has its keypoints: further off they say that it is wrong.
inline constexpr double kUntrustedError = 0.06;

/// Where a frame's search begins.
struct StartPose {
  Eigen::VectorXd x;
  FrameTargets targets;  ///< with left and right exchanged where they were mixed up
  SideReading reading = SideReading::AsNamed;
  double error = 0;      ///< m, median distance of the keypoints seen
  bool trusted = false;  ///< enough was seen and it agrees; else x is that of the frames around
};

/// Starts of all frames of a sequence. Every frame is posed by its keypoints (closed form, then
/// least squares within joint limits). Where that fits badly, detectors may have mixed up left and
/// right, or taken the back for the front: the frame is posed for each reading of its names, and
/// the readings of neighbouring frames are chosen together so that the fit is good and no joint
/// jumps (Viterbi). Frames of which too little was seen, or that fit no reading, take a pose
/// between those of their neighbours, lose their keypoints, and are not trusted; all frames at rest
/// at the origin if no frame is trusted. Frames are independent of each other's thread.
std::vector<StartPose> start_poses(const FittedPerson& person,
                                   const std::vector<FrameTargets>& frames,
                                   const std::vector<double>& times, const FrameWeights& weights);

}  // namespace atelier
