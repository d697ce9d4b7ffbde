#pragma once

#include <string>

#include "registration/flattening/pattern_pieces.h"

namespace atelier {

/// The layout on pages of A4 at true scale, as PDF 1.4: tiles of 190 x 277 mm in margins of 10 mm,
/// each with its frame and its place ("B3": second row from below, third column), to be cut along
/// the frame and joined; pages on which nothing lies are left out. The first page has a test square
/// of 50 mm. Of a pattern that would take more than 2000 pages there is the first alone, which says
/// so. Names that are not ASCII are written with question marks. Without dates: the same layout,
/// the same bytes.
std::string pattern_pdf(const PatternLayout& layout, const std::string& title);

}  // namespace atelier
