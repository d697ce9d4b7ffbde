#pragma once

#include "appearance/appearance_model.h"
#include "appearance/texture_sampling.h"

namespace atelier {

/// Logit of an unshadowed texel: sigmoid(3) = 0.95 is nearly unshadowed, with a gradient left for
/// training.
inline constexpr float kOpenShadow = 3;

/// Transposes [R,R,3] to [3,R,R].
Tensor planes_of(const Image& image);

/// A model of the data's surface, cameras and mean light transfer, without parameters. Throws
/// DataError for data without views or frames.
AppearanceModel blank_model(const AppearanceData& data, const NetworkOptions& options);

/// Sets a static texture and its gains, and the parameters that rendering starts from: where there
/// is a shadow branch, the mean texture is brighter by what an unshadowed texel loses to it.
void put_static_texture(AppearanceModel& model, StaticTexture fixed);

}  // namespace atelier
