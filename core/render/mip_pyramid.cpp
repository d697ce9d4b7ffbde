#include "core/render/mip_pyramid.h"

#include "core/error.h"
#include "core/saturating_cast.h"

namespace atelier {

namespace {

Image half(const Image& image) {
  Image result(std::max(1, image.width / 2), std::max(1, image.height / 2), 3);
  // Sides need not be even: each small pixel averages the texels under it, cut ones by their share.
  const float sx = static_cast<float>(image.width) / static_cast<float>(result.width);
  const float sy = static_cast<float>(image.height) / static_cast<float>(result.height);
  for (int y = 0; y < result.height; ++y) {
    const float y0 = static_cast<float>(y) * sy;
    const float y1 = static_cast<float>(y + 1) * sy;
    for (int x = 0; x < result.width; ++x) {
      const float x0 = static_cast<float>(x) * sx;
      const float x1 = static_cast<float>(x + 1) * sx;
      Vec3f sum{0, 0, 0};
      float area = 0;
      for (int j = saturating_cast<int>(y0); j < image.height && static_cast<float>(j) < y1; ++j) {
        const float wy =
            std::min(y1, static_cast<float>(j + 1)) - std::max(y0, static_cast<float>(j));
        for (int i = saturating_cast<int>(x0); i < image.width && static_cast<float>(i) < x1; ++i) {
          const float wx =
              std::min(x1, static_cast<float>(i + 1)) - std::max(x0, static_cast<float>(i));
          sum += (wx * wy) * Vec3f{image.at(i, j, 0), image.at(i, j, 1), image.at(i, j, 2)};
          area += wx * wy;
        }
      }
      result.at(x, y, 0) = sum.x / area;
      result.at(x, y, 1) = sum.y / area;
      result.at(x, y, 2) = sum.z / area;
    }
  }
  return result;
}

int wrapped(int i, int n) {
  const int r = i % n;
  return r < 0 ? r + n : r;
}

Vec3f bilinear(const Image& image, float u, float v) {
  const float x = u * static_cast<float>(image.width) - 0.5f;
  const float y = (1 - v) * static_cast<float>(image.height) - 0.5f;
  const float x_floor = std::floor(x);
  const float y_floor = std::floor(y);
  const float fx = x - x_floor;
  const float fy = y - y_floor;
  const int x0 = wrapped(saturating_cast<int>(x_floor), image.width);
  const int y0 = wrapped(saturating_cast<int>(y_floor), image.height);
  const int x1 = x0 + 1 == image.width ? 0 : x0 + 1;
  const int y1 = y0 + 1 == image.height ? 0 : y0 + 1;
  const auto texel = [&](int i, int j) {
    const float* p = &image.at(i, j);
    return Vec3f{p[0], p[1], p[2]};
  };
  return mix(mix(texel(x0, y0), texel(x1, y0), fx), mix(texel(x0, y1), texel(x1, y1), fx), fy);
}

}  // namespace

MipPyramid mip_pyramid(const Image& image) {
  ATELIER_CHECK(image.channels == 3 && image.width > 0 && image.height > 0,
                "a texture needs 3 channels and at least one pixel");
  MipPyramid pyramid;
  pyramid.levels.push_back(image);
  while (pyramid.levels.back().width > 1 || pyramid.levels.back().height > 1) {
    pyramid.levels.push_back(half(pyramid.levels.back()));
  }
  return pyramid;
}

Vec3f texture_color(const MipPyramid& pyramid, float u, float v, float footprint) {
  // Whole turns off first: far outside the square floats have no digits left for the fraction.
  u -= std::floor(u);
  v -= std::floor(v);
  const float level = std::log2(std::max(1.0f, footprint));
  const int last = static_cast<int>(pyramid.levels.size()) - 1;
  const int low = std::min(saturating_cast<int>(level), last);
  const float fraction = std::min(level - static_cast<float>(low), 1.0f);
  const Vec3f fine = bilinear(pyramid.levels[low], u, v);
  if (low == last || fraction <= 0) {
    return fine;
  }
  return mix(fine, bilinear(pyramid.levels[low + 1], u, v), fraction);
}

}  // namespace atelier
