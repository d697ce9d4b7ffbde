#pragma once

#include <functional>
#include <string>

#include "bodymodel/body_model.h"
#include "core/finding.h"
#include "core/options.h"
#include "core/pose.h"

namespace atelier {

/// The motion of the subject.
struct MotionChoice {
  /// "auto" (spin in a skirt or dress, else stride), "stride", "squat", "raise", "twist", "spin",
  /// "range" (what the minimal sequence shows), or a file that read_motion_file knows.
  std::string motion = "auto";
  double duration = 2;  ///< s, of one stride pair, squat, raise, twist or spin
  double start = -1;    ///< s into the motion where frames begin; below 0: in its middle
};
OptionTable describe(MotionChoice& choice);

/// A pose for every second. Smooth; before 0 and after its end the subject stands.
struct ContinuousMotion {
  std::function<Pose(double seconds)> pose;
  double duration = 0;                 ///< s
  std::vector<Finding> findings = {};  ///< of the file that it was read from
};

/// Makes it for a body: directions of limbs in the body's own frame, so that any humanoid rest pose
/// does. Feet stand on y = `ground`. Throws DataError for a file that cannot be read or has no
/// person in it.
ContinuousMotion continuous_motion(const BodyModel& model, const std::string& motion,
                                   double duration, double ground);

/// The motions that need no file: stride, squat, raise, twist, spin and range.
const std::vector<std::string>& procedural_motions();

/// One of them.
bool is_procedural(const std::string& motion);

/// The motion turned about the vertical and shifted so that at `entry` seconds its body faces as in
/// the rest pose and stands where it does: a person who enters a recorded motion midway need not
/// cross the room. Heights stay.
ContinuousMotion facing_as_at_rest(const BodyModel& model, const ContinuousMotion& motion,
                                   double entry);

/// The same as in any pose.
ContinuousMotion facing_as(const BodyModel& model, const ContinuousMotion& motion, double entry,
                           const Pose& standing);

/// From 0 to 1 with neither speed nor acceleration at both ends; flat outside of [0, 1].
double eased(double t);

/// How long the way from one pose to another takes, eased, if no joint is to be quicker than 2 m/s:
/// at least 0.9 s.
double transition_seconds(const Skeleton& skeleton, const Pose& from, const Pose& to);

/// From one pose to another, rotation vectors along the straight line, `share` in [0, 1].
Pose blended(const Pose& from, const Pose& to, double share);

}  // namespace atelier
