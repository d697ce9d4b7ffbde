#include "capture/stereo/halved.h"

#include <algorithm>

namespace atelier {

Image halved(const Image& image) {
  Image half((image.width + 1) / 2, (image.height + 1) / 2, image.channels);
  for (int y = 0; y < half.height; ++y) {
    const int y1 = std::min(2 * y + 1, image.height - 1);
    for (int x = 0; x < half.width; ++x) {
      const int x1 = std::min(2 * x + 1, image.width - 1);
      for (int c = 0; c < image.channels; ++c) {
        half.at(x, y, c) = 0.25F * (image.at(2 * x, 2 * y, c) + image.at(x1, 2 * y, c) +
                                    image.at(2 * x, y1, c) + image.at(x1, y1, c));
      }
    }
  }
  return half;
}

Camera halved(const Camera& camera) {
  Camera half = camera;
  half.width = (camera.width + 1) / 2;
  half.height = (camera.height + 1) / 2;
  half.fx /= 2;
  half.fy /= 2;
  half.cx /= 2;
  half.cy /= 2;
  return half;
}

ByteImage halved(const ByteImage& image) {
  ByteImage half((image.width + 1) / 2, (image.height + 1) / 2, image.channels);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      for (int c = 0; c < image.channels; ++c) {
        std::uint8_t& most = half.at(x / 2, y / 2, c);
        most = std::max(most, image.at(x, y, c));
      }
    }
  }
  return half;
}

}  // namespace atelier
