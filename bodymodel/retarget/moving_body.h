#pragma once

#include <vector>

#include "bodymodel/body_model.h"
#include "bodymodel/skinning.h"
#include "core/pose.h"

namespace atelier {

/// A body that cloth is simulated on: first it stands where the cloth was put on, then it goes over
/// to where it takes a run at the motion, slowly enough that nothing is thrown, then it follows the
/// motion.
struct MovingBody {
  BodyModel model;
  ShapedBody shaped;
  Motion motion;
  /// [F] of [V,3] m: how far each frame's own surface is off the skinned one, or empty. Between
  /// frames, between theirs.
  std::vector<Points> offsets;

  /// Before the motion; all 0 where cloth begins in the motion's first frame.
  Pose dressed;           ///< in which the cloth was put on
  Points dressed_offset;  ///< [V,3] m off the skinned body there, or no rows; fades while it stands
  double settle = 0;      ///< s in that pose
  double transition = 0;  ///< s on the way to where the run begins
  double run_up = 0;      ///< s in which it gains the motion's first speed
};

/// Seconds before the motion begins.
double lead_seconds(const MovingBody& body);

/// The pose and the surface, [V,3] m, at a time since the cloth was put on.
Pose pose_at(const MovingBody& body, double seconds);
Points surface_at(const MovingBody& body, double seconds);

/// Gives the body a lead: from `dressed`, in which it stands for `settle` seconds, to the motion's
/// first pose, no joint quicker than 2 m/s, and into its first speed.
void lead_in(MovingBody& body, const Pose& dressed, Points dressed_offset, double settle);

/// The motion turned about the vertical and shifted so that its first frame faces and stands as
/// `pose` does. Heights stay.
Motion entered_from(const BodyModel& model, Motion motion, const Pose& pose);

}  // namespace atelier
