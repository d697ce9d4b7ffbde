#pragma once

#include <string>
#include <string_view>

#include "registration/sewing/sewing_pattern.h"

namespace atelier {

/// Reads a pattern of the Garment-Pattern-Generator (Korosteleva and Lee 2021, "Generating datasets
/// of 3D garments with sewing patterns"): panels with vertices, edges with relative or absolute
/// quadratic curvature, stitches, translation and XYZ Euler rotation in degrees, and
/// `units_in_meter`. Panels whose loop is clockwise are turned round. A stitch joins the ends that
/// lie nearer to each other where the panels are placed; panels that show another side than those
/// they are sewn to are turned over where they lie, so that the garment has one outside. Throws
/// DataError.
SewingPattern garment_pattern_from_json(std::string_view text, const std::string& file);

}  // namespace atelier
