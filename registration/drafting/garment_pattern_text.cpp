#include "registration/drafting/garment_pattern_text.h"

#include <Eigen/Geometry>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "registration/sewing/garment_pattern_json.h"

namespace atelier {
namespace {

using nlohmann::ordered_json;
using Vector2 = Eigen::Vector2d;

constexpr double kUnitsInMetre = 100;

/// A control point in lengths of its edge: along it, and across to the left.
ordered_json relative_point(const Vector2& start, const Vector2& end, const Vector2& point) {
  const Vector2 along = end - start;
  const Vector2 across(-along.y(), along.x());
  const Vector2 off = point - start;
  return {off.dot(along) / along.squaredNorm(), off.dot(across) / along.squaredNorm()};
}

ordered_json edge_curvature(const Panel& panel, const PanelEdge& edge) {
  const Vector2 start = panel.corners.row(edge.start);
  const Vector2 end = panel.corners.row(edge.end);
  if (edge.bulge != 0) {
    // SVG's flags: more than a semicircle, counter-clockwise.
    const double half = 2 * std::atan(std::abs(edge.bulge));
    const double radius = (end - start).norm() / (2 * std::sin(half));
    return {{"type", "circle"},
            {"params",
             {kUnitsInMetre * radius, std::abs(edge.bulge) > 1 ? 1 : 0, edge.bulge > 0 ? 1 : 0}}};
  }
  ordered_json points = ordered_json::array();
  for (const Vector2& control : edge.controls) {
    points.push_back(relative_point(start, end, control));
  }
  return {{"type", points.size() == 1 ? "quadratic" : "cubic"}, {"params", points}};
}

/// Degrees about x, then y, then z.
ordered_json euler_degrees(const Eigen::Vector3d& rotation_vector) {
  const double angle = rotation_vector.norm();
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  if (angle > 0) {
    rotation = Eigen::AngleAxisd(angle, rotation_vector / angle).toRotationMatrix();
  }
  const Eigen::Vector3d angles =
      Eigen::Vector3d(std::atan2(rotation(2, 1), rotation(2, 2)),
                      std::atan2(-rotation(2, 0), std::hypot(rotation(0, 0), rotation(1, 0))),
                      std::atan2(rotation(1, 0), rotation(0, 0))) *
      180 / std::numbers::pi;
  return {angles.x(), angles.y(), angles.z()};
}

ordered_json panel_json(const Panel& panel) {
  ordered_json vertices = ordered_json::array();
  for (Index i = 0; i < panel.corners.rows(); ++i) {
    vertices.push_back({kUnitsInMetre * panel.corners(i, 0), kUnitsInMetre * panel.corners(i, 1)});
  }
  ordered_json edges = ordered_json::array();
  for (const PanelEdge& edge : panel.edges) {
    ordered_json one{{"endpoints", {edge.start, edge.end}}};
    if (!is_straight(edge)) {
      one["curvature"] = edge_curvature(panel, edge);
    }
    if (!edge.name.empty()) {
      one["label"] = edge.name;
    }
    edges.push_back(std::move(one));
  }
  const Eigen::Vector3d origin = kUnitsInMetre * panel.placement.origin;
  return {{"translation", {origin.x(), origin.y(), origin.z()}},
          {"rotation", euler_degrees(panel.placement.rotation)},
          {"vertices", std::move(vertices)},
          {"edges", std::move(edges)}};
}

}  // namespace

std::string garment_pattern_text(const SewingPattern& pattern) {
  ordered_json panels = ordered_json::object();
  ordered_json order = ordered_json::array();
  for (const Panel& panel : pattern.panels) {
    panels[panel.name] = panel_json(panel);
    order.push_back(panel.name);
  }
  ordered_json stitches = ordered_json::array();
  for (const SewnEdges& seam : pattern.seams) {
    const auto side = [&](int panel, int edge) -> ordered_json {
      return {{"panel", pattern.panels[static_cast<std::size_t>(panel)].name}, {"edge", edge}};
    };
    stitches.push_back(
        ordered_json::array({side(seam.panel_a, seam.edge_a), side(seam.panel_b, seam.edge_b)}));
  }
  const ordered_json root{{"pattern",
                           {{"panels", std::move(panels)},
                            {"stitches", std::move(stitches)},
                            {"panel_order", std::move(order)}}},
                          {"parameters", ordered_json::object()},
                          {"parameter_order", ordered_json::array()},
                          {"properties",
                           {{"curvature_coords", "relative"},
                            {"normalize_panel_translation", false},
                            {"normalized_edge_loops", true},
                            {kOutsideProperty, kOutsideCounterClockwise},
                            {"units_in_meter", kUnitsInMetre}}}};
  return root.dump(1) + "\n";
}

}  // namespace atelier
