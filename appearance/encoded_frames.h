#pragma once

#include <vector>

#include "appearance/appearance_model.h"

namespace atelier {

/// The input of a latent code's encoder for each frame, [F] of [s,s,8] with s =
/// code_resolution_of: the surface's offset off the mean in centimetres and its support (0 without
/// BodyShapes), the mean over the cameras of what the pixels are more than the static texture, as
/// a share of it in [-1,1], and 1 where some pixel shows the texel.
std::vector<Image> encoded_frames(const AppearanceData& data, const AppearanceModel& model);

}  // namespace atelier
