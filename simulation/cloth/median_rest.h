#pragma once

#include <vector>

#include "core/garment.h"
#include "core/types.h"

namespace atelier {

/// Gives a garment a flat rest shape, each face by itself, with edges as long as they were in half
/// of the frames (the upper median of an even count): an edge that spans a fold in one frame is
/// longer in others, and would push or pull the whole time. A triangle whose median lengths make
/// none, or only a sliver (lower than a fifth of its longest edge), keeps its shape in `mesh`; one
/// that is a sliver there too is given a height and a base of a twentieth of its longest edge, as
/// no solver takes it otherwise. Our choice. Writes `rest` [3F,2] m and `rest_faces` [F,3].
///
/// `frames`: [V,3] m each, at least one, rows as `mesh.vertices`; anything else is a LogicError.
/// Cost: O(F x frames).
void rest_on_median_lengths(Garment& garment, const std::vector<Points>& frames);

}  // namespace atelier
