#pragma once

#include <cstdint>
#include <vector>

namespace atelier {

/// A raster, rows from the top, channels interleaved: pixel (x, y) channel c is
/// `data[(y * width + x) * channels + c]`.
template <class T>
struct ImageOf {
  int width = 0;
  int height = 0;
  int channels = 0;
  std::vector<T> data;

  ImageOf() = default;
  ImageOf(int width_, int height_, int channels_, T value = T{})
      : width(width_),
        height(height_),
        channels(channels_),
        data(static_cast<std::size_t>(width_) * height_ * channels_, value) {}

  T& at(int x, int y, int c = 0) {
    return data[(static_cast<std::size_t>(y) * width + x) * channels + c];
  }
  const T& at(int x, int y, int c = 0) const {
    return data[(static_cast<std::size_t>(y) * width + x) * channels + c];
  }
};

/// Linear RGB (or one channel) in [0,1].
using Image = ImageOf<float>;
/// Labels, masks, or sRGB bytes as a file holds them.
using ByteImage = ImageOf<std::uint8_t>;

/// Linear light to 8-bit sRGB (IEC 61966-2-1), rounded to nearest; clamps.
ByteImage srgb_from_linear(const Image& image);

/// 8-bit sRGB to linear light.
Image linear_from_srgb(const ByteImage& image);

}  // namespace atelier
