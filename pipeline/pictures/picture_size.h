#pragma once

#include <cstdint>
#include <string>

#include "core/limits.h"
#include "core/render/studio.h"
#include "core/usage_error.h"

namespace atelier {

/// Refuses `count` images side by side whose pixels no reader would accept, before anything is
/// read or rendered. Throws UsageError.
inline void require_picture_size(const PictureOptions& picture, std::int64_t count = 1) {
  const std::int64_t pixels = std::int64_t{picture.width} * picture.height * count;
  const std::int64_t most = Limits{}.image_pixels;
  if (pixels > most) {
    throw UsageError((count > 1 ? std::to_string(count) + " images of " : std::string()) +
                     "--width " + std::to_string(picture.width) + " times --height " +
                     std::to_string(picture.height) + " are " + std::to_string(pixels) +
                     " pixels: at most " + std::to_string(most));
  }
}

}  // namespace atelier
