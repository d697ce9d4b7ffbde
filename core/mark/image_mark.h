#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/image.h"

namespace atelier {

/// An invisible mark of 64 bits in an image: a pattern of waves with periods of 9 to 38 pixels that
/// repeats every 192 pixels, added to red, green and blue alike, stronger where the image is busy
/// (after Alattar and Meyer, "Watermark re-synchronization using log-polar mapping of image
/// autocorrelation", 2003, but that known waves say where the pattern lies, not autocorrelation).
/// Which image sizes and what changes it survives: docs/results/marks.md.
class ImageMark {
 public:
  explicit ImageMark(std::uint64_t bits);

  /// Marks sRGB bytes of 3 channels, or 4 with alpha, which stays; what is wholly transparent too.
  /// Throws LogicError for other channels.
  void add_to(ByteImage& image) const;

 private:
  std::vector<float> tile_;
};

/// Brightness of sRGB bytes (BT.709 weights of the bytes themselves), [height, width, 1] in
/// [0, 255]: what marks are looked for in. Of 1, 3 or 4 channels; alpha is left out.
ImageOf<float> mark_brightness(const ByteImage& image);

struct MarkSearchOptions {
  double smallest = 0.28;  ///< of the size that the image had when it was marked
  double largest = 2.1;    ///< the same
};

struct FoundMark {
  std::uint64_t bits = 0;
  double size = 1;   ///< of what was marked: 0.5 where the image has half its pixels a side
  double pilot = 0;  ///< how far the pattern's place stands out, in standard deviations of chance
};

/// Result of a search, found or not.
struct MarkSearch {
  std::optional<FoundMark> found;
  /// Checksum of each place that was decoded, less that of its bits: 0 where it is a mark. Of an
  /// image without one each is a random number of 32 bits.
  std::vector<std::uint32_t> tried;
};

/// At most so many places are decoded, each of which chance makes a mark once in 2^32: an image
/// without a mark is said to have one with a probability of at most 5.6e-9.
inline constexpr int kMarkTries = 24;

/// Looks for a mark in the brightness of an image, or in the mean of a film's frames. Turned,
/// mirrored or bent images are not looked through. Cost: a tenth of a second where the image has
/// its size or a common part of it; a second or two where it has any other, or no mark.
MarkSearch find_mark(const ImageOf<float>& brightness, const MarkSearchOptions& options = {});

}  // namespace atelier
