#pragma once

#include "core/image.h"

namespace atelier {

/// Share of a mask's pixels that are set, [0,1]; 0 of an empty mask.
/// @param rim  of those along the image's edge alone, a fiftieth of its shorter side wide
double set_share(const ByteImage& mask, bool rim);

}  // namespace atelier
