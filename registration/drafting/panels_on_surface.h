#pragma once

#include <string>
#include <vector>

#include "registration/flattening/flat_pattern.h"
#include "registration/sewing/pattern_garment.h"
#include "registration/sewing/sewing_pattern.h"

namespace atelier {

/// Cuts a drawn pattern out of triangles, as garment_from_pattern, and lays each panel on the
/// surface that it was taken from, unsewn: a point goes where the nearest point of its flat panel
/// lies. Outlines are drawn within millimetres of the flat ones, so that seams nearly meet.
///
/// @param drafted  panels in the coordinates of the flat pattern (draft_pattern), in any order;
///                 their placement does not count
/// @param names    [P] of the flat pattern's panels, as `drafted` has them
/// @param surface  [V,3] m, vertices of the whole surface that `flat.cut.source` names
///
/// Throws DataError as garment_from_pattern, and for a panel of another name; LogicError for arrays
/// of other sizes.
Garment panels_on_surface(const SewingPattern& drafted, const std::vector<std::string>& names,
                          const FlatPattern& flat, const Points& surface,
                          const PatternGarmentOptions& options = {});

}  // namespace atelier
