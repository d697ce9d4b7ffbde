#pragma once

#include "core/image.h"

namespace atelier {

struct ToneOptions {
  double exposure = 1;    ///< factor on the light, (0, 1e6]
  double shoulder = 0.6;  ///< where the roll-off to white begins, (0, 1); below it nothing changes
  double dither = 0;      ///< noise in steps of 8-bit sRGB, [0, 4]; 1 hides the bands of gradients
};

/// Rendered light brought into [0,1] for an image: linear up to the shoulder, then a smooth
/// exponential roll-off that reaches white only at infinity, channel by channel (our choice: mid
/// tones stay what they were measured to be, highlights are never burnt). An alpha channel, the
/// fourth, is kept. The noise is the same for every image of one size. Throws LogicError for
/// options out of range.
Image tone_mapped(const Image& image, const ToneOptions& options = {});

}  // namespace atelier
