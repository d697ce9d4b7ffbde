#pragma once

#include <functional>
#include <string>
#include <vector>

#include "capture/dataset.h"
#include "capture/surface/color_samples.h"
#include "pipeline/capture/reconstruct_stage.h"

namespace atelier {

/// Colours of points of several frames, as their cameras see them.
struct SampledColors {
  std::vector<ColorSample> samples;  ///< points numbered through, cameras as the data set has them
  int frames = 0;                    ///< that were used
};

/// Colours of `frames` frames, evenly over those with masks or labels. A frame without a surface is
/// left out, which `say` is told. Throws DataError for a data set without masks and labels, for
/// damaged files, and where no frame has a surface.
/// @param name  of the capture, for errors
SampledColors sample_colors(const Dataset& dataset, const std::string& name, int frames,
                            const ReconstructOptions& reconstruct,
                            const CoarseReconstructionOptions& options,
                            const std::function<void(const std::string&)>& say);

}  // namespace atelier
