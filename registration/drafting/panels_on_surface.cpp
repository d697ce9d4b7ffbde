#include "registration/drafting/panels_on_surface.h"

#include <algorithm>

#include "core/error.h"
#include "core/tree.h"

namespace atelier {
namespace {

/// The faces of one flat panel.
Triangles faces_of_panel(const SurfaceCut& cut, int panel) {
  std::vector<Index> rows;
  for (Index f = 0; f < cut.faces.rows(); ++f) {
    if (cut.panels[static_cast<std::size_t>(f)] == panel) {
      rows.push_back(f);
    }
  }
  return cut.faces(rows, Eigen::all);
}

}  // namespace

Garment panels_on_surface(const SewingPattern& drafted, const std::vector<std::string>& names,
                          const FlatPattern& flat, const Points& surface,
                          const PatternGarmentOptions& options) {
  ATELIER_CHECK(static_cast<int>(names.size()) == flat.cut.panel_count, "a name for each panel");
  for (const int v : flat.cut.source) {
    ATELIER_CHECK(v >= 0 && v < surface.rows(), "vertices of the surface that was cut");
  }
  SewingPattern level = drafted;
  for (Panel& panel : level.panels) {
    panel.placement = {};  // vertices are then the panel's own coordinates
  }
  Garment garment = garment_from_pattern(level, options);
  Points lying = Points::Zero(flat.vertices.rows(), 3);
  lying.leftCols(2) = flat.vertices;
  std::vector<int> panel_of(static_cast<std::size_t>(garment.mesh.vertices.rows()), -1);
  for (Index f = 0; f < garment.mesh.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      panel_of[static_cast<std::size_t>(garment.mesh.faces(f, k))] =
          garment.panels[static_cast<std::size_t>(f)];
    }
  }
  for (std::size_t p = 0; p < drafted.panels.size(); ++p) {
    const std::string& name = drafted.panels[p].name;
    const auto at = std::find(names.begin(), names.end(), name);
    if (at == names.end()) {
      throw DataError("", "panel '" + name + "'", "no panel of the surface",
                      "the pattern that was drawn of it");
    }
    const Triangles faces = faces_of_panel(flat.cut, static_cast<int>(at - names.begin()));
    const TriangleTree tree = build_tree(lying, faces);
    for (Index v = 0; v < garment.mesh.vertices.rows(); ++v) {
      if (panel_of[static_cast<std::size_t>(v)] != static_cast<int>(p)) {
        continue;
      }
      const ClosestPoint nearest = closest_point(tree, garment.mesh.vertices.row(v).transpose());
      Eigen::RowVector3d place = Eigen::RowVector3d::Zero();
      for (int k = 0; k < 3; ++k) {
        const auto corner = static_cast<std::size_t>(faces(nearest.face, k));
        place += nearest.barycentric[k] * surface.row(flat.cut.source[corner]);
      }
      garment.mesh.vertices.row(v) = place;
    }
  }
  return garment;
}

}  // namespace atelier
