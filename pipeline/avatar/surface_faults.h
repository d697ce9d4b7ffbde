#pragma once

#include "core/types.h"

namespace atelier {

/// Defects of a seen surface in a pose.
struct SurfaceFaults {
  int inverted = 0;    ///< faces that look against the body's own, and at rest do not
  double stretch = 1;  ///< most by which an edge is longer against the body's own than at rest
};

/// The faults of a seen surface over a body in a pose, against both at rest. Edges count with 1 mm
/// more than they have, so that the shortest do not decide. Our choice.
/// @param rest_body, rest_seen, body, seen  [V,3] m, over the same faces
SurfaceFaults surface_faults(const Triangles& faces, const Points& rest_body,
                             const Points& rest_seen, const Points& body, const Points& seen);

}  // namespace atelier
