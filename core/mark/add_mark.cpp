#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/mark/image_mark.h"
#include "core/mark/mark_pattern.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr int kBlock = 8;  // pixels: where the image is busy is known this finely
// Root mean square of the mark in grey levels: on an even surface, and how much of what the image
// itself varies by; at most.
constexpr float kQuiet = 1.0f;
constexpr float kOfBusy = 0.16f;
constexpr float kMost = 3.2f;

float brightness_at(const ByteImage& image, int x, int y) {
  if (image.channels == 1) {
    return image.at(x, y);
  }
  return 0.2126f * image.at(x, y, 0) + 0.7152f * image.at(x, y, 1) + 0.0722f * image.at(x, y, 2);
}

/// Standard deviation of the brightness in each block.
ImageOf<float> busyness(const ByteImage& image) {
  ImageOf<float> blocks((image.width + kBlock - 1) / kBlock, (image.height + kBlock - 1) / kBlock,
                        1);
  for (int by = 0; by < blocks.height; ++by) {
    for (int bx = 0; bx < blocks.width; ++bx) {
      float sum = 0;
      float squares = 0;
      float count = 0;
      for (int y = by * kBlock; y < std::min(image.height, (by + 1) * kBlock); ++y) {
        for (int x = bx * kBlock; x < std::min(image.width, (bx + 1) * kBlock); ++x) {
          const float value = brightness_at(image, x, y);
          sum += value;
          squares += value * value;
          ++count;
        }
      }
      blocks.at(bx, by) =
          std::sqrt(std::max(0.0f, squares / count - (sum / count) * (sum / count)));
    }
  }
  return blocks;
}

/// How strong the mark is in each block: as its quietest neighbour bears, so that nothing shows
/// beside an edge.
ImageOf<float> strengths(const ImageOf<float>& busy) {
  ImageOf<float> strength(busy.width, busy.height, 1);
  for (int y = 0; y < busy.height; ++y) {
    for (int x = 0; x < busy.width; ++x) {
      float least = busy.at(x, y);
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          least = std::min(least, busy.at(std::clamp(x + dx, 0, busy.width - 1),
                                          std::clamp(y + dy, 0, busy.height - 1)));
        }
      }
      strength.at(x, y) = std::min(kMost, kQuiet + kOfBusy * least);
    }
  }
  return strength;
}

/// The weight of the block behind, and of which two blocks a pixel lies between.
struct BlockPlace {
  int before = 0;
  int behind = 0;
  float share = 0;
};

BlockPlace block_place(int pixel, int blocks) {
  const float at = (static_cast<float>(pixel) + 0.5f) / kBlock - 0.5f;
  const float before = std::floor(at);
  const int first = saturating_cast<int>(before);
  return {std::clamp(first, 0, blocks - 1), std::clamp(first + 1, 0, blocks - 1), at - before};
}

}  // namespace

ImageMark::ImageMark(std::uint64_t bits) : tile_(mark_tile(bits)) {}

void ImageMark::add_to(ByteImage& image) const {
  ATELIER_CHECK(image.channels == 3 || image.channels == 4, "a marked image has colours");
  const ImageOf<float> strength = strengths(busyness(image));
  std::vector<BlockPlace> columns;
  for (int x = 0; x < image.width; ++x) {
    columns.push_back(block_place(x, strength.width));
  }
  for (int y = 0; y < image.height; ++y) {
    const BlockPlace row = block_place(y, strength.height);
    const float* tile = tile_.data() + std::ptrdiff_t{y % kMarkTile} * kMarkTile;
    for (int x = 0; x < image.width; ++x) {
      if (image.channels == 4 && image.at(x, y, 3) == 0) {
        continue;
      }
      const BlockPlace& column = columns[static_cast<std::size_t>(x)];
      const auto between = [&](int block_y) {
        return std::lerp(strength.at(column.before, block_y), strength.at(column.behind, block_y),
                         column.share);
      };
      const float change =
          tile[x % kMarkTile] * std::lerp(between(row.before), between(row.behind), row.share);
      const int whole = saturating_cast<int>(std::floor(change + 0.5f));
      for (int c = 0; c < 3; ++c) {
        std::uint8_t& value = image.at(x, y, c);
        value = static_cast<std::uint8_t>(std::clamp(value + whole, 0, 255));
      }
    }
  }
}

ImageOf<float> mark_brightness(const ByteImage& image) {
  ImageOf<float> brightness(image.width, image.height, 1);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      brightness.at(x, y) = brightness_at(image, x, y);
    }
  }
  return brightness;
}

}  // namespace atelier
