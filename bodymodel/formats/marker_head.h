#pragma once

#include <vector>

#include "core/types.h"

namespace atelier {

/// How far a head would look up, radians, mean over frames, if its markers sat at their named
/// places: the rigid turn from those places to where the markers were seen (Kabsch 1976), and the
/// height of what it makes of straight ahead (+Z). A band that is worn low at the back looks up in
/// every frame; people look ahead on average.
/// @param places    [M,3] named places of all markers, each in its joint's frame: +Z ahead, +Y up
/// @param band      those on the head
/// @param recorded  frames of [M,3] metres, Y up
/// @param seen      frames of [M]; frames that see fewer than three of the band count nothing
/// Throws LogicError on sizes that do not agree. 0 without a frame that counts. O(frames).
double head_pitch(const Points& places, const std::vector<std::size_t>& band,
                  const std::vector<Points>& recorded, const std::vector<std::vector<bool>>& seen);

/// The places with those of the band turned about their middle, so that their pitch becomes 0.
Points levelled(Points places, const std::vector<std::size_t>& band, double pitch);

}  // namespace atelier
