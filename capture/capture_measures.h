#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/mesh.h"

namespace atelier {

/// One figure, as `atelier evaluate --json` prints it.
struct Measure {
  std::string key;  ///< "capture.calibration_px"
  double value = 0;
  std::string unit;   ///< "mm", "px", "" for a share
  double target = 0;  ///< what it must not exceed (or fall below)
  enum class Side { None, AtMost, AtLeast } side = Side::None;
  std::string note;  ///< over what it was taken
};

/// True if it has no target, or meets it.
bool is_met(const Measure& measure);

/// How far the calibration, the detections and the labels of a synthetic capture are from its
/// ground truth, and how far its ground truth agrees with itself: "capture.calibration_px" (rms),
/// "capture.keypoint_median_px" (over found points, at 1000 rows), "capture.keypoint_found" (share
/// of points in the image), "capture.label_miou" (over labels present, mean over images),
/// "capture.cloth_depth_mm" (deepest cloth vertex inside the body), "capture.seam_mismatch"
/// (largest difference of the two sides of a seam, as a share). Throws DataError for a capture
/// without ground truth, or one that is not whole.
std::vector<Measure> measure_capture(const std::filesystem::path& capture);

}  // namespace atelier
