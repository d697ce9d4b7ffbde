#include "capture/layouts/open_dataset.h"
#include "pipeline/capture/reconstruct_stage.h"
#include "pipeline/capture/validate_stage.h"
#include "pipeline/row/stage_row.h"

namespace atelier {

const StageRow& validate_row() {
  static const StageRow row{
      .stage = {.name = "validate",
                .version = 2,
                .summary = "defects of a capture, and how to correct them",
                .inputs = {"capture"},
                .outputs = {"findings"},
                .metrics = kValidateMetrics,
                .options = option_set<ValidateStageOptions>,
                .run = run_validate,
                .check_input = require_no_folder_above,
                .states_consent = true},
  };
  return row;
}

const StageRow& reconstruct_row() {
  static const StageRow row{
      .stage = {.name = "reconstruct",
                .version = 5,
                .summary = "labelled surfaces and 3D keypoints from the images of a capture",
                .inputs = {"capture"},
                .outputs = {"scans", "keypoints3d"},
                .metrics = kReconstructMetrics,
                .options = option_set<ReconstructStageOptions>,
                .run = run_reconstruct,
                .check_input = require_no_folder_above,
                .frame_wise = true,
                .has_cuda = true,
                .device_keyed = true},
  };
  return row;
}

}  // namespace atelier
