#pragma once

#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL_TRACKING)

#include <filesystem>
#include <vector>

#include "capture/capture_measures.h"

namespace atelier {

/// personal.* of a workspace's result of `personalize` against a synthetic capture's truth; none
/// where there is no result.
std::vector<Measure> measure_personalize(const std::filesystem::path& workspace,
                                         const std::filesystem::path& capture);

/// track.* of its result of `track`. Where a region of dynamic clothing was found, the clothed
/// sequences are tracked again with exclude = none and with exclude = labels, all else as it was.
std::vector<Measure> measure_track(const std::filesystem::path& workspace,
                                   const std::filesystem::path& capture);

}  // namespace atelier

#endif
