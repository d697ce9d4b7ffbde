#include "pipeline/pattern/flatten_stage.h"
#include "pipeline/row/stage_row.h"

namespace atelier {

const StageRow& flatten_row() {
  static const StageRow row{
      .stage = {.name = "flatten",
                .version = 14,
                .summary = "a garment's surface as a flat sewing pattern",
                .inputs = {"surface"},
                .outputs = {"pattern"},
                .metrics = kFlattenMetrics,
                .options = option_set<FlattenStageOptions>,
                .file_options = {"seams", "relax.body", "relax.registered"},
                .run = run_flatten,
                .check_input = check_flatten_input},
      .require_startable =
          [](const StageRequest& request) {
            require_named(options_of<FlattenStageOptions>(request.options), request.input);
          },
  };
  return row;
}

}  // namespace atelier
