#pragma once

#include <cstddef>
#include <vector>

#include "appearance/appearance_data.h"

namespace atelier {

/// How well the best texture that does not change shows the images of some data, in dB over their
/// pixels as 8-bit sRGB.
struct StaticFit {
  double psnr = 0;                  ///< of all
  std::vector<double> camera_psnr;  ///< [C] of each camera; NaN: it has no pixel
  /// [C] share of the variance of a camera's pixels that it explains: 1 all, 0 or less none, as of
  /// images of something else; of cloth of one colour also little. Less what every camera
  /// explains of itself, by its part in the texture.
  std::vector<double> camera_explained;
};

/// Texels a side at which images are compared with a texture that does not change, at most: coarse,
/// so that cloth which is registered a little off is not taken for other images.
inline constexpr int kJudgedTexels = 128;

/// As many texels a side as leave each 32 pixels, from 16 to kJudgedTexels: a texel that one camera
/// alone sees agrees with whatever that camera took, and coarser ones do not hold a print.
int judged_texels(const AppearanceData& data);

/// Finds it. Throws LogicError for views without colours. O(pixels).
StaticFit static_fit(const AppearanceData& data, int resolution);

/// Cameras whose images contradict the geometry, as where those of two cameras were exchanged:
/// what the texture explains of theirs is less than a quarter of what it does of the median
/// camera's, or they are 4 dB below it, which is for plain cloth, of which it explains little.
/// docs/results/appearance.md has figures.
std::vector<std::size_t> contradicting_cameras(const StaticFit& fit);

/// True if the images of most cameras do: then there is no median to compare with, and the
/// texture explains nothing of what differs by more than cloth in changing light.
bool max_contradict(const StaticFit& fit);

}  // namespace atelier
