#pragma once

#include <filesystem>
#include <vector>

#include "core/measure.h"

namespace atelier {

/// flatten.stretch_p99, flatten.seam_mismatch, flatten.inverted (triangles turned over and panels
/// over themselves), flatten.panels and flatten.seam_ratio of a workspace's result, measured again
/// from its garment.obj, against the pattern of that garment of a synthetic capture's ground truth
/// whose area is nearest; none where there is no result.
std::vector<Measure> measure_flatten(const std::filesystem::path& workspace,
                                     const std::filesystem::path& truth);

}  // namespace atelier
