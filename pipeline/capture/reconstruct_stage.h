#pragma once

#include <array>
#include <string>
#include <vector>

#include "capture/layouts/open_dataset.h"
#include "capture/surface/reconstruct_scan.h"
#include "capture/surface/split_by_color.h"
#include "capture/triangulation.h"
#include "core/store/stage.h"

namespace atelier {

struct ReconstructStageOptions {
  DatasetOptions capture;
  TriangulationOptions keypoints;
  ReconstructOptions scan;
  bool label_by_color = true;  ///< where no label image says what is what
  ColorSplitOptions split;
  double max_left_out = 0.5;  ///< share of the frames that may be without a surface, 0 to 1
  double memory = 8;          ///< GiB: images are halved until the work on one frame fits
};
OptionTable describe(ReconstructStageOptions& options);

/// A capture without its held-out cameras, which no stage may open. Throws as open_dataset, and
/// DataError where it has no calibration or fewer than two cameras are left.
Dataset stage_dataset(const std::filesystem::path& path, const DatasetOptions& options);

/// How often images are halved so that the work on a frame fits into the memory; at most four
/// times. And what to say where they are.
int halvings_for(const Dataset& dataset, double gibibytes);
std::string halvings_text(int halvings, double gibibytes);

/// The views of one frame of a capture, of the cameras that have an image and a mask.
/// @param halvings  times that images and cameras are halved
std::vector<InstantView> instant_of(const Dataset& dataset, int frame, int halvings = 0);

/// Frames of which at least two cameras have an image with a mask.
std::vector<int> frames_with_masks(const Dataset& dataset);

inline constexpr std::array kReconstructMetrics = {
    StageMetric{"keypoints_found", "of the keypoints in the images"},
    StageMetric{"hole_share", "of the surface"},
    StageMetric{"labels_by_color", ""},
    StageMetric{"scans", ""},
    StageMetric{"frames_left_out", ""},
    StageMetric{"cameras", ""},
};

/// A capture -> scans/<frame>.h5 (schema "atelier.mesh": a coloured, labelled surface) and
/// keypoints3d/<frame>.json (EasyMocap's form). Labels come from label images, else from colours
/// alone, which the metric `labels_by_color` says. Held-out cameras are not opened. Without masks
/// there are no scans, without detections no keypoints; it says so. A frame of which nothing can be
/// made (no subject, one view, views that do not meet) has no scan, which is a finding; where more
/// of the frames than `max_left_out` are so, it is a DataError. A file that cannot be read always
/// is.
void run_reconstruct(StageRun& run);

}  // namespace atelier
