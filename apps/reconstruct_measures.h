#pragma once

#ifdef ATELIER_HAS_CAPTURE_SURFACE

#include <filesystem>
#include <vector>

#include "capture/capture_measures.h"

namespace atelier {

/// keypoints.* and surface.*, labels.* of a workspace's result against a synthetic capture's truth;
/// none where there is no result.
std::vector<Measure> measure_reconstruct(const std::filesystem::path& workspace,
                                         const std::filesystem::path& truth);

}  // namespace atelier

#endif
