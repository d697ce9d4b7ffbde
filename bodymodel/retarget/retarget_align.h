#pragma once

#include <array>
#include <vector>

#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/motion_clip.h"

namespace atelier {

/// How one joint of the target follows the source: its world rotation is that of the source joints'
/// turn away from the reference (interpolated between two of them), times `aligned`.
struct Follow {
  int a = -1;        ///< joint of the source; -1: the joint keeps its rest rotation
  int b = -1;        ///< another joint of the source
  double share = 0;  ///< 0: follows a; 1: follows b
};

/// Which source joints each target joint follows, [J of the target].
std::vector<Follow> correspondence(const Skeleton& source, const Humanoid& source_person,
                                   const Skeleton& target, const Humanoid& target_person);

/// -1, the clip's own rest pose, if that is a T-, A- or I-pose (limbs within 0.6 rad of the
/// target's rest pose on average); else the frame of the clip whose limbs are nearest.
int reference_frame(const MotionClip& clip, const Humanoid& source_person, const Skeleton& target,
                    const Humanoid& target_person);

/// Where a source stands for the alignment. Feet and neck have frames of their own: those in which
/// soles are flat on the ground, and one in which the head is not turned away from the chest.
struct AlignmentReference {
  JointFrames frames;
  std::array<JointFrames, 2> feet;  ///< left, right
  JointFrames neck;                 ///< neck and head
};

/// The reference at a pose that stands on its soles (a rest pose, a T-pose).
AlignmentReference standing_reference(const Skeleton& source, const Pose& pose);

/// The reference at a frame of the clip; each foot's is the frame in which its ankle is lowest, the
/// neck's the clip's rest pose where trunk and legs stand upright in it.
AlignmentReference moving_reference(const MotionClip& clip, const Humanoid& person, int frame);

/// World rotations of the target's joints when it stands as the source does at the reference, [J].
/// Feet are turned about the vertical alone, so that soles that are flat stay flat.
std::vector<Eigen::Matrix3d> aligned_rotations(const AlignmentReference& reference,
                                               const Humanoid& source_person,
                                               const Skeleton& target,
                                               const Humanoid& target_person);

/// Axes of the trunk at the hips and at the shoulders: columns are left, up, front.
Eigen::Matrix3d pelvis_axes(const Points& joints, const Humanoid& person);
Eigen::Matrix3d chest_axes(const Points& joints, const Humanoid& person);

}  // namespace atelier
