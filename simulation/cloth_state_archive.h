#pragma once

#include <string>

#include "core/archive.h"
#include "core/types.h"

namespace atelier {

struct ClothState;  // simulation/cloth/cloth_state.h

/// A state as arrays of an archive: "positions" and "velocities", float64 [V,3] in m and m/s, and
/// the frames done as the number `count`; back. Numbers keep their bits.
///
/// Reading throws DataError unless there are `vertices` finite rows of each within 1e9 and the
/// count is a whole number from 0 to 1e9, for other units than metres with Y up, and for arrays
/// that are not named here.
void put_cloth_state(Archive& archive, const std::string& count, const ClothState& state);
ClothState cloth_state_at(const Archive& archive, const std::string& count, Index vertices,
                          const std::string& file);

/// Archive of schema "atelier.cloth_state", version 1 (docs/reference/formats.md), and back, with
/// the count "frame".
Archive archive_of(const ClothState& state);
ClothState cloth_state_of(const Archive& archive, Index vertices, const std::string& file = "");

}  // namespace atelier
