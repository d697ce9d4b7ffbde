#include "capture/silhouettes.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr int kAcross = 12;  // pixels of a mask that are asked, across and down its image
constexpr int kPlaces = 96;  // on a ray
constexpr double kRayBegin = 0.3;
constexpr double kRayEnd = 2;

bool is_on(const ByteImage& mask, double x, double y) {
  return mask.at(saturating_cast<int>(x), saturating_cast<int>(y)) != 0;
}

/// Whether the others have a place on their masks.
bool others_agree(std::span<const Camera> cameras, std::span<const ByteImage> masks,
                  std::size_t own, const Eigen::Vector3d& place) {
  int seen = 0;
  int inside = 0;
  int possible = 0;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    if (c == own || masks[c].width == 0) {
      continue;
    }
    ++possible;
    const auto pixel = project(cameras[c], place);
    if (!pixel || !(pixel->x() >= 0 && pixel->x() < masks[c].width && pixel->y() >= 0 &&
                    pixel->y() < masks[c].height)) {
      continue;
    }
    ++seen;
    inside += is_on(masks[c], pixel->x(), pixel->y()) ? 1 : 0;
  }
  constexpr double kMost = 0.9;
  return seen >= std::min(2, possible) && seen > 0 && inside >= kMost * seen;
}

/// The rows and columns of a mask between which it is set.
struct Extent {
  int left = 0, right = -1, top = 0, bottom = -1;
};

Extent extent_of(const ByteImage& mask) {
  Extent extent{mask.width, -1, mask.height, -1};
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      if (mask.at(x, y) != 0) {
        extent = {std::min(extent.left, x), std::max(extent.right, x), std::min(extent.top, y),
                  std::max(extent.bottom, y)};
      }
    }
  }
  return extent;
}

}  // namespace

double silhouette_agreement(std::span<const Camera> cameras, std::span<const ByteImage> masks,
                            const Eigen::Vector3d& middle) {
  ATELIER_CHECK(cameras.size() == masks.size(), "a mask for each camera, or an empty one");
  double sum = 0;
  int views = 0;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const Extent extent = extent_of(masks[c]);
    const double distance = (middle - camera_center(cameras[c])).norm();
    int asked = 0;
    int agreed = 0;
    for (int i = 0; i < kAcross * kAcross && extent.right >= extent.left; ++i) {
      const double x =
          extent.left + (i % kAcross + 0.5) / kAcross * (extent.right + 1 - extent.left);
      const double y =
          extent.top + (i / kAcross + 0.5) / kAcross * (extent.bottom + 1 - extent.top);
      const auto ray = is_on(masks[c], x, y) ? ray_direction(cameras[c], {x, y}) : std::nullopt;
      if (!ray) {
        continue;
      }
      ++asked;
      for (int k = 0; k < kPlaces; ++k) {
        const double depth = distance * (kRayBegin + (kRayEnd - kRayBegin) * (k + 0.5) / kPlaces);
        if (others_agree(cameras, masks, c, camera_center(cameras[c]) + depth * *ray)) {
          ++agreed;
          break;
        }
      }
    }
    if (asked > 0) {
      sum += static_cast<double>(agreed) / asked;
      ++views;
    }
  }
  return views > 1 ? sum / views : 0;
}

}  // namespace atelier
