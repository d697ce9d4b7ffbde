#pragma once

#include <string>
#include <vector>

#include "registration/flattening/flat_pattern.h"
#include "registration/sewing/sewing_pattern.h"

namespace atelier {

/// What an eye sees of how a pattern is cut and drawn, beside its outlines (OutlineMeasures).
struct DrawingMeasures {
  /// m: rms distance of the flat panels' outlines, in points every 5 mm, from the curves drawn for
  /// them: how ragged the cut is that the drawing hides.
  double raggedness = 0;
  int parts = 0;             ///< of the garment that have a panel (garment_part)
  double panels_a_part = 0;  ///< 1 where each part is one panel
};

/// The part of a garment that a panel is of, by its name (name_pattern.h): "front" of "front left
/// 2", "sleeve left" of "sleeve left upper". Sleeves and cuffs are parts of their own on each side.
std::string garment_part(const std::string& panel);

/// @param drafted  panels in the coordinates of the flat pattern, in any order
/// @param names    [P] of the flat pattern's panels, as `drafted` has them
/// Throws LogicError for names that differ. O(n^2) for each panel.
DrawingMeasures measure_drawing(const SewingPattern& drafted, const std::vector<std::string>& names,
                                const FlatPattern& flat);

}  // namespace atelier
