#pragma once

#include <cstdint>

#include "registration/template/followed_surface.h"

namespace atelier {

/// Share of the length of a surface's rims where frames show that the garment ends: 3 cm past the
/// rim lies bare skin, other clothing, hair or shoes, or nothing at all with no hand or bare
/// forearm within 10 cm. Told against are what stands off the body by 4 cm or more with the label
/// of skin or none, as skin cannot: a label that was lost. A place counts if at least a third of
/// the frames that say anything of it say that cloth ends there. A true hem is told nearly
/// everywhere; the rim that an arm hid in all frames, or a lost label made, is not. Our choice. 1
/// without rims.
double observed_rims(const FollowedSurface& followed, Index home, const ClothedFrames& frames,
                     std::uint8_t label);

}  // namespace atelier
