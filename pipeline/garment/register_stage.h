#pragma once

#include <array>
#include <filesystem>

#include "capture/layouts/open_dataset.h"
#include "core/store/frame_selection.h"
#include "core/store/stage.h"
#include "registration/tracking/register_sequence.h"

namespace atelier {

struct RegisterStageOptions {
  DatasetOptions capture;
  RegisterSequenceOptions fit;
  bool simulated_prediction = true;  ///< of cloth that hangs free (simulated_prediction.h)
  bool ground_truth_scans =
      false;  ///< surfaces of a synthetic capture's ground truth instead of the scans
};
OptionTable describe(RegisterStageOptions& options);

inline constexpr std::array kRegisterMetrics = {
    StageMetric{"frames", ""},
    StageMetric{"garments", ""},
    StageMetric{"ground_truth_scans", ""},
    StageMetric{"scan_rms", "m"},
    StageMetric{"support", "of the garments' area"},
    StageMetric{"seen", "of the vertices, by two cameras"},
    StageMetric{"correlation", "of images with the template's texture"},
    StageMetric{"inverted", "triangles"},
    StageMetric{"inside", "of vertices and triangles' centres, in the body"},
    StageMetric{"body_crossings", "pairs of triangles, cloth and body, all frames"},
    StageMetric{"code_read", "points matched by the coded print, in all frames"},
    StageMetric{"code_contradicted", "points whose match contradicted those around"},
    StageMetric{"forward_backward", "m"},
    StageMetric{"closure", "m"},
};

/// Templates, bodies, scans and images -> where every garment is in every clothed frame:
/// registered/<label>/ (core/sequence_archive.h, with template.h5, the mesh in its own frame),
/// sequence.h5 and frames/ (all garments as one mesh, which `refine` reads), holding.toml and
/// holding.png (what holds the garments, find_holding), and figures.json: what each frame says of
/// itself, and drift. Held-out cameras are not opened.
void run_register(StageRun& run);

/// Refuses a choice of frames that holds none that the stage would follow, as its run would. Throws
/// DataError.
void require_registered_frames(const RegisterStageOptions& options, const FrameSelection& selection,
                               const std::filesystem::path& capture,
                               const std::filesystem::path& workspace);

}  // namespace atelier
