#include "capture/layouts/open_dataset.h"
#include "pipeline/appearance/appearance_stage.h"
#include "pipeline/row/stage_row.h"

namespace atelier {

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
                .check_input = require_no_folder_above,
                .has_cuda = true,
                .device_keyed = true},
      .require_startable =
          [](const StageRequest& request) {
            const auto& options = options_of<AppearanceStageOptions>(request.options);
            require_trainable(options, request.device);
            require_cameras(options, request.input);
          },
  };
  return row;
}

const StageRow& ceiling_row() {
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
           .check_input = require_no_folder_above,
           .has_cuda = true,
           .device_keyed = true},
      .require_startable =
          [](const StageRequest& request) {
            const auto& options = options_of<AppearanceStageOptions>(request.options);
            require_trainable(options, request.device);
            require_cameras(options, request.input);
          },
  };
  return row;
}

}  // namespace atelier
