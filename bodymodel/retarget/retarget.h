#pragma once

#include <array>
#include <vector>

#include "bodymodel/body_model.h"
#include "bodymodel/motion_clip.h"
#include "core/finding.h"
#include "core/options.h"

namespace atelier {

struct RetargetOptions {
  double fps = 0;                ///< frames per second of the result, [0, 1000]; 0: the clip's own
  bool drop_t_pose = true;       ///< leave out a first frame that is a calibration pose: one that
                                 ///< jumps to the second (cgspeed files begin with one)
  bool ground = true;            ///< put the body on y = 0; off keeps the clip's heights, scaled
  bool keep_contacts = true;     ///< pin feet that stand still and bend the leg to reach them
  double contact_speed = 0.35;   ///< m/s below which a foot near the ground stands, [0, 5]
  double contact_height = 0.08;  ///< m above its lowest at which a foot may stand, [0, 1]
};

OptionTable describe(RetargetOptions& options);

/// A motion on another body.
struct Retargeted {
  Motion motion;                              ///< for the body model's skeleton
  double scale = 1;                           ///< target's legs over the clip's
  int reference_frame = -1;                   ///< frame of the clip that was matched with the
                                              ///< body's rest pose; -1: the clip's own rest pose
  std::vector<std::array<bool, 2>> contacts;  ///< [N] left and right foot stand
  std::vector<Finding> findings;
};

/// Whether a pose means the same on both: names and parents of all joints, rest rotations, and
/// offsets to a millionth of the legs.
bool same_skeleton(const Skeleton& a, const Skeleton& b, double legs);

/// Moves a body by a motion of another skeleton (our choice throughout):
///  - joints correspond by role (humanoid.h); spine and neck by their share of the way between
///    pelvis, chest and head, however many joints either has; joints without a role keep their
///    rest;
///  - rest poses are aligned: of the clip's rest pose and its frames, the one whose limbs are
///    nearest to the body's rest pose is the reference; the body is bent into it (pelvis and chest
///    by their left-right and upward axes, limbs by the shortest swing of each bone), and from
///    there follows the clip's world rotations; neck and head follow theirs from the clip's rest
///    pose, as in the middle of a motion a head may look anywhere;
///  - the hips' path is scaled by the legs, so that steps fit;
///  - feet that stand in the clip stand on the body: each standing phase gets one place, and the
///    leg is bent to reach it (two-bone inverse kinematics), with a soft start and end;
///  - frames are resampled last to first: the clip is brought to `fps` before anything else.
/// A motion whose feet point against where its left and right joints say that it faces, at rest and
/// in most frames, is told ("motion-mirrored") and taken as it is.
/// A clip that is on the body's own skeleton (same_skeleton) is taken as it is, rotations and path:
/// feet are not pinned, since nothing moved them.
/// `shape` as in skinning.h. Throws DataError if no person is found in either skeleton, or one
/// whose legs have no length. O(frames x joints).
Retargeted retarget(const MotionClip& clip, const BodyModel& model,
                    const Eigen::VectorXd& shape = {}, const RetargetOptions& options = {});

}  // namespace atelier
