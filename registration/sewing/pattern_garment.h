#pragma once

#include "core/garment.h"
#include "core/options.h"
#include "registration/sewing/sewing_pattern.h"

namespace atelier {

/// How fine the triangles of a pattern are.
struct PatternGarmentOptions {
  double edge_length = 0.02;  ///< m, 0.002 to 0.2: smaller for folds, larger for speed
};
OptionTable describe(PatternGarmentOptions& options);

/// Cuts a pattern out of triangles and places its panels round the body, unsewn.
///
/// Each panel is triangulated by a constrained Delaunay triangulation (CGAL) of its outline, whose
/// points are evenly spaced, and of a triangular lattice inside it, relaxed so that the triangles
/// are even. Both sides of a seam have the same number of points. The result has one vertex per
/// panel point (`mesh.vertices` placed, `rest` flat), seams as pairs of vertices, and the openings
/// (runs of unsewn edges, joined across seams) as boundary loops named after their edges.
/// `rest` holds the panels side by side, 5 cm apart, so that they do not overlap; `mesh.uvs` is
/// `rest` scaled into the unit square. Throws DataError for a pattern that check_sewing_pattern
/// refuses or a panel too small for the edge length. O(n log n).
Garment garment_from_pattern(const SewingPattern& pattern,
                             const PatternGarmentOptions& options = {});

}  // namespace atelier
