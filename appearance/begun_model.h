#pragma once

#include "appearance/appearance_model.h"
#include "appearance/texture_sampling.h"

namespace atelier {

/// An unshadowed texel's input of the shadow's sigmoid, 0.95: near open, but not so near that a
/// network could not learn.
inline constexpr float kOpenShadow = 3;

/// [R,R,3] as [3,R,R].
Tensor planes_of(const Image& image);

/// A model of the data's surface, cameras and mean light transfer, without parameters. Throws
/// DataError for data without views or frames.
AppearanceModel begun_model(const AppearanceData& data, const NetworkOptions& options);

/// A static texture and its gains, and as the parameters that drawing begins with: the mean texture
/// is brighter by what an open shadow takes, where there is one.
void put_static_texture(AppearanceModel& model, StaticTexture fixed);

}  // namespace atelier
