#include "core/render/tone.h"

#include <cmath>

#include "core/error.h"

namespace atelier {

Image tone_mapped(const Image& image, const ToneOptions& options) {
  ATELIER_CHECK(options.exposure > 0 && options.exposure <= 1e6, "exposure must lie in (0, 1e6]");
  ATELIER_CHECK(options.shoulder > 0 && options.shoulder < 1, "shoulder must lie in (0, 1)");
  const auto exposure = static_cast<float>(options.exposure);
  const auto a = static_cast<float>(options.shoulder);
  Image result = image;
  for (std::size_t i = 0; i < result.data.size(); ++i) {
    if (image.channels == 4 && i % 4 == 3) {
      continue;
    }
    const float x = exposure * image.data[i];
    result.data[i] = x <= a ? std::max(0.0f, x) : a + (1 - a) * (1 - std::exp((a - x) / (1 - a)));
  }
  return result;
}

}  // namespace atelier
