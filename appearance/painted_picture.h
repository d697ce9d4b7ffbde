#pragma once

#include <string>

#include "core/archive.h"
#include "core/image.h"

namespace atelier {

/// An image that was drawn, [H,W,4] linear and premultiplied, as an archive of schema
/// "atelier.painted_picture", version 1 (docs/reference/formats.md), and back. Reading throws
/// DataError unless it has `width` x `height` finite pixels, and nothing else.
Archive archive_of_painted(const Image& picture);
Image painted_picture_of(const Archive& archive, int width, int height,
                         const std::string& file = "");

}  // namespace atelier
