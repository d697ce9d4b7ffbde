#include "capture/layouts/open_dataset.h"
#include "pipeline/garment/register_stage.h"
#include "pipeline/garment/template_stage.h"
#include "pipeline/row/stage_row.h"

namespace atelier {

const StageRow& template_row() {
  static const StageRow row{
      .stage = {.name = "template",
                .version = 8,
                .summary = "each garment as a clean mesh with named openings, in one frame's pose",
                .inputs = {"capture", "scans", "person", "bodies"},
                .outputs = {"template"},
                .metrics = kTemplateMetrics,
                .options = option_set<TemplateStageOptions>,
                .file_options = {"import"},
                .run = run_template,
                .check_input = require_no_folder_above},
      .require_startable =
          [](const StageRequest& request) {
            const auto& options = options_of<TemplateStageOptions>(request.options);
            require_named(options);
            require_template_frame(options, request.input);
          },
  };
  return row;
}

const StageRow& register_row() {
  static const StageRow row{
      .stage = {.name = "register",
                .version = 10,
                .summary = "each garment's template registered to every frame",
                .inputs = {"capture", "template", "scans", "bodies"},
                .outputs = {"registered"},
                .metrics = kRegisterMetrics,
                .options = option_set<RegisterStageOptions>,
                .run = run_register,
                .check_input = require_no_folder_above,
                .frame_wise = true},
      .require_startable =
          [](const StageRequest& request) {
            if (!request.workspace.empty()) {
              require_registered_frames(options_of<RegisterStageOptions>(request.options),
                                        request.selection, request.input, request.workspace);
            }
          },
  };
  return row;
}

}  // namespace atelier
