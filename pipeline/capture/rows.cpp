#include <array>

#include "capture/layouts/capture_lacks.h"
#include "capture/layouts/open_dataset.h"
#include "core/store/frame_selection.h"
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
    Target{"keypoints.mean_mm", "mean error of the keypoints in space", "mm", AtMost, 5, 10,
           "there are no detections"},
    Target{"surface.chamfer_mm", "distance between the scans and the true surface", "mm", AtMost,
           2.5, 4, kNoScans},
    Target{"surface.completeness", "share of the seen surface within 5 mm of the scans", "",
           AtLeast, 0.95, 0.75, kNoScans},
    Target{"surface.floating", "share of the scans' area more than 2 cm off the surface", "",
           AtMost, 0.001, 0.01, kNoScans},
    Target{"labels.miou", "overlap of the scans' labels with the true ones (mean IoU)", "", AtLeast,
           0.95, 0.95, kNoScans},
};

constexpr std::array kReconstructFigures = {
    KeyFigure{"keypoints_found", "share of the keypoints found in space", Measure::Side::AtLeast,
              0.9},
};

}  // namespace

const StageRow& validate_row() {
  static const StageRow row{
      .stage = {.name = "validate",
                .version = 3,
                .summary = "defects of a capture, and how to correct them",
                .inputs = {"capture"},
                .outputs = {"findings"},
                .metrics = kValidateMetrics,
                .options = option_set<ValidateStageOptions>,
                .file_options = {"revoked"},
                .run = run_validate,
                .check_input = check_capture_input,
                .states_consent = true},
      .input_help =
          "Capture to judge: its folder, in any layout that docs/reference/formats.md lists",
      .require_startable =
          [](const StageRequest& request) {
            open_dataset(request.input, options_of<ValidateStageOptions>(request.options).capture);
          },
      .chain = ChainPlace{.cost = {.seconds = 0.5, .per_picture = 0.04, .unmasked = true},
                          .report_cost = {.seconds = 0.3}},
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
                .check_input = check_capture_input,
                .frame_wise = true,
                .has_cuda = true,
                .device_keyed = true},
      .input_help = "Capture to reconstruct: images with masks or labels, 2D keypoints, cameras",
      .require_startable =
          [](const StageRequest& request) {
            const auto& options = options_of<ReconstructStageOptions>(request.options);
            const Dataset dataset = stage_dataset(request.input, options.capture);
            std::vector<int> frames = frames_with_masks(dataset);
            if (frames.empty()) {  // keypoints alone
              frames = frame_ids(dataset);
            }
            some_selected_frames(request.selection, frames, request.input.string());
          },
      .chain = ChainPlace{.lacks = lacks_evidence,
                          .splits = true,
                          .cost = {.per_picture = 6, .per_frame = 2.5, .parallel = true},
                          .memory = {.per_picture = 65},
                          .report_cost = {.seconds = 0.5, .per_picture = 0.03},
                          .truth_cost = {.per_frame = 0.5}},
      .measure = measure_reconstruct,
      .targets = kReconstructTargets,
      .key_figures = kReconstructFigures,
      .rules = &capture_rules(),
      .pictures = reconstruct_pictures,
  };
  return row;
}

}  // namespace atelier
