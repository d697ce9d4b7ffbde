#pragma once

#include <array>
#include <vector>

#include "core/image.h"

namespace atelier {

/// Pixels of an image as places in a texture, and their colours.
struct TexturePixels {
  std::vector<float> u, v;          ///< [P] in [0,1], v up
  std::vector<float> colors;        ///< [3P] linear RGB, or empty
  std::vector<float> weights = {};  ///< [P] how much each counts for a texture, or empty: all alike
};

/// The four texels round a place, bilinear: centres at (i + 0.5) / R, the border goes on outside.
struct TextureTaps {
  std::array<int, 4> texel;     ///< y * R + x
  std::array<float, 4> weight;  ///< sums to 1
};
TextureTaps texture_taps(int resolution, float u, float v);

/// Colours [3P] of a square texture [R,R,3] at places. Linear in the texture.
std::vector<float> sample_texture(const Image& texture, const TexturePixels& places);

/// A texture that does not change, and how bright each camera takes it.
struct StaticTexture {
  Image texture;            ///< [R,R,3] linear RGB; what no pixel sees is 0
  std::vector<float> gain;  ///< [3C] factor of each camera and channel, geometric mean 1
  ImageOf<std::uint8_t>
      seen;  ///< [R,R] 1: some pixel has half of its colour (less, if few are) from it
};

/// One image for it.
struct TextureView {
  int camera_idx = 0;
  const TexturePixels* pixels = nullptr;  ///< with colours
};

/// The texture that shows all images best (least squares in linear light), with the cameras'
/// gains: alternates `rounds` times between texture (simultaneous iterative reconstruction, Gilbert
/// 1972: residuals splatted, divided by the weight of each texel; five steps a round) and gains (in
/// closed form). Light is not negative. After each step a texel is drawn to the mean of its seen
/// neighbours, which counts as `smoothness` pixels (0: not; our choice): what few pixels show of a
/// texel is mostly their error. The best that can be said of a garment without looking at
/// how it moves. Sums run in the order of the views. Throws LogicError for views without colours.
StaticTexture static_texture(int resolution, int cameras, const std::vector<TextureView>& views,
                             int rounds = 6, double smoothness = 0);

}  // namespace atelier
