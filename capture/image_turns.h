#pragma once

#include <Eigen/Core>

#include "core/image.h"

namespace atelier {

/// Clockwise quarter turns by which images of an EXIF orientation (1 to 8) are shown; -1: mirrored.
int quarters_shown(int exif_orientation);

/// The same, of mirrored images the turn alone: [0, 3].
int quarters_upright(int exif_orientation);

/// [W,H] for [H,W] where it is turned by 1 or 3 quarters, clockwise. Any number of turns; negative:
/// the other way.
ByteImage turned_image(const ByteImage& image, int quarters);

/// The pixel of an image that was turned clockwise by quarters, in the image as it was.
/// @param quarters  [0, 3]
/// @param width, height  px, before that turn
Eigen::Vector2d turned_back(const Eigen::Vector2d& pixel, int quarters, int width, int height);

}  // namespace atelier
