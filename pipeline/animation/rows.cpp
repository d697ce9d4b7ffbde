#include "capture/layouts/open_dataset.h"
#include "pipeline/animation/animate_stage.h"
#include "pipeline/row/stage_row.h"

namespace atelier {

const StageRow& animate_row() {
  static const StageRow row{
      .stage = {.name = "animate",
                .version = 6,
                .summary =
                    "the person and the simulated garments in a motion, as meshes and images",
                .inputs = {"capture", "person", "tracked"},
                .optional_inputs = {"bodies", "template", "registered", "fitted_material",
                                    "networks"},
                .outputs = {"animation"},
                .metrics = kAnimateMetrics,
                .options = option_set<AnimateOptions>,
                .file_options = {"motion", "body", "garment", "cloth_sequence"},
                .run = run_animate,
                .check_input = require_no_folder_above,
                .frame_wise = true,
                .has_cuda = true,
                .device_keyed = true},
      .require_startable =
          [](const StageRequest& request) {
            require_named(options_of<AnimateOptions>(request.options), request.input);
          },
  };
  return row;
}

}  // namespace atelier
