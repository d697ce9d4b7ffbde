#include "capture/surface/stereo_image.h"

#include <algorithm>
#include <cmath>

namespace atelier {

Image stereo_image(const Image& image) {
  Image value(image.width, image.height, 1);
  for (std::size_t p = 0; p < value.data.size(); ++p) {
    const float* rgb = &image.data[3 * p];
    const float luminance = 0.3F * rgb[0] + 0.6F * rgb[1] + 0.1F * rgb[2];
    const float most = std::max({rgb[0], rgb[1], rgb[2], 1e-4F});
    const float difference = most - std::min({rgb[0], rgb[1], rgb[2]});
    constexpr float kGrey = 0.15F;     // saturation up to which brightness counts alone
    constexpr float kColoured = 0.4F;  // from which the difference does
    constexpr float kScale = 2;        // of the difference, to be about as large as brightness
    const float t = std::clamp((difference / most - kGrey) / (kColoured - kGrey), 0.0F, 1.0F);
    const float blend = t * t * (3 - 2 * t);
    const float mixed = luminance + blend * (kScale * difference - luminance);
    value.data[p] = std::pow(std::clamp(mixed, 0.0F, 1.0F), 1 / 2.2F);
  }
  return value;
}

}  // namespace atelier
