#include "bodymodel/retarget/moving_body.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "bodymodel/kinematics.h"
#include "bodymodel/retarget/motion_resample.h"
#include "bodymodel/retarget/synthetic_motion.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr double kRunUp = 0.4;    // s in which the motion's first speed is gained
constexpr double kMinFade = 0.2;  // s in which an offset goes

/// `t` seconds into a run that ends, after `run_up` seconds, in the motion's first pose at its
/// first speed: the way between the first two poses, taken backwards.
Pose before_motion(const Motion& motion, double run_up, double t) {
  if (motion.poses.size() < 2 || run_up <= 0) {
    return motion.poses.front();
  }
  const double seconds = (t * t / run_up - run_up) / 2;  // before the motion: negative
  return interpolated_pose(motion.poses[0], motion.poses[1], seconds * motion.fps);
}

}  // namespace

double lead_seconds(const MovingBody& body) {
  return body.settle + body.transition + body.run_up;
}

Pose pose_at(const MovingBody& body, double seconds) {
  const double lead = lead_seconds(body);
  if (seconds >= lead) {
    return smooth_pose(body.motion, seconds - lead);
  }
  const double moved = seconds - body.settle - body.transition;  // into the run
  const Pose there = before_motion(body.motion, body.run_up, std::max(0.0, moved));
  if (moved >= 0) {
    return there;
  }
  const double share = eased((seconds - body.settle) / body.transition);
  return share <= 0 ? body.dressed : interpolated_pose(body.dressed, there, share);
}

Points surface_at(const MovingBody& body, double seconds) {
  Points surface = skin_vertices(body.model, body.shaped, pose_at(body, seconds));
  if (body.dressed_offset.rows() > 0) {
    const double fade = 1 - eased(seconds / std::max(body.settle, kMinFade));
    if (fade > 0) {
      surface += fade * body.dressed_offset;
    }
  }
  if (!body.offsets.empty()) {
    const double at = std::clamp((seconds - lead_seconds(body)) * body.motion.fps, 0.0,
                                 static_cast<double>(body.offsets.size() - 1));
    const auto before = saturating_cast<std::size_t>(at);
    const double share = at - static_cast<double>(before);
    surface += (1 - share) * body.offsets[before];
    if (share > 0) {
      surface += share * body.offsets[before + 1];
    }
  }
  return surface;
}

void lead_in(MovingBody& body, const Pose& dressed, Points dressed_offset, double settle) {
  body.dressed = dressed;
  body.dressed_offset = std::move(dressed_offset);
  body.settle = settle;
  body.run_up = kRunUp;
  body.transition =
      transition_seconds(body.shaped.skeleton, dressed, before_motion(body.motion, body.run_up, 0));
}

Motion entered_from(const BodyModel& model, Motion motion, const Pose& pose) {
  const Motion recorded = motion;
  const ContinuousMotion turned =
      facing_as(model,
                {[&recorded](double seconds) { return smooth_pose(recorded, seconds); },
                 static_cast<double>(recorded.poses.size() - 1) / recorded.fps},
                0, pose);
  for (std::size_t i = 0; i < motion.poses.size(); ++i) {
    motion.poses[i] = turned.pose(static_cast<double>(i) / recorded.fps);
  }
  return motion;
}

}  // namespace atelier
