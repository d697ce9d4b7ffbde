#pragma once

#include "bodymodel/underlying/body_cover.h"
#include "bodymodel/underlying/clothed_scan.h"

namespace atelier {

/// How well a body lies under a scan's clothes.
struct BodyCertificate {
  Index covered = 0;          ///< vertices that are under something near
  double outside_rate = 0;    ///< share of them more than 1 mm outside of it
  double outside_depth = 0;   ///< m, mean depth of those
  double proximity = 0;       ///< m, mean gap where it is under 1 cm
  double proximity_rate = 0;  ///< share of covered vertices where it is
  Index bare = 0;             ///< vertices that are on seen skin
  double skin_distance = 0;   ///< m, their mean distance from it
  double seen_rate = 0;       ///< share of the body's area that the scan says anything of
};

/// Measured against the scan, with the sign of its winding number. Throws LogicError for the cover
/// of another body. O(V log F).
BodyCertificate body_certificate(const Triangles& faces, const Points& vertices,
                                 const ScanSurface& scan, const BodyCover& cover);

}  // namespace atelier
