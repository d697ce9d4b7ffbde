#pragma once

#include <vector>

#include "capture/surface/coarse_reconstruction.h"
#include "capture/surface/color_gains.h"

namespace atelier {

/// The colour that each view's image has at the places that it sees: as taken, gain not removed,
/// weighted by the cosine of the view; cameras are numbered as the scan's views.
std::vector<ColorSample> color_samples(const CoarseReconstruction& scan);

/// The same of views whose surface is not known yet. Throws as coarse_reconstruction.
std::vector<ColorSample> color_samples(const std::vector<InstantView>& views,
                                       const ReconstructOptions& reconstruct = {},
                                       const CoarseReconstructionOptions& options = {},
                                       Device device = Device::Cpu);

}  // namespace atelier
