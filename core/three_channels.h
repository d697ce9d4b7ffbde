#pragma once

#include <cstddef>

#include "core/image.h"

namespace atelier {

/// A grey image with its value in three channels; every other as it is.
/// @tparam Picture  Image or ByteImage
template <typename Picture>
Picture in_three_channels(Picture picture) {
  if (picture.channels != 1) {
    return picture;
  }
  Picture colors(picture.width, picture.height, 3);
  for (std::size_t i = 0; i < colors.data.size(); ++i) {
    colors.data[i] = picture.data[i / 3];
  }
  return colors;
}

}  // namespace atelier
