#include <algorithm>
#include <cmath>

#include "capture/detector.h"
#include "capture/fabric.h"
#include "capture/label_taxonomy.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

bool on_border(const ByteImage& labels, int x, int y) {
  const std::uint8_t here = labels.at(x, y);
  return (x > 0 && labels.at(x - 1, y) != here) || (y > 0 && labels.at(x, y - 1) != here);
}

}  // namespace

OptionTable describe(LabelNoiseOptions& options) {
  OptionTable table;
  table.add("perfect", options.perfect, "Ground-truth labels without noise")
      .add("wander", options.wander, 0, 100, "px",
           "Amplitude by which borders of labels are displaced")
      .add("erosion", options.erosion, 0, 50, "px", "Width by which the person is eroded in parts")
      .add("patches", options.patches, 0, 1000, "", "Mean number of wrong patches along borders")
      .add("patch_radius", options.patch_radius, 0, 500, "px", "Radius of the largest patch");
  return table;
}

ByteImage detected_labels(const ByteImage& truth, const LabelNoiseOptions& options, Random random) {
  if (options.perfect) {
    return truth;
  }
  const double scale = truth.height / 1000.0;
  const double wander = options.wander * scale;
  const double erosion = options.erosion * scale;
  const double cell = 24 * scale + 4;  // px over which a border strays one way
  const std::uint64_t field = random.seed * 7919 + random.stream * 104729;
  const auto clamped = [&](double x, double y) {
    const int column = std::clamp(saturating_cast<int>(std::floor(x)), 0, truth.width - 1);
    const int row = std::clamp(saturating_cast<int>(std::floor(y)), 0, truth.height - 1);
    return truth.at(column, row);
  };
  const auto background = static_cast<std::uint8_t>(Label::Background);
  // Only pixels near a border can change: the rest is copied.
  const int reach = saturating_cast<int>(std::ceil(1.5 * wander + erosion) + 1);
  ByteImage near(truth.width, truth.height, 1);
  for (int y = 0; y < truth.height; ++y) {
    for (int x = 0; x < truth.width; ++x) {
      if (on_border(truth, x, y)) {
        for (int j = std::max(0, y - reach); j <= std::min(truth.height - 1, y + reach); ++j) {
          std::fill(near.data.begin() + j * truth.width + std::max(0, x - reach),
                    near.data.begin() + j * truth.width + std::min(truth.width, x + reach + 1),
                    std::uint8_t{1});
        }
      }
    }
  }
  ByteImage labels = truth;
  for (int y = 0; y < truth.height; ++y) {
    for (int x = 0; x < truth.width; ++x) {
      if (near.at(x, y) == 0) {
        continue;
      }
      const double dx = wander * value_noise(x / cell, y / cell, 0.5, field);
      const double dy = wander * value_noise(x / cell, y / cell, 7.5, field);
      labels.at(x, y) = clamped(x + 0.5 + dx, y + 0.5 + dy);
      if (labels.at(x, y) != background && value_noise(x / cell, y / cell, 14.5, field) > 0) {
        for (int side = 0; side < 4 && labels.at(x, y) != background; ++side) {
          const double ex = side == 0 ? erosion : side == 1 ? -erosion : 0;
          const double ey = side == 2 ? erosion : side == 3 ? -erosion : 0;
          if (clamped(x + 0.5 + dx + ex, y + 0.5 + dy + ey) == background) {
            labels.at(x, y) = background;
          }
        }
      }
    }
  }
  // Patches: a disk along a border takes the label from across it.
  const int count = static_cast<int>(options.patches * 2 * uniform(random));
  for (int patch = 0; patch < count; ++patch) {
    const double radius = options.patch_radius * scale * (0.3 + 0.7 * uniform(random));
    for (int attempt = 0; attempt < 400; ++attempt) {
      const int x = static_cast<int>(uniform_index(random, truth.width));
      const int y = static_cast<int>(uniform_index(random, truth.height));
      if (!on_border(truth, x, y)) {
        continue;
      }
      const std::uint8_t other = x > 0 && truth.at(x - 1, y) != truth.at(x, y)
                                     ? truth.at(x - 1, y)
                                     : clamped(x + 0.5, y - 0.5);
      const int r = saturating_cast<int>(radius);
      for (int j = std::max(0, y - r); j <= std::min(truth.height - 1, y + r); ++j) {
        for (int i = std::max(0, x - r); i <= std::min(truth.width - 1, x + r); ++i) {
          if (std::hypot(i - x, j - y) <= radius) {
            labels.at(i, j) = other;
          }
        }
      }
      break;
    }
  }
  return labels;
}

}  // namespace atelier
