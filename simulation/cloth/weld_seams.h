#pragma once

#include "core/garment.h"

namespace atelier {

/// A sewn garment: vertices that seams join become one, at their mean. `rest` and `rest_faces` stay
/// those of the flat panels, so that lengths along both sides of a seam are known, and hinges now
/// bend across seams. Loops are kept without repeated vertices; attachments of joined vertices stay
/// (the first of each). Seams are gone; uvs are those of the panels.
/// Throws DataError for what check_garment refuses, or if a seam closes a face on itself. O(V + F).
Garment weld_seams(const Garment& garment);

}  // namespace atelier
