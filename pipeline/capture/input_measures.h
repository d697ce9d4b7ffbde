#pragma once

#include <filesystem>
#include <vector>

#include "core/measure.h"

namespace atelier {

/// "masks.iou" and "masks.iou_min": the masks FOLDER/labels/<camera>/<frame>.png, as `atelier masks
/// --out FOLDER` writes them, against the person in the ground truth of a synthetic capture. Images
/// that have no mask are left out and counted in the note. Throws DataError where there is none at
/// all, or one of another size.
std::vector<Measure> measure_masks(const std::filesystem::path& folder,
                                   const std::filesystem::path& capture);

/// "calibration.gain_mean" and "calibration.gain_largest": gains of a cameras.json, as `atelier
/// calibrate-color` writes it, against the true ones (gain_error), as shares.
std::vector<Measure> measure_gains(const std::filesystem::path& cameras,
                                   const std::filesystem::path& capture);

}  // namespace atelier
