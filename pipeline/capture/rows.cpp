#include <array>

#include "capture/layouts/capture_lacks.h"
#include "capture/layouts/open_dataset.h"
#include "pipeline/capture/capture_rules.h"
#include "pipeline/capture/reconstruct_measures.h"
#include "pipeline/capture/reconstruct_pictures.h"
#include "pipeline/capture/reconstruct_stage.h"
#include "pipeline/capture/validate_stage.h"
#include "pipeline/row/stage_row.h"

namespace atelier {
namespace {

using enum Measure::Side;

constexpr const char* kNoScans = "there are no scans";

constexpr std::array kReconstructTargets = {
    Target{"keypoints.mean_mm", "mm", AtMost, 5, 10, "there are no detections"},
    Target{"surface.chamfer_mm", "mm", AtMost, 2.5, 4, kNoScans},
    Target{"surface.completeness", "", AtLeast, 0.95, 0.75, kNoScans},
    Target{"surface.floating", "", AtMost, 0.001, 0.01, kNoScans},
    Target{"labels.miou", "", AtLeast, 0.95, 0.95, kNoScans},
};

}  // namespace

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
      .chain = ChainPlace{.cost = {.seconds = 2, .per_picture = 0.04, .unmasked = true}},
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
      .chain = ChainPlace{.lacks = lacks_evidence, .cost = {.per_picture = 7, .parallel = true}},
      .measure = measure_reconstruct,
      .targets = kReconstructTargets,
      .rules = &capture_rules(),
      .pictures = reconstruct_pictures,
  };
  return row;
}

}  // namespace atelier
