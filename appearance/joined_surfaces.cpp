#include "appearance/joined_surfaces.h"

#include "core/error.h"

namespace atelier {

JoinedSurfaces joined_surfaces(const std::vector<Surface>& surfaces) {
  Index vertex_count = 0;
  Index face_count = 0;
  for (const Surface& surface : surfaces) {
    ATELIER_CHECK(surface.vertices != nullptr && surface.faces != nullptr,
                  "a surface has vertices and faces");
    vertex_count += surface.vertices->rows();
    face_count += surface.faces->rows();
  }
  JoinedSurfaces all;
  all.vertices.resize(vertex_count, 3);
  all.faces.resize(face_count, 3);
  Index v = 0;
  Index f = 0;
  for (const Surface& surface : surfaces) {
    all.first_face.push_back(static_cast<int>(f));
    all.vertices.middleRows(v, surface.vertices->rows()) = *surface.vertices;
    all.faces.middleRows(f, surface.faces->rows()) = surface.faces->array() + static_cast<int>(v);
    v += surface.vertices->rows();
    f += surface.faces->rows();
  }
  all.first_face.push_back(static_cast<int>(f));
  return all;
}

}  // namespace atelier
