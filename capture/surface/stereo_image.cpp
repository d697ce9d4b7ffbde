#include "capture/surface/stereo_image.h"

#include <algorithm>
#include <cmath>

#include "core/smooth_step.h"

namespace atelier {

Image stereo_image(const Image& image) {
  Image value(image.width, image.height, 1);
  for (std::size_t p = 0; p < value.data.size(); ++p) {
    const float* rgb = &image.data[3 * p];
    const float luminance = 0.3F * rgb[0] + 0.6F * rgb[1] + 0.1F * rgb[2];
    const float most = std::max({rgb[0], rgb[1], rgb[2], 1e-4F});
    const float difference = most - std::min({rgb[0], rgb[1], rgb[2]});
    const float mean = (rgb[0] + rgb[1] + rgb[2]) / 3;
    const float across = std::hypot(rgb[0] - mean, rgb[1] - mean, rgb[2] - mean);
    constexpr float kGrey = 0.15F;     // saturation up to which brightness counts alone
    constexpr float kColoured = 0.4F;  // from which the difference does
    // A dark surface that is hardly coloured would else be brightness here and difference there, as
    // gloss and noise have it, which no two views see alike. Shot noise grows as the root of light.
    constexpr float kFaint = 0.08F;  // of the difference over the root of the brightest channel:
                                     // ten deviations of a common sensor (0.005 at full light)
    constexpr float kClear = 0.16F;
    constexpr float kScale = 2.7F;  // of what is across white, to be about as large as brightness
    const double blend = smooth_step(difference / most, kGrey, kColoured) *
                         smooth_step(difference / std::sqrt(most), kFaint, kClear);
    const float mixed = luminance + static_cast<float>(blend) * (kScale * across - luminance);
    value.data[p] = std::pow(std::clamp(mixed, 0.0F, 1.0F), 1 / 2.2F);
  }
  return value;
}

}  // namespace atelier
