#pragma once

#if defined(ATELIER_HAS_CAPTURE) && defined(ATELIER_HAS_APPEARANCE)

#include <filesystem>
#include <vector>

#include "capture/capture_measures.h"

namespace atelier {

/// appearance.* of a workspace's result of `appearance` against a synthetic capture's truth: every
/// held-out camera in every held-out frame is drawn and compared with the picture without noise,
/// over eroded garment pixels, as 8-bit sRGB. None where there is no result.
std::vector<Measure> measure_appearance(const std::filesystem::path& workspace,
                                        const std::filesystem::path& capture);

}  // namespace atelier

#endif
