#pragma once

#include "core/image.h"

namespace atelier {

/// One channel, gamma-coded: noise is then nearly even over brightness. Of coloured surfaces the
/// length of what is orthogonal to white (Mallick 2005, section 2) instead of the brightness: a
/// gloss of white light, which wanders over the surface with the view and lies behind round limbs,
/// adds the same to all channels. The blend is our choice. Where channels do not differ by well
/// more than the noise of a sensor, as on dark cloth, brightness counts alone.
/// @param image  [H,W,3] linear RGB
Image stereo_image(const Image& image);

}  // namespace atelier
