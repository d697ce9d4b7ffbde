#pragma once

#include <algorithm>
#include <cmath>

namespace atelier {

/// sRGB in [0,1] to linear light (IEC 61966-2-1), the transfer curve of colours in PLY and OBJ.
inline float linear_from_srgb(float srgb) {
  return srgb <= 0.04045F ? srgb / 12.92F : std::pow((srgb + 0.055F) / 1.055F, 2.4F);
}

/// Linear light to sRGB; both in [0,1], clamped.
inline float srgb_from_linear(float linear) {
  const float light = std::min(std::max(0.0F, linear), 1.0F);
  return light <= 0.0031308F ? 12.92F * light : 1.055F * std::pow(light, 1.0F / 2.4F) - 0.055F;
}

}  // namespace atelier
