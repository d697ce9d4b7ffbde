#include <array>
#include <string>

#include "capture/layouts/capture_lacks.h"
#include "capture/layouts/open_dataset.h"
#include "core/io/child_program.h"
#include "pipeline/appearance/appearance_measures.h"
#include "pipeline/appearance/appearance_pictures.h"
#include "pipeline/appearance/appearance_rules.h"
#include "pipeline/appearance/appearance_stage.h"
#include "pipeline/row/stage_row.h"

namespace atelier {
namespace {

using enum Measure::Side;

constexpr const char* kHeldOut = "the capture holds out no cameras or no frames";

constexpr std::array kAppearanceTargets = {
    Target{"appearance.psnr_db", "likeness of the garments to held-out images (PSNR)", "dB",
           AtLeast, 34, 22, kHeldOut},
    Target{"appearance.covered", "share of the garments' pixels that their networks draw", "",
           AtLeast, 0.95, 0.9, kHeldOut},
    Target{"appearance.below_oracle_db",
           "loss against the same network on the true geometry",
           "dB",
           AtMost,
           2,
           {},
           "the same network was not trained on ground-truth geometry for comparison"},
    Target{"appearance.gain_db", "gain of the networks over the best static texture", "dB", AtLeast,
           4, 1, kHeldOut},
    Target{"appearance.shadow_psnr_db",
           "likeness of the garments' most occluded quarter to held-out images (PSNR)", "dB",
           AtLeast, 33, 21, kHeldOut},
    Target{
        "appearance.simulated_psnr_db",
        "likeness of the garments in a motion that was not captured (PSNR)", "dB", AtLeast, 28, 21,
        "the capture does not record how it was synthesized, so that it cannot be simulated again"},
};

std::string lacks_look(const CaptureFacts& facts) {
  return !has_child_program("atelier-appearance")
             ? "the program atelier-appearance is not there; it requires a build with libtorch"
             : lacks_clothes(facts);
}

constexpr std::array kAppearanceFigures = {
    KeyFigure{"training_psnr_db", "likeness of the garments to the training images (PSNR)",
              Measure::Side::AtLeast, 24},
};

}  // namespace

const StageRow& appearance_row() {
  static const StageRow row{
      .stage = {.name = "appearance",
                .version = 10,
                .summary = "appearance of each garment: networks that generate its texture",
                .inputs = {"capture", "registered", "bodies"},
                .outputs = {"networks"},
                .metrics = kAppearanceMetrics,
                .options = option_set<AppearanceStageOptions>,
                .run = run_appearance,
                .check_input = check_capture_input,
                .has_cuda = true,
                .device_keyed = true},
      .input_help = "Capture with images, of which WORKSPACE has registered garments and bodies",
      .require_startable =
          [](const StageRequest& request) {
            const auto& options = options_of<AppearanceStageOptions>(request.options);
            require_trainable(options, request.device);
            require_cameras(options, request.input);
          },
      .chain = ChainPlace{.lacks = lacks_look,
                          .cost = {.seconds = 3, .per_picture = 1.3},
                          .memory = {.megabytes = 4000},
                          .report_cost = {.seconds = 0.5, .per_picture = 0.02},
                          .truth_cost = {.per_picture = 0.2}},
      .measure = measure_appearance,
      .comparison = below_oracle,
      .measure_place = 3,
      .targets = kAppearanceTargets,
      .key_figures = kAppearanceFigures,
      .rules = &appearance_rules(),
      .pictures = appearance_pictures,
  };
  return row;
}

const StageRow& oracle_row() {
  static const StageRow row{
      .stage =
          {.name = "oracle",
           .version = 9,
           .summary =
               "appearance on the ground-truth geometry of a synthetic capture, for comparison",
           .inputs = {"capture"},
           .outputs = {"true_networks"},
           .metrics = kAppearanceMetrics,
           .options = option_set<AppearanceStageOptions>,
           .run = run_oracle,
           .check_input = check_capture_input,
           .has_cuda = true,
           .device_keyed = true},
      .input_help = "Synthetic capture, whose ground truth is the geometry",
      .require_startable =
          [](const StageRequest& request) {
            const auto& options = options_of<AppearanceStageOptions>(request.options);
            require_trainable(options, request.device);
            require_cameras(options, request.input);
          },
      .measure = measure_oracle,
      .measured_for = "appearance",
      .measure_place = 2,
      .rules = &appearance_rules(),
  };
  return row;
}

}  // namespace atelier
