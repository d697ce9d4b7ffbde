#pragma once

#include <array>

#include "appearance/mean_texture.h"
#include "appearance/prepare.h"
#include "appearance/train_options.h"
#include "bodymodel/underlying/outer_surface.h"
#include "core/store/stage.h"
#include "pipeline/avatar/avatar_input.h"

namespace atelier {

struct AvatarStageOptions {
  AvatarKind kind = AvatarKind::All;
  /// With twice the setting's texels a side, for faces, and as many of the branches.
  TrainOptions train{.smoothness = 3, .code = {.pose = true, .latent = -1, .geometry = true}};
  bool network = true;  ///< false, or without libtorch: a mean texture alone
  OuterSurfaceOptions surface;
  MeanTextureOptions texture;
  PrepareAppearanceOptions prepare;
  DatasetOptions capture;
};
OptionTable describe(AvatarStageOptions& options);

/// The training with everything that was left to its setting. Throws UsageError for what no network
/// can have.
TrainOptions avatar_training(const AvatarStageOptions& options, Device device);

inline constexpr std::array kAvatarMetrics = {
    StageMetric{"frames", ""},
    StageMetric{"minimal", ""},
    StageMetric{"skin_distance", "m"},
    StageMetric{"cover_distance", "m"},
    StageMetric{"turned_faces", ""},
    StageMetric{"views", ""},
    StageMetric{"seen_rate", "of the texture"},
    StageMetric{"mean_psnr_db", "dB"},
    StageMetric{"training_psnr_db", "dB"},
    StageMetric{"iterations", ""},
    StageMetric{"seconds_a_step", "s"},
    StageMetric{"drawn_low", "of the mean texture"},
    StageMetric{"drawn_high", "of the mean texture"},
};

/// Person, poses, scans and images -> surface/ (the seen surface of each frame that it is made
/// from: skin, hair and shoes, core/sequence_archive.h), avatar.npz (the person as a body whose
/// rest surface is the seen one), body/model.safetensors (its texture, as networks are drawn:
/// pose and latent code, branches and shadow, or without libtorch its mean texture),
/// body/training.csv, texture.png (the mean), pictures.png and crops.png. Held-out cameras and
/// frames are never opened.
void run_avatar(StageRun& run);

}  // namespace atelier
