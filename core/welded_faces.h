#pragma once

#include "core/mesh.h"

namespace atelier {

/// Faces whose corners in one place are one: each names the first of all vertices at its position,
/// to the bit. Formats that keep one texture coordinate a vertex part a closed surface along the
/// seams of its texture; this joins it again, to ask what is closed and what its pieces are.
/// `faces`: [F,3] into vertices [V,3]. O(V log V).
Triangles welded_faces(const Points& vertices, const Triangles& faces);

}  // namespace atelier
