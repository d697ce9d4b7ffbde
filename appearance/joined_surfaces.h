#pragma once

#include <vector>

#include "core/types.h"

namespace atelier {

/// A surface at one instant, among others.
struct Surface {
  const Points* vertices = nullptr;  ///< metres
  const Triangles* faces = nullptr;
};

/// Several surfaces as one, in their order: what a ray or a camera meets.
struct JoinedSurfaces {
  Points vertices;
  Triangles faces;
  std::vector<int> first_face;  ///< [S+1] of each surface, and the number of faces
};

/// Throws LogicError for a surface that is null.
JoinedSurfaces joined_surfaces(const std::vector<Surface>& surfaces);

}  // namespace atelier
