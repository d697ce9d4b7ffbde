#pragma once

#include "core/image.h"

namespace atelier {

/// A premultiplied image of four channels for files, which want colours that are not.
inline Image straight_alpha(const Image& picture) {
  Image straight = picture;
  for (std::size_t i = 0; i + 3 < straight.data.size(); i += 4) {
    for (std::size_t c = 0; c < 3 && straight.data[i + 3] > 0; ++c) {
      straight.data[i + c] /= straight.data[i + 3];
    }
  }
  return straight;
}

/// Its colours before black, without the fourth channel.
inline Image before_black(const Image& picture) {
  Image colors(picture.width, picture.height, 3);
  for (std::size_t p = 0; p < colors.data.size(); ++p) {
    colors.data[p] = picture.data[4 * (p / 3) + p % 3];
  }
  return colors;
}

}  // namespace atelier
