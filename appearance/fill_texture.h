#pragma once

#include "appearance/texel_map.h"
#include "appearance/texture_sampling.h"

namespace atelier {

/// Gives texels of the surface that no pixel has seen the colour of the nearest one that was, in
/// steps from texel to texel over the surface (across seams too); of several as near their mean. A
/// part of the surface from which no step leads to a seen texel takes the mean of all. A hem, which
/// erosion keeps every training pixel away from, then goes on in the colour beside it. Texels
/// beside a chart take what TexelMap::source says. Throws LogicError for a texture of another
/// resolution than the map.
void fill_unseen(StaticTexture& texture, const TexelMap& map);

}  // namespace atelier
