#include <array>

#include "capture/layouts/capture_lacks.h"
#include "capture/layouts/open_dataset.h"
#include "pipeline/appearance/appearance_rules.h"
#include "pipeline/avatar/avatar_measures.h"
#include "pipeline/avatar/avatar_pictures.h"
#include "pipeline/avatar/avatar_stage.h"
#include "pipeline/row/stage_row.h"

namespace atelier {
namespace {

using enum Measure::Side;

constexpr const char* kHeldOut = "the capture holds out no cameras or no frames";

constexpr std::array kAvatarTargets = {
    Target{"avatar.mean_mm", "distance of skin, hair and shoes from the true ones", "mm", AtMost, 4,
           10},
    Target{"avatar.psnr_db", "likeness of skin, hair and shoes to held-out images (PSNR)", "dB",
           AtLeast, 30, 20, kHeldOut},
    Target{"avatar.covered", "share of the pixels of skin, hair and shoes that the avatar draws",
           "", AtLeast, 0.95, 0.9, kHeldOut},
    Target{"avatar.gain_db",
           "gain of the avatar over its skinned mean texture",
           "dB",
           AtLeast,
           3,
           {},
           kHeldOut},
    Target{"avatar.head_hands_psnr_db",
           "likeness of face and hands to held-out images (PSNR)",
           "dB",
           AtLeast,
           28,
           {},
           kHeldOut},
    Target{"avatar.person_psnr_db",
           "likeness of the clothed person to held-out images (PSNR)",
           "dB",
           AtLeast,
           31,
           {},
           kHeldOut},
    Target{"avatar.person_ssim",
           "structural similarity of the clothed person to held-out images",
           "",
           AtLeast,
           0.95,
           {},
           kHeldOut},
};

constexpr std::array kAvatarFigures = {
    KeyFigure{"skin_distance", "distance of the scans' skin from the avatar", Measure::Side::AtMost,
              0.002},
    KeyFigure{"cover_distance", "distance of the scans' hair and shoes from the avatar",
              Measure::Side::AtMost, 0.006},
    KeyFigure{"training_psnr_db", "likeness of the avatar to its training images (PSNR)",
              Measure::Side::AtLeast, 22},
};

}  // namespace

const StageRow& avatar_row() {
  static const StageRow row{
      .stage = {.name = "avatar",
                .version = 2,
                .summary = "the body as it is seen: skin, hair and shoes, with their texture",
                .inputs = {"capture", "scans", "person", "tracked"},
                .optional_inputs = {"bodies", "registered"},
                .outputs = {"avatar"},
                .metrics = kAvatarMetrics,
                .options = option_set<AvatarStageOptions>,
                .run = run_avatar,
                .check_input = check_capture_input,
                .frame_wise = true,
                .has_cuda = true,
                .device_keyed = true},
      .input_help = "Capture with images, of which WORKSPACE has scans, person and poses",
      .require_startable =
          [](const StageRequest& request) {
            avatar_training(options_of<AvatarStageOptions>(request.options), request.device);
            check_device(request.device);
          },
      .chain = ChainPlace{.lacks = lacks_masks,
                          .cost = {.seconds = 55, .per_frame = 1.5},
                          .memory = {.megabytes = 1500},
                          .report_cost = {.seconds = 2},
                          .truth_cost = {.per_picture = 0.5}},
      .measure = measure_avatar,
      .measure_place = 3,
      .targets = kAvatarTargets,
      .key_figures = kAvatarFigures,
      .rules = &appearance_rules(),
      .pictures = avatar_pictures,
  };
  return row;
}

}  // namespace atelier
