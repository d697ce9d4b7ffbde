#pragma once

#ifdef ATELIER_HAS_CAPTURE_SURFACE

#include "capture/layouts/open_dataset.h"
#include "capture/surface/reconstruct_scan.h"
#include "capture/triangulation.h"
#include "core/store/stage.h"

namespace atelier {

struct ReconstructStageOptions {
  DatasetOptions capture;
  TriangulationOptions keypoints;
  ReconstructOptions scan;
};
OptionTable describe(ReconstructStageOptions& options);

/// A capture -> scans/<frame>.h5 (schema "atelier.mesh": a coloured, labelled surface) and
/// keypoints3d/<frame>.json (EasyMocap's form). Held-out cameras are not opened. Without masks
/// there are no scans, without detections no keypoints; it says so.
void run_reconstruct(StageRun& run);

}  // namespace atelier

#endif
