#include <array>

#include "capture/layouts/capture_lacks.h"
#include "capture/layouts/open_dataset.h"
#include "pipeline/garment/register_measures.h"
#include "pipeline/garment/register_pictures.h"
#include "pipeline/garment/register_stage.h"
#include "pipeline/garment/template_measures.h"
#include "pipeline/garment/template_stage.h"
#include "pipeline/row/stage_row.h"

namespace atelier {
namespace {

using enum Measure::Side;

constexpr std::array kTemplateTargets = {
    Target{"template.boundaries_wrong",
           "number of the templates' openings that are wrong or without a name",
           "",
           AtMost,
           0,
           {}},
    Target{"template.garments_missed", "number of garments without a template", "", AtMost, 0, {}},
    Target{"template.not_manifold", "number of templates that are not manifold", "", AtMost, 0, {}},
};

constexpr std::array kRegisterTargets = {
    Target{"register.chamfer_mm", "distance between the registered garments and the true ones",
           "mm", AtMost, 2, 5},
    Target{"register.point_mean_mm",
           "distance of the garments' points from where the same cloth is", "mm", AtMost, 3, 20},
    Target{"register.point_p95_mm",
           "distance of the garments' points from where the same cloth is, 95th percentile", "mm",
           AtMost, 8, 90},
    Target{"register.inverted", "number of registered triangles turned against their neighbours",
           "", AtMost, 0, 5},
    Target{"register.drift_mm", "drift along the cloth in the last frame, median", "mm", AtMost, 2,
           3},
};

constexpr std::array kTemplateFigures = {
    KeyFigure{"unseen_share", "share of the garments that no camera saw", Measure::Side::AtMost,
              0.1},
};

}  // namespace

const StageRow& template_row() {
  static const StageRow row{
      .stage = {.name = "template",
                .version = 10,
                .summary = "each garment as a clean mesh with named openings, in one frame's pose",
                .inputs = {"capture", "scans", "person", "bodies"},
                .outputs = {"template"},
                .metrics = kTemplateMetrics,
                .options = option_set<TemplateStageOptions>,
                .file_options = {"import"},
                .run = run_template,
                .check_input = check_capture_input},
      .input_help = "Capture with clothed frames, of which WORKSPACE has scans and bodies",
      .require_startable =
          [](const StageRequest& request) {
            const auto& options = options_of<TemplateStageOptions>(request.options);
            require_named(options);
            require_template_frame(options, request.input);
          },
      .chain = ChainPlace{.lacks = lacks_clothes,
                          .cost = {.seconds = 9, .per_clothed = 0.5},
                          .memory = {.megabytes = 1000},
                          .report_cost = {.seconds = 0.2},
                          .truth_cost = {.seconds = 0.2}},
      .measure = measure_template,
      .targets = kTemplateTargets,
      .key_figures = kTemplateFigures,
  };
  return row;
}

const StageRow& register_row() {
  static const StageRow row{
      .stage = {.name = "register",
                .version = 13,
                .summary = "each garment's template registered to every frame",
                .inputs = {"capture", "template", "scans", "bodies"},
                .outputs = {"registered"},
                .metrics = kRegisterMetrics,
                .options = option_set<RegisterStageOptions>,
                .run = run_register,
                .check_input = check_capture_input,
                .frame_wise = true},
      .input_help =
          "Capture with clothed frames, of which WORKSPACE has template, scans and bodies",
      .require_startable =
          [](const StageRequest& request) {
            if (!request.workspace.empty()) {
              require_registered_frames(options_of<RegisterStageOptions>(request.options),
                                        request.selection, request.input, request.workspace);
            }
          },
      .chain = ChainPlace{.lacks = lacks_clothes,
                          .splits = true,
                          .cost = {.per_clothed = 5.5},
                          .memory = {.megabytes = 1000},
                          .report_cost = {.seconds = 1, .per_picture = 0.03},
                          .truth_cost = {.per_clothed = 1.2}},
      .measure = measure_register,
      .targets = kRegisterTargets,
      .key_figures = kRegisterFigures,
      .pictures = register_pictures,
  };
  return row;
}

}  // namespace atelier
