#pragma once

#include <filesystem>

#include "bodymodel/body_model.h"
#include "bodymodel/motion_clip.h"
#include "core/limits.h"

namespace atelier {

class Npz;

/// Reads an AMASS motion (Mahmood et al. 2019) in both flavours: SMPL-H (poses [F,156],
/// mocap_framerate) and SMPL-X "stageii" (poses [F,165] or root_orient, pose_body and, where there
/// are, pose_hand, pose_jaw, pose_eye; mocap_frame_rate). Also SMPL poses [F,72]. The file's world
/// is Z up, as AMASS', or Y up, as `options.up` says, and becomes Y up; where it is not said, Z is
/// taken, with a finding ("motion-up") where the person then lies throughout and would stand
/// otherwise. Its path is in metres or in the unit of `options.metres_per_unit`; where that is not
/// said, feet that tell centimetres or millimetres are believed, with a finding ("motion-unit").
/// Rotations of which no person's trunk is capable are doubted ("motion-degrees").
///
/// `model` is the user's SMPL, SMPL-H or SMPL-X body at `shape` (as in skinning.h) or, where that
/// is empty, at the file's betas as far as the body has them ("motion-betas"). Betas of another
/// family than the body's or of another gender are other shapes and left out ("motion-shape"):
/// SMPL and SMPL-H alone have the same. Joints follow by name, and those that the body lacks are
/// left out with a finding ("motion-joints"). The motion is then exact: retarget takes it as it is.
/// Without a body of the family (is_smpl_skeleton) the clip's skeleton is an average adult of our
/// own (Drillis and Contini's segment lengths), with a finding ("motion-skeleton"): right for
/// retargeting, not for exact joint positions. Throws DataError naming array, found and expected
/// for missing arrays, wrong shapes, lengths that disagree, numbers that are not finite, and poses
/// of another family than surface_model_type says.
MotionClip read_amass(const Npz& npz, const BodyModel* model = nullptr,
                      const Eigen::VectorXd& shape = {}, const MotionOptions& options = {},
                      const Limits& limits = {});
MotionClip read_amass(const std::filesystem::path& path, const BodyModel* model = nullptr,
                      const Eigen::VectorXd& shape = {}, const MotionOptions& options = {},
                      const Limits& limits = {});

/// Whether poses of the SMPL family mean on a skeleton what they mean on its own: the names and
/// parents of its 22 joints of the body, a rest pose without rotations and with level arms.
bool is_smpl_skeleton(const Skeleton& skeleton);

}  // namespace atelier
