#pragma once

#include <vector>

#include "capture/surface/color_gains.h"
#include "capture/surface/small_scan.h"

namespace atelier {

/// The colour that each view's picture has at the places that it sees: as taken, gain not removed,
/// weighted by the cosine of the view; cameras are numbered as the scan's views.
std::vector<ColorSample> color_samples(const SmallScan& scan);

/// The same of views whose surface is not known yet. Throws as small_scan.
std::vector<ColorSample> color_samples(const std::vector<InstantView>& views,
                                       const ReconstructOptions& reconstruct = {},
                                       const SmallScanOptions& options = {},
                                       Device device = Device::Cpu);

}  // namespace atelier
