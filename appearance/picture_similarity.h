#pragma once

#include "core/image.h"

namespace atelier {

/// Structural similarity of two images with values in [0,1] (Wang et al., "Image quality
/// assessment: from error visibility to structural similarity", 2004: Gaussian window of 11 x 11
/// with deviation 1.5, constants 0.01 and 0.03), mean over all channels of the pixels where `mask`
/// is not 0. Windows count these pixels alone, so that what lies beside them is not compared. 1 for
/// images that agree; 1 where the mask is empty. Throws LogicError for images of differing
/// size. O(pixels of the mask x 121).
double structural_similarity(const Image& a, const Image& b, const ByteImage& mask);

}  // namespace atelier
