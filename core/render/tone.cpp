#include "core/render/tone.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/random.h"

namespace atelier {

namespace {

// How much linear light one step of 8-bit sRGB is worth: the slope of IEC 61966-2-1's curve.
float srgb_step(float linear) {
  const float slope =
      linear <= 0.0031308f ? 1 / 12.92f : 2.4f / 1.055f * std::pow(linear, 1 - 1 / 2.4f);
  return slope / 255;
}

// Uniform in [-0.5, 0.5), one value per number of the picture.
float noise(std::size_t i) {
  return static_cast<float>(random_words(0, 0, i).word[0] >> 8) * 0x1p-24f - 0.5f;
}

}  // namespace

Image tone_mapped(const Image& image, const ToneOptions& options) {
  ATELIER_CHECK(options.exposure > 0 && options.exposure <= 1e6, "exposure must lie in (0, 1e6]");
  ATELIER_CHECK(options.shoulder > 0 && options.shoulder < 1, "shoulder must lie in (0, 1)");
  ATELIER_CHECK(options.dither >= 0 && options.dither <= 4, "dither must lie in [0, 4]");
  const auto exposure = static_cast<float>(options.exposure);
  const auto a = static_cast<float>(options.shoulder);
  Image result = image;
  for (std::size_t i = 0; i < result.data.size(); ++i) {
    if (image.channels == 4 && i % 4 == 3) {
      continue;
    }
    const float x = exposure * image.data[i];
    float y = x <= a ? std::max(0.0f, x) : a + (1 - a) * (1 - std::exp((a - x) / (1 - a)));
    if (options.dither > 0) {
      y = std::clamp(y + noise(i) * static_cast<float>(options.dither) * srgb_step(y), 0.0f, 1.0f);
    }
    result.data[i] = y;
  }
  return result;
}

}  // namespace atelier
