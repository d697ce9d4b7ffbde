#include "bodymodel/human/human_polygonise.h"

#include <utility>

#include "bodymodel/human/human_half_mesh.h"
#include "bodymodel/human/human_march.h"
#include "bodymodel/human/human_remesh.h"

namespace atelier {

Mesh polygonise_human(const HumanField& field, const HumanPolygoniseOptions& options) {
  HumanHalfMesh half = march_human(field, options.grid);
  for (Vec3d& p : half.points) {
    if (p.x < 1e-9) {
      p.x = 0;
    }
  }
  half = remesh_human(field, std::move(half), options.edge_scale, options.rounds);
  Mesh mesh;
  mesh.vertices.resize(static_cast<Index>(half.points.size()), 3);
  for (std::size_t i = 0; i < half.points.size(); ++i) {
    mesh.vertices.row(static_cast<Index>(i)) << half.points[i].x, half.points[i].y,
        half.points[i].z;
  }
  mesh.faces.resize(static_cast<Index>(half.faces.size()), 3);
  for (std::size_t i = 0; i < half.faces.size(); ++i) {
    mesh.faces.row(static_cast<Index>(i)) << half.faces[i][0], half.faces[i][1], half.faces[i][2];
  }
  return mesh;
}

}  // namespace atelier
