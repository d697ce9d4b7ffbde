#include "core/image.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/saturating_cast.h"

namespace atelier {
namespace {

float linear_from_srgb_value(float s) {
  return s <= 0.04045F ? s / 12.92F : std::pow((s + 0.055F) / 1.055F, 2.4F);
}

float srgb_from_linear_value(float l) {
  return l <= 0.0031308F ? 12.92F * l : 1.055F * std::pow(l, 1.0F / 2.4F) - 0.055F;
}

}  // namespace

ByteImage srgb_from_linear(const Image& image) {
  ByteImage bytes(image.width, image.height, image.channels);
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    // min(max(NaN, 0)) is 0: a broken pixel is black, not undefined.
    const float linear = std::min(std::max(0.0F, image.data[i]), 1.0F);
    bytes.data[i] =
        saturating_cast<std::uint8_t>(std::round(255.0F * srgb_from_linear_value(linear)));
  }
  return bytes;
}

Image linear_from_srgb(const ByteImage& image) {
  std::array<float, 256> table{};
  for (int i = 0; i < 256; ++i) {
    table[static_cast<std::size_t>(i)] = linear_from_srgb_value(static_cast<float>(i) / 255.0F);
  }
  Image linear(image.width, image.height, image.channels);
  std::transform(image.data.begin(), image.data.end(), linear.data.begin(),
                 [&](std::uint8_t value) { return table[value]; });
  return linear;
}

}  // namespace atelier
