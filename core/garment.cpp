#include "core/garment.h"

#include <cmath>

#include "core/error.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

void check_vertex(int vertex, Index count, const std::string& place, const std::string& file) {
  if (vertex < 0 || vertex >= count) {
    throw DataError(file, place, "vertex " + std::to_string(vertex),
                    "0 to " + std::to_string(count - 1));
  }
}

void check_material(const Material& material, const std::string& file) {
  const auto positive = [&](double value, const char* what, bool zero_allowed) {
    if (!std::isfinite(value) || value < 0 || (value == 0 && !zero_allowed)) {
      throw DataError(file, std::string("material ") + what, short_number(value),
                      zero_allowed ? "zero or more" : "more than zero");
    }
  };
  positive(material.density, "density", false);
  positive(material.stretch_warp, "stretch_warp", true);
  positive(material.stretch_weft, "stretch_weft", true);
  positive(material.shear, "shear", true);
  positive(material.bending, "bending", true);
  positive(material.damping, "damping", true);
  positive(material.friction, "friction", true);
  positive(material.thickness, "thickness", true);
}

void check_rest(const Garment& garment, const std::string& file) {
  const Index faces = garment.mesh.faces.rows();
  if (garment.rest_faces.rows() != 0 && garment.rest_faces.rows() != faces) {
    throw DataError(file, "rest faces", std::to_string(garment.rest_faces.rows()) + " rows",
                    std::to_string(faces));
  }
  if (!garment.rest.allFinite()) {
    throw DataError(file, "rest", "a number that is not finite", "finite numbers");
  }
  for (Index face = 0; face < garment.rest_faces.rows(); ++face) {
    for (int corner = 0; corner < 3; ++corner) {
      check_vertex(garment.rest_faces(face, corner), garment.rest.rows(),
                   "rest face " + std::to_string(face), file);
    }
  }
  if (!garment.panels.empty() && static_cast<Index>(garment.panels.size()) != faces) {
    throw DataError(file, "panels", std::to_string(garment.panels.size()) + " entries",
                    std::to_string(faces));
  }
  for (const int panel : garment.panels) {
    if (panel < 0 || static_cast<std::size_t>(panel) >= garment.panel_names.size()) {
      throw DataError(file, "panels", "panel " + std::to_string(panel),
                      "0 to " + std::to_string(garment.panel_names.size()) + " exclusive");
    }
  }
}

}  // namespace

OptionTable describe(Material& material) {
  OptionTable table;
  table.add("density", material.density, 1e-3, 100, "kg/m2", "Area density of the fabric");
  table.add("stretch_warp", material.stretch_warp, 0, 1e9, "N/m",
            "Stretching stiffness along the warp, the grain of the fabric");
  table.add("stretch_weft", material.stretch_weft, 0, 1e9, "N/m",
            "Stretching stiffness along the weft, across the grain");
  table.add("shear", material.shear, 0, 1e9, "N/m", "Shearing stiffness");
  table.add("bending", material.bending, 0, 1e3, "N m", "Bending stiffness");
  table.add("damping", material.damping, 0, 10, "s",
            "Stiffness-proportional (Rayleigh) damping coefficient");
  table.add("friction", material.friction, 0, 100, "", "Coulomb friction coefficient");
  table.add("thickness", material.thickness, 0, 0.1, "m",
            "Gap kept between layers and to the body");
  return table;
}

void check_garment(const Garment& garment, const std::string& file) {
  check_mesh(garment.mesh, file);
  check_material(garment.material, file);
  check_rest(garment, file);
  const Index vertices = garment.mesh.vertices.rows();
  for (const Seam& seam : garment.seams) {
    if (seam.a.size() != seam.b.size()) {
      throw DataError(
          file, "seam '" + seam.name + "'",
          std::to_string(seam.a.size()) + " and " + std::to_string(seam.b.size()) + " vertices",
          "as many on both sides");
    }
    for (std::size_t i = 0; i < seam.a.size(); ++i) {
      check_vertex(seam.a[i], vertices, "seam '" + seam.name + "'", file);
      check_vertex(seam.b[i], vertices, "seam '" + seam.name + "'", file);
    }
  }
  if (garment.boundaries.size() != garment.boundary_names.size()) {
    throw DataError(file, "boundaries", std::to_string(garment.boundary_names.size()) + " names",
                    std::to_string(garment.boundaries.size()));
  }
  for (const std::vector<int>& loop : garment.boundaries) {
    for (const int vertex : loop) {
      check_vertex(vertex, vertices, "boundary", file);
    }
  }
  for (const Attachment& attachment : garment.attachments) {
    check_vertex(attachment.vertex, vertices, "attachment", file);
    if (attachment.triangle < 0) {
      throw DataError(file, "attachment", "triangle " + std::to_string(attachment.triangle),
                      "zero or more");
    }
    if (!attachment.barycentric.allFinite() || std::abs(attachment.barycentric.sum() - 1) > 1e-6 ||
        !std::isfinite(attachment.distance)) {
      throw DataError(file, "attachment", "barycentric coordinates that do not sum to 1",
                      "finite numbers with sum 1");
    }
  }
}

}  // namespace atelier
