#pragma once

#include <string>

#include "registration/flattening/pattern_pieces.h"
#include "registration/sewing/sewing_pattern.h"

namespace atelier {

/// A pattern as Valentina and Seamly2D open it (`.val`, format 0.5.1, which both read and bring up
/// to date): a block for each panel with its corners and control points at a length and an angle
/// from a base point, lines and cubics (arcs in pieces of at most 45 degrees, within 5e-6 of their
/// radius), and a detail with seam and hem allowance, name and grain line. Centimetres. Pieces lie
/// as in `layout`, which must have been made of `pattern`; notches are left out, since Valentina
/// has them at points alone.
std::string valentina_text(const SewingPattern& pattern, const PatternLayout& layout,
                           const PatternPieceOptions& options, const std::string& title);

}  // namespace atelier
