#include <array>
#include <vector>

#include "capture/layouts/capture_lacks.h"
#include "capture/layouts/open_dataset.h"
#include "pipeline/animation/animate_measures.h"
#include "pipeline/animation/animate_rules.h"
#include "pipeline/animation/animate_stage.h"
#include "pipeline/animation/exported_avatar.h"
#include "pipeline/row/stage_row.h"

namespace atelier {
namespace {

/// Where no garment was captured, drafted ones are worn.
std::vector<std::string_view> of_worn(const CaptureFacts& facts) {
  return facts.clothed_frames > 0 ? std::vector<std::string_view>{"body", "template", "register"}
                                  : std::vector<std::string_view>{};
}

std::vector<SuggestedOption> drafted_garments(const CaptureFacts& facts) {
  return facts.clothed_frames > 0
             ? std::vector<SuggestedOption>{}
             : std::vector<SuggestedOption>{{"garment", "tee+skirt", "no garment was captured"}};
}

constexpr std::array kAnimateFigures = {
    KeyFigure{"penetration_rate", "share of the animated cloth inside the body",
              Measure::Side::AtMost, 0.01},
};

}  // namespace

const StageRow& animate_row() {
  static const StageRow row{
      .stage = {.name = "animate",
                .version = 9,
                .summary =
                    "the person and the simulated garments in a motion, as meshes and images",
                .inputs = {"capture", "person", "tracked"},
                .optional_inputs = {"bodies", "template", "registered", "fitted_material",
                                    "networks", "avatar"},
                .outputs = {"animation"},
                .metrics = kAnimateMetrics,
                .options = option_set<AnimateOptions>,
                .file_options = {"motion", "body", "garment", "cloth_sequence", "holding"},
                .run = run_animate,
                .check_input = check_capture_input,
                .states_consent = true,
                .frame_wise = true,
                .has_cuda = true,
                .device_keyed = true},
      .input_help = "Capture of the person, of which WORKSPACE has person and poses",
      .require_startable =
          [](const StageRequest& request) {
            require_named(options_of<AnimateOptions>(request.options), request.input);
          },
      .preview =
          [](const StageRequest& request) {
            return preview_animation(options_of<AnimateOptions>(request.options),
                                     request.workspace);
          },
      .chain = ChainPlace{.lacks = lacks_evidence,
                          .made_of = of_worn,
                          .cost = {.seconds = 1, .per_frame = 1},
                          .report_cost = {.seconds = 1.5},
                          .truth_cost = {.per_clothed = 0.1},
                          .fabric = "material.name",
                          .fabric_from = "fitted_material",
                          .suggested = drafted_garments,
                          .exported = exported_avatar},
      .measure = measure_animate,
      .measure_place = 4,
      .key_figures = kAnimateFigures,
      .rules = &animate_rules(),
  };
  return row;
}

}  // namespace atelier
