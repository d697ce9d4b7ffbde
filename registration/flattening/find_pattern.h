#pragma once

#include "registration/flattening/find_seams.h"
#include "registration/flattening/flat_pattern.h"

namespace atelier {

/// How a surface gets seams and a pattern.
struct FindPatternOptions {
  FindSeamsOptions find;
  FlattenOptions flatten;    ///< its panels stiffen at stiffening_of(find.stretch) whatever it says
  double tolerance = 0.005;  ///< m: what the surface is in doubt by, 0 to 0.02; 0: it stays
};

/// A surface with its seams and panels.
struct FoundPattern {
  Mesh mesh;  ///< the triangles of the one given; its vertices have moved
  FoundSeams seams;
  FlatPattern pattern;
  FlatMeasures measures;
  bool reached = false;  ///< the pattern keeps `find.stretch` and no panel lies over itself
  double moved_mean = 0, moved_most = 0;  ///< m: of vertices, off the surface as they slid on it
};

/// Seams of a surface that keep a bound of stretch, short and straight, and the pattern of them.
///
/// 1. A front and a back (front_and_back.h), opened to disks; their seams straightened by sliding
///    vertices along the surface (straight_seams.h), and what of the surface would need stretch
///    taken out within `give` (unstretched_surface.h).
/// 2. Seams and darts as find_seams, for a little less stretch, since equal seams cost some.
/// 3. These straightened and the surface unstretched again: altogether or, where that misses the
///    bound, a little or not at all. A zigzag is as many small darts, without which panels stretch
///    more, so
/// 4. seams are sought once more on the straightened surface, from those that were found; and
///    so on, four times at most, while straight ones miss the bound or got shorter.
/// 5. Where none of these keeps the bound: seams along edges, on the surface as it is given.
/// 6. Of the best pattern seams are sewn again, the longest first, if the surface gives way so far
///    that the bound holds without: the search sews on a surface that stays as it is. A front and
///    its back stay two, but for what is small, as a sleeve; with `find.join` only. It ends where
///    24 in a row are needed.
///
/// Corners are kept above 10 degrees where they are in `mesh` (remove_slivers.h), so that a
/// simulation takes the panels as a rest shape.
///
/// Of all patterns on the way that keep the bound, with both sides of seams equal, the one of the
/// shortest seams is returned, a panel counting as 15 cm of seam, and a later one only where that
/// is 2% less. Where none does, the last one found, with `reached` false. Our choice. `watch` hears
/// what is tried.
///
/// Throws DataError as find_seams. One to four searches, of which the later ones begin with what
/// was found; up to eight where the bound is not kept. Then a pattern or two for each seam.
FoundPattern find_pattern(const Mesh& mesh, const FindPatternOptions& options = {},
                          const SeamWatch& watch = {});

}  // namespace atelier
