#pragma once

#include "core/camera.h"
#include "core/image.h"

namespace atelier {

/// Half the size, rounded up: each pixel the mean of four. [H,W,C] -> [(H+1)/2,(W+1)/2,C].
Image halved(const Image& image);

/// The camera of a halved image; the lens bends the same.
Camera halved(const Camera& camera);

/// A mask or labels at half the size: of each four pixels the greatest.
ByteImage halved(const ByteImage& image);

}  // namespace atelier
