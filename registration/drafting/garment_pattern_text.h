#pragma once

#include <string>

#include "registration/sewing/sewing_pattern.h"

namespace atelier {

/// A pattern as GarmentCode and the Garment-Pattern-Generator have it (`*_specification.json`, see
/// garment_pattern_json.h): centimetres, curvature relative to edges, panels in their order, edges
/// that are not sewn with their name as `label`. Placement is written without its bend. Numbers
/// have the digits that give them back. The file says (kOutsideProperty) that loops run
/// counter-clockwise seen from outside, so that none is turned over where it is read.
std::string garment_pattern_text(const SewingPattern& pattern);

}  // namespace atelier
