#pragma once

#include <string>
#include <string_view>

#include "registration/sewing/sewing_pattern.h"

namespace atelier {

/// A property of the file by which it says which side of its panels is outside: our own, which
/// other programs pass over. With it loops run counter-clockwise seen from outside, and no panel is
/// turned over.
inline constexpr const char* kOutsideProperty = "outside";
inline constexpr const char* kOutsideCounterClockwise = "counter-clockwise";

/// Reads a pattern of the Garment-Pattern-Generator (Korosteleva and Lee 2021, "Generating datasets
/// of 3D garments with sewing patterns") or of GarmentCode (Korosteleva and Sorkine-Hornung 2023,
/// `*_specification.json`): panels with vertices, edges, stitches, translation and XYZ Euler
/// rotation in degrees, and `units_in_meter`. An edge's `curvature` is a control point, relative to
/// the edge or absolute, or an object: `quadratic` and `cubic` with control points, `circle` with
/// radius, 1 for the larger arc, 1 for the arc that runs counter-clockwise from start to end (SVG's
/// flags; pygarment/garmentcode/edge.py).
///
/// Panels whose loop is clockwise are turned round. A stitch joins the ends that lie nearer to each
/// other where the panels are placed; one that is marked `right_wrong` joins start with start, as
/// GarmentCode's meshes do (pygarment/meshgen/boxmeshgen.py). Panels that show another side than
/// those they are sewn to are turned over where they lie, so that the garment has one outside, away
/// from a wearer at x = z = 0; but not in a file with kOutsideProperty, whose loops are to be
/// counter-clockwise.
/// GarmentCode's files of bodies and designs are refused as such, and a largest panel of less than
/// 0.05 or more than 5 m as a wrong unit. Throws DataError.
SewingPattern garment_pattern_from_json(std::string_view text, const std::string& file);

}  // namespace atelier
