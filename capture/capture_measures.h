#pragma once

#include <filesystem>
#include <vector>

#include "core/measure.h"

namespace atelier {

/// How far the calibration, the detections and the labels of a synthetic capture are from its
/// ground truth, and how far its ground truth agrees with itself: "capture.calibration_px" (rms),
/// "capture.keypoint_median_px" (over found points, at 1000 rows), "capture.keypoint_found" (share
/// of points in the image), "capture.label_miou" (over labels present, mean over images),
/// "capture.cloth_depth_mm" (deepest cloth vertex inside the body), "capture.seam_mismatch"
/// (largest difference of the two sides of a seam, as a share). Throws DataError for a capture
/// without ground truth, or one that is not whole.
std::vector<Measure> measure_capture(const std::filesystem::path& capture);

}  // namespace atelier
