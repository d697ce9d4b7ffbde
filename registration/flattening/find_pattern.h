#pragma once

#include "registration/flattening/find_seams.h"
#include "registration/flattening/flat_pattern.h"

namespace atelier {

/// Options of the search for seams and a pattern.
struct FindPatternOptions {
  FindSeamsOptions find;
  FlattenOptions flatten;    ///< but its panels stiffen at stiffening_of(find.stretch)
  double tolerance = 0.005;  ///< m, developability tolerance: error of the surface, 0 to 0.02
};

/// A surface with its seams and panels.
struct FoundPattern {
  Mesh mesh;  ///< faces of the given mesh; its vertices have moved
  FoundSeams seams;
  FlatPattern pattern;
  FlatMeasures measures;
  bool reached = false;  ///< stretch is below `find.stretch` and no panel overlaps itself
  double deviation_mean = 0, deviation_max = 0;  ///< m, of vertices from the given surface
};

/// The stretch below which 99% of the area lies, that stretch_bound bounds.
inline double bounded_strain(const FlatMeasures& measures, const FindSeamsOptions& find) {
  return counted_strain(find, measures.thread_p99, measures.strain_p99);
}

/// Finds short, straight seams whose pattern stretches less than a bound.
///
/// 1. A front and a back (front_and_back.h), cut to disks; their seams are straightened by sliding
///    vertices along the surface (straight_seams.h), and the surface is made developable within
///    `tolerance` (unstretched_surface.h).
/// 2. Seams and darts by find_seams, for a little less stretch, since equal seams cost some.
/// 3. Straightening and step 1's developability again: in full or, where that exceeds the bound, in
///    part or not at all. A zigzag acts as many small darts, without which panels stretch more, so
/// 4. seams are searched again on the straightened surface, starting from those found; and so on,
///    four times at most, while straight seams exceed the bound or become shorter.
/// 5. If none of these is within the bound: seams along edges, on the given surface.
/// 6. Unnecessary seams of the best pattern are removed, the longest first, where the surface can
///    deviate within the tolerance so that the bound holds without them. Front and back stay
///    separate unless small, such as a sleeve's; with `find.join` only. Ends after 24 necessary
///    seams in a row.
///
/// Corners are kept above 10 degrees where they are in `mesh` (remove_slivers.h), so that a
/// simulation accepts the panels as a rest shape.
///
/// Of all patterns within the bound, with equal sides of seams, the one of the shortest seams is
/// returned, a panel counting as 15 cm of seam, and a later one only if it is 2% shorter. Without
/// any, the last one, with `reached` false. Our choice. `watch` is told of every attempt.
///
/// Throws DataError as find_seams. One to four searches, of which the later ones start from the
/// seams found; up to eight where the bound is exceeded. Then a pattern or two for each seam.
FoundPattern find_pattern(const Mesh& mesh, const FindPatternOptions& options = {},
                          const SeamWatch& watch = {});

}  // namespace atelier
