#pragma once

namespace atelier {

/// The extensions of images that can be written, as an error says them.
inline constexpr const char* kPictureNames = ".png, .jpg, .tif, .webp, .bmp or .avif";

}  // namespace atelier
