#include "capture/detection/person_crop.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr double kSideOfRadius = 2.5;

Eigen::Vector2d turned(const Eigen::Vector2d& vector, double turn) {
  const double c = std::cos(turn);
  const double s = std::sin(turn);
  return {c * vector.x() - s * vector.y(), s * vector.x() + c * vector.y()};
}

}  // namespace

PersonCrop person_crop(const Eigen::Vector2d& hips, const Eigen::Vector2d& above) {
  const Eigen::Vector2d up = above - hips;
  return {hips, kSideOfRadius * up.norm(), std::atan2(up.x(), -up.y())};
}

PersonCrop image_crop(int width, int height) {
  return {{0.5 * width, 0.5 * height}, static_cast<double>(std::max(width, height)), 0};
}

Eigen::Vector2d from_crop(const PersonCrop& crop, const Eigen::Vector2d& point) {
  const Eigen::Vector2d offset = (point - Eigen::Vector2d(0.5, 0.5)) * crop.side;
  return crop.center + turned(offset, crop.turn);
}

Eigen::Vector2d into_crop(const PersonCrop& crop, const Eigen::Vector2d& pixel) {
  return turned(pixel - crop.center, -crop.turn) / crop.side + Eigen::Vector2d(0.5, 0.5);
}

double overlap(const PersonCrop& a, const PersonCrop& b) {
  const auto shared = [&](int axis) {
    const double low = std::max(a.center[axis] - a.side / 2, b.center[axis] - b.side / 2);
    const double high = std::min(a.center[axis] + a.side / 2, b.center[axis] + b.side / 2);
    return std::max(0.0, high - low);
  };
  const double both = shared(0) * shared(1);
  const double either = a.side * a.side + b.side * b.side - both;
  return either > 0 ? both / either : 0;
}

Image sampled_crop(const ByteImage& image, const PersonCrop& crop, int size, float low,
                   float high) {
  ATELIER_CHECK(image.channels == 1 || image.channels == 3, "an image of 1 or 3 channels");
  ATELIER_CHECK(crop.side > 0 && size > 0, "a crop without area");
  Image pixels(size, size, 3);
  const float scale = (high - low) / 255;
  for (int v = 0; v < size; ++v) {
    for (int u = 0; u < size; ++u) {
      const Eigen::Vector2d at =
          from_crop(crop, Eigen::Vector2d((u + 0.5) / size, (v + 0.5) / size));
      float* out = &pixels.at(u, v, 0);
      if (!(at.x() >= 0 && at.y() >= 0 && at.x() < image.width && at.y() < image.height)) {
        std::fill_n(out, 3, low);
        continue;
      }
      const double px = std::clamp(at.x() - 0.5, 0.0, image.width - 1.0);
      const double py = std::clamp(at.y() - 0.5, 0.0, image.height - 1.0);
      const int x0 = saturating_cast<int>(px);
      const int y0 = saturating_cast<int>(py);
      const int x1 = std::min(x0 + 1, image.width - 1);
      const int y1 = std::min(y0 + 1, image.height - 1);
      const auto fx = static_cast<float>(px - x0);
      const auto fy = static_cast<float>(py - y0);
      for (int c = 0; c < 3; ++c) {
        const int from = image.channels == 3 ? c : 0;
        const float top = (1 - fx) * static_cast<float>(image.at(x0, y0, from)) +
                          fx * static_cast<float>(image.at(x1, y0, from));
        const float bottom = (1 - fx) * static_cast<float>(image.at(x0, y1, from)) +
                             fx * static_cast<float>(image.at(x1, y1, from));
        out[c] = low + scale * ((1 - fy) * top + fy * bottom);
      }
    }
  }
  return pixels;
}

}  // namespace atelier
