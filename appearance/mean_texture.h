#pragma once

#include <functional>
#include <vector>

#include "appearance/appearance_data.h"
#include "appearance/appearance_model.h"
#include "core/options.h"

namespace atelier {

struct MeanTextureOptions {
  double max_angle = 75;  ///< degrees between normal and view; steeper pixels do not count, 10..90
  double darkening = 8;   ///< how much ambient occlusion beyond the mean darkens, 0..100; 0: not
};
OptionTable describe(MeanTextureOptions& options);

/// How much each pixel of each view says of the surface, [P] of each: the square of the cosine
/// between its normal and the direction to the camera, 0 beyond the maximum angle. At grazing
/// angles a pixel is many texels, and a small error of the geometry shows another part.
std::vector<std::vector<float>> angle_weights(const AppearanceData& data,
                                              const MeanTextureOptions& options = {});

/// The data without some pixels of each view, [P] 1 of `left`. Views that are left without any are
/// gone.
AppearanceData without_pixels(
    AppearanceData data, const std::function<std::vector<char>(const AppearanceView& view)>& left);

/// The data without the pixels that do not count (angle_weights).
AppearanceData without_grazing(AppearanceData data, const MeanTextureOptions& options = {});

/// A surface's mean texture as a model that networks' painter draws (static_texture, with pixels
/// weighted by angle; what no camera sees is filled from its neighbours): no branch, and a shadow
/// that is not learnt but given in closed form, sigmoid(3 + darkening (o - mean o)) / sigmoid(3) of
/// the ambient visibility o, with the mean over the frames of the data: what is worn over the
/// surface then darkens it (our choice of the curve). Throws DataError as initial_model does.
/// @param resolution  texels a side, a power of 2 from 16 to 2048
/// @param smoothness  as static_texture has it, pixels
AppearanceModel mean_texture_model(const AppearanceData& data, int resolution,
                                   const MeanTextureOptions& options = {}, double smoothness = 0);

/// Share of the surface's texels that some pixel shows.
double seen_share(const AppearanceData& data, int resolution);

}  // namespace atelier
