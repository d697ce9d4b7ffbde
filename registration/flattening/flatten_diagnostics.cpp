#include "registration/flattening/flatten_diagnostics.h"

#include <algorithm>
#include <cstdio>

#include "core/topology.h"
#include "core/welded_faces.h"

namespace atelier {

std::optional<Finding> garment_size_finding(const MeshFile& file, const std::string& name) {
  constexpr double kLargest = 5;      // m; a train is no longer
  constexpr double kSmallest = 0.05;  // m; a doll's sock
  if (std::optional<Finding> unknown = unit_finding(file, name)) {
    return unknown;
  }
  const double extent =
      (file.mesh.vertices.colwise().maxCoeff() - file.mesh.vertices.colwise().minCoeff())
          .maxCoeff();
  if (extent <= kLargest && extent >= kSmallest) {
    return std::nullopt;
  }
  char text[80];
  std::snprintf(text, sizeof text, "the mesh is %.4g m large, too large or too small for a garment",
                extent);
  return Finding{Severity::Warning, "size-unlikely", name, text,
                 file.said.metres_per_unit > 0
                     ? "the file states its unit: where that is wrong, correct it there"
                     : "--input.unit says the file's unit: cm, mm"};
}

std::optional<Finding> open_body_finding(const Mesh& body, const std::string& name) {
  const std::size_t openings =
      boundary_loops(topology_of(welded_faces(body.vertices, body.faces), body.vertices.rows()))
          .size();
  if (openings == 0) {
    return std::nullopt;
  }
  return Finding{Severity::Warning, "body-open", name,
                 "the body's surface is open at " + std::to_string(openings) +
                     (openings == 1 ? " place" : " places") +
                     ", where inside and outside cannot be told apart",
                 "close it there if the garment touches it"};
}

std::optional<Finding> seam_finding(double mismatch, const std::string& name) {
  constexpr double kMost = 0.003;
  if (mismatch <= kMost) {
    return std::nullopt;
  }
  char text[100];
  std::snprintf(text, sizeof text, "the two sides of a seam differ by %.2f%% of their length",
                100 * mismatch);
  return Finding{Severity::Warning, "seams-unequal", name, text,
                 "0.3% can be sewn: more --flatten.panel.iterations, or other seams"};
}

std::optional<Finding> fabric_finding(const PatternLayout& layout, double fabric_width,
                                      const std::string& name) {
  if (layout.width <= fabric_width) {
    return std::nullopt;
  }
  const PatternPiece* widest = nullptr;
  double width = 0;
  for (const PatternPiece& piece : layout.pieces) {
    const double wide = piece.cut_line.col(0).maxCoeff() - piece.cut_line.col(0).minCoeff();
    if (wide > width) {
      width = wide;
      widest = &piece;
    }
  }
  char text[200];
  std::snprintf(text, sizeof text,
                "piece '%.40s' is %.2f m wide with its seam allowance, and the fabric %.2f m: the "
                "layout takes a width of %.2f m",
                widest == nullptr ? "" : widest->name.c_str(), width, fabric_width, layout.width);
  return Finding{Severity::Warning, "fabric-narrow", name, text,
                 "a larger --pattern.fabric-width, or a seam through that piece"};
}

}  // namespace atelier
