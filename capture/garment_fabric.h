#pragma once

#include <cstddef>
#include <vector>

#include "capture/fabric.h"
#include "core/io/ground_truth_archive.h"

namespace atelier {

/// The cloth of one garment of a synthetic outfit. Each has a hue of its own; under a printed top
/// what is worn on the legs is woven, unless all is printed.
FabricOptions garment_fabric(FabricOptions outfit, const std::vector<GroundTruthGarment>& worn,
                             std::size_t garment);

}  // namespace atelier
