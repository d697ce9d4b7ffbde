#include <array>
#include <vector>

#include "capture/layouts/capture_lacks.h"
#include "pipeline/pattern/flat_surfaces.h"
#include "pipeline/pattern/flatten_measures.h"
#include "pipeline/pattern/flatten_rules.h"
#include "pipeline/pattern/flatten_stage.h"
#include "pipeline/pattern/pattern_pictures.h"
#include "pipeline/row/stage_row.h"

namespace atelier {
namespace {

using enum Measure::Side;

constexpr const char* kNoSeams = "no ground-truth garment has seams";

constexpr const char* kNeverSewn =
    "the pattern was not sewn anew: its garment's body is not known, or it was refused";

constexpr std::array kFlattenTargets = {
    Target{"flatten.stretch_p99", "stretch of the flat panels, 99th percentile", "", AtMost, 0.03,
           0.05},
    Target{"flatten.seam_mismatch", "largest relative difference between the two sides of a seam",
           "", AtMost, 0.003, 0.003},
    Target{"flatten.inverted", "number of inverted triangles and of panels that overlap themselves",
           "", AtMost, 0, 0},
    // The ground truth's panels and two more a garment: of a dress. measure_flatten says each one's
    // own.
    Target{"flatten.panels", "number of the pattern's panels", "", AtMost, 8, {}, kNoSeams},
    Target{"flatten.seam_ratio", "length of all seams over that of the true pattern", "", AtMost,
           1.3, 4, kNoSeams},
    Target{"flatten.area_error",
           "relative error of the pattern's area",
           "",
           AtMost,
           0.03,
           {},
           kNoSeams},
    Target{"flatten.sewn_mean_mm",
           "mean distance of the written pattern, sewn anew and draped, from the captured garment",
           "mm",
           AtMost,
           5,
           {},
           kNeverSewn},
    Target{"flatten.sewn_p95_mm", "the same, 95th percentile", "mm", AtMost, 12, {}, kNeverSewn},
};

std::vector<std::string_view> of_template(const CaptureFacts& /*facts*/) {
  return {"template"};
}

std::filesystem::path flattened(const RunPlaces& places) {
  return flat_surfaces(places.workspace);
}

constexpr std::array kFlattenFigures = {
    KeyFigure{"stretch_p99", "stretch of the flat pieces, 99th percentile", Measure::Side::AtMost,
              0.05},
};

}  // namespace

const StageRow& flatten_row() {
  static const StageRow row{
      .stage = {.name = "flatten",
                .version = 17,
                .summary = "a garment's surface as a flat sewing pattern",
                .inputs = {"surface"},
                .outputs = {"pattern"},
                .metrics = kFlattenMetrics,
                .options = option_set<FlattenStageOptions>,
                .file_options = {"seams", "relax.body", "relax.registered", "sew_check.body"},
                .run = run_flatten,
                .check_input = check_flatten_input},
      .input_help =
          "Surface of a garment (mesh or garment.h5), or a folder of them, such as "
          "WORKSPACE/template/current/garments",
      .require_startable =
          [](const StageRequest& request) {
            require_named(options_of<FlattenStageOptions>(request.options), request.input);
          },
      .chain = ChainPlace{.lacks = lacks_clothes,
                          .made_of = of_template,
                          .input = flattened,
                          .cost = {.seconds = 27},
                          .report_cost = {.seconds = 1},
                          .truth_cost = {.seconds = 1}},
      .measure = measure_flatten,
      .targets = kFlattenTargets,
      .key_figures = kFlattenFigures,
      .rules = &flatten_rules(),
      .pictures = pattern_pictures,
  };
  return row;
}

}  // namespace atelier
