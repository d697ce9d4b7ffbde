#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/mark/image_mark.h"
#include "core/mark/mark_pattern.h"
#include "core/parallel.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr int kBlock = 8;  // pixels: where the image is busy is known this finely
// Root mean square of the mark in grey levels: on an even surface, and how much of what the image
// itself varies by; at most.
constexpr float kQuiet = 1.0f;
constexpr float kOfBusy = 0.16f;
constexpr float kMost = 3.2f;
constexpr Index kRowsAtOnce = 64;

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
  parallel_for(blocks.height, kRowsAtOnce / kBlock, [&](Index begin, Index end) {
    for (int by = static_cast<int>(begin); by < end; ++by) {
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
  });
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

/// The strength of each row of blocks at each pixel's place along it.
ImageOf<float> spread_along_rows(const ImageOf<float>& strength, int width) {
  std::vector<BlockPlace> columns;
  for (int x = 0; x < width; ++x) {
    columns.push_back(block_place(x, strength.width));
  }
  ImageOf<float> along(width, strength.height, 1);
  for (int y = 0; y < strength.height; ++y) {
    for (int x = 0; x < width; ++x) {
      const BlockPlace& column = columns[static_cast<std::size_t>(x)];
      along.at(x, y) =
          std::lerp(strength.at(column.before, y), strength.at(column.behind, y), column.share);
    }
  }
  return along;
}

}  // namespace

ImageMark::ImageMark(std::uint64_t bits) : tile_(mark_tile(bits)) {}

void ImageMark::add_to(ByteImage& image) const {
  ATELIER_CHECK(image.channels == 3 || image.channels == 4, "a marked image has colours");
  const ImageOf<float> strength = strengths(busyness(image));
  const ImageOf<float> along = spread_along_rows(strength, image.width);
  parallel_for(image.height, kRowsAtOnce, [&](Index begin, Index end) {
    for (int y = static_cast<int>(begin); y < end; ++y) {
      const BlockPlace row = block_place(y, strength.height);
      const float* before = &along.at(0, row.before);
      const float* behind = &along.at(0, row.behind);
      const float* tile = tile_.data() + std::ptrdiff_t{y % kMarkTile} * kMarkTile;
      std::uint8_t* pixel = &image.at(0, y);
      for (int x = 0; x < image.width; ++x, pixel += image.channels) {
        if (image.channels == 4 && pixel[3] == 0) {
          continue;
        }
        const float change = tile[x % kMarkTile] * std::lerp(before[x], behind[x], row.share);
        const int whole = saturating_cast<int>(std::floor(change + 0.5f));
        for (int c = 0; c < 3; ++c) {
          pixel[c] = static_cast<std::uint8_t>(std::clamp(pixel[c] + whole, 0, 255));
        }
      }
    }
  });
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
