#pragma once

#include <string>

#include "registration/flattening/pattern_pieces.h"

namespace atelier {

/// The dialects of DXF by which cutting-room programs exchange patterns: ASTM D6673-10, and AAMA,
/// which is older.
enum class DxfDialect { Astm, Aama };

/// The layout in a dialect, as strict readers take it: ASCII DXF R12 in millimetres with a header
/// of the unit alone ($INSUNITS) and no tables, a block for each piece and one for a control square
/// of 100 mm, old polylines. Layers: 1 boundary and texts, 2 turn points, 3 curve points, 4 notches
/// (points on the boundary; 30 depth, 39 width, 50 angle), 6 mirror line, 7 grain, 14 sew line; of
/// ASTM 84 and 87, the quality curves of 1 and 14. Without dates, so that the same pattern gives
/// the same file.
std::string exchange_dxf(const PatternLayout& layout, const std::string& title, DxfDialect dialect);

}  // namespace atelier
