#include "capture/garment_fabric.h"

#include <algorithm>
#include <cmath>

namespace atelier {

FabricOptions garment_fabric(FabricOptions fabric, const std::vector<GroundTruthGarment>& worn,
                             std::size_t garment) {
  if (fabric.kind == FabricKind::Print && worn.size() > 1 && worn[garment].label == Label::Lower) {
    fabric.kind = FabricKind::Woven;  // under a printed top people wear plain trousers
    fabric.lightness *= 0.6;
  } else if (fabric.kind == FabricKind::AllPrint) {
    fabric.kind = FabricKind::Print;
  }
  fabric.hue = std::fmod(fabric.hue + 0.37 * static_cast<double>(garment), 1.0);
  if (garment > 0) {
    fabric.lightness = std::clamp(1.35 * fabric.lightness, 0.02, 0.9);
    fabric.saturation *= 0.8;
  }
  return fabric;
}

}  // namespace atelier
