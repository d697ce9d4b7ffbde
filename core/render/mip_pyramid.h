#pragma once

#include <vector>

#include "core/image.h"
#include "core/render/vector_math.h"

namespace atelier {

/// A texture and its halves, quarters, ... down to one pixel, each the mean of the one before over
/// its area. 3 channels, linear.
struct MipPyramid {
  std::vector<Image> levels;  ///< [0] is the texture
};

/// Throws LogicError unless the image has 3 channels and at least one pixel.
MipPyramid mip_pyramid(const Image& image);

/// Colour at texture coordinates (v up, repeated), bilinear in two levels and linear between them.
/// `footprint` is the width of what the sample stands for, in texels of level 0.
Vec3f texture_color(const MipPyramid& pyramid, float u, float v, float footprint);

}  // namespace atelier
