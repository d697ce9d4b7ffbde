#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bodymodel/formats/personal_body.h"
#include "bodymodel/formats/tracked_motion.h"
#include "pipeline/animation/animation_input.h"

namespace atelier {

/// The workspace as `animate` reads it, before any garment is placed.
struct AnimationSource {
  PersonalBody person;
  TrackedMotion tracked;
  std::optional<Sequence> bodies;  // surfaces of the frames, by `body`
  std::vector<RegisteredGarmentSequence> outfit;

  std::optional<Points> surface(int frame_id) const {
    if (!bodies) {
      return std::nullopt;
    }
    const std::vector<int>& ids = bodies->frame_ids;
    const auto at = std::lower_bound(ids.begin(), ids.end(), frame_id);
    if (at == ids.end() || *at != frame_id) {
      return std::nullopt;
    }
    return frame(*bodies, at - ids.begin()).vertices;
  }
  /// Row of a frame in the tracked motion, or -1.
  Index row(int frame_id) const {
    const std::vector<int>& ids = tracked.motion.frame_ids;
    const auto at = std::lower_bound(ids.begin(), ids.end(), frame_id);
    return at == ids.end() || *at != frame_id ? -1 : at - ids.begin();
  }
};

/// How far the surface of a frame is off the skinned person; no rows where there is none.
Points offset_in(const AnimationSource& source, const MovingBody& body, int frame_id);

/// A pose of the capture's own motion on the wearer of the clothes, by its row.
using OwnPose = std::function<Pose(Index row)>;

/// The clothes as registered, on the body: in its motion where that is the capture's own on its own
/// person, else in the pose of their template, from which the body goes over into the motion.
void wear_registered(StageRun& run, const AnimationSource& source, const OwnPose& own_pose,
                     Animation& animation);

/// Clothes of patterns, sewn on the body in its rest pose.
void wear_pattern(StageRun& run, Animation& animation);

/// Cloth that another simulator moved, in place of what the workspace has.
void wear_foreign(const AnimateOptions& options, const AnimationSource& source,
                  Animation& animation);

}  // namespace atelier
