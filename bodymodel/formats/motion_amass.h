#pragma once

#include <filesystem>

#include "bodymodel/body_model.h"
#include "bodymodel/motion_clip.h"
#include "core/limits.h"

namespace atelier {

class Npz;

/// Reads an AMASS motion (Mahmood et al. 2019) in both flavours: SMPL-H (poses [F,156],
/// mocap_framerate) and SMPL-X "stageii" (poses [F,165] or root_orient, pose_body, pose_hand and,
/// where there are, pose_jaw, pose_eye; mocap_frame_rate). Also SMPL poses [F,72]. The file's world
/// is Z up and becomes Y up.
///
/// `model` is the user's SMPL, SMPL-H or SMPL-X body, shaped by the file's betas as far as it has
/// them; without one, the clip's skeleton is an average adult of our own (Drillis and Contini's
/// segment lengths), with a finding ("motion-skeleton"): right for retargeting, not for exact joint
/// positions. Throws DataError naming array, found and expected for missing arrays, wrong shapes,
/// lengths that disagree, numbers that are not finite, and a model of another family.
MotionClip read_amass(const Npz& npz, const BodyModel* model = nullptr, const Limits& limits = {});
MotionClip read_amass(const std::filesystem::path& path, const BodyModel* model = nullptr,
                      const Limits& limits = {});

}  // namespace atelier
