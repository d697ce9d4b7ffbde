#include "registration/sewing/sewing_pattern.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>

#include "core/cross.h"
#include "core/error.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

using Vector2 = Eigen::Vector2d;

constexpr int kFineSteps = 256;  // polyline that stands for a curve: error of 1e-5 of its length

Vector2 corner(const Panel& panel, int index) {
  return panel.corners.row(index).transpose();
}

/// A point of an arc: its start turned round its centre.
Vector2 arc(const Vector2& start, const Vector2& end, double bulge, double t) {
  const Vector2 along = end - start;
  const Vector2 left(-along.y(), along.x());
  const Vector2 center = 0.5 * (start + end) + (1 - bulge * bulge) / (4 * bulge) * left;
  const double angle = 4 * std::atan(bulge) * t;
  const Vector2 spoke = start - center;
  return center + std::cos(angle) * spoke + std::sin(angle) * Vector2(-spoke.y(), spoke.x());
}

Vector2 point_on(const Panel& panel, const PanelEdge& edge, double t) {
  if (edge.bulge != 0 && t > 0 && t < 1) {  // the ends are the corners themselves
    return arc(corner(panel, edge.start), corner(panel, edge.end), edge.bulge, t);
  }
  std::vector<Vector2> points = {corner(panel, edge.start)};
  points.insert(points.end(), edge.controls.begin(), edge.controls.end());
  points.push_back(corner(panel, edge.end));
  for (std::size_t level = points.size() - 1; level > 0; --level) {  // de Casteljau
    for (std::size_t i = 0; i < level; ++i) {
      points[i] = (1 - t) * points[i] + t * points[i + 1];
    }
  }
  return points.front();
}

// Points of a fine polyline and the arc length up to each.
struct Polyline {
  std::vector<Vector2> points;
  std::vector<double> lengths;
};

Polyline fine_polyline(const Panel& panel, int edge_idx) {
  const PanelEdge& edge = panel.edges[static_cast<std::size_t>(edge_idx)];
  const int steps = is_straight(edge) ? 1 : kFineSteps;
  Polyline line;
  for (int i = 0; i <= steps; ++i) {
    line.points.push_back(point_on(panel, edge, static_cast<double>(i) / steps));
    line.lengths.push_back(
        i == 0 ? 0 : line.lengths.back() + (line.points[i] - line.points[i - 1]).norm());
  }
  return line;
}

bool segments_cross(const Vector2& a, const Vector2& b, const Vector2& c, const Vector2& d) {
  const double abc = cross(b - a, c - a);
  const double abd = cross(b - a, d - a);
  const double cda = cross(d - c, a - c);
  const double cdb = cross(d - c, b - c);
  return abc * abd < 0 && cda * cdb < 0;
}

std::vector<Vector2> outline(const Panel& panel, int steps_per_curve) {
  std::vector<Vector2> points;
  for (int edge = 0; edge < static_cast<int>(panel.edges.size()); ++edge) {
    const bool straight = is_straight(panel.edges[static_cast<std::size_t>(edge)]);
    const Points2 samples = sample_edge(panel, edge, straight ? 1 : steps_per_curve);
    for (Index i = 0; i + 1 < samples.rows(); ++i) {
      points.emplace_back(samples.row(i).transpose());
    }
  }
  return points;
}

double signed_area(const std::vector<Vector2>& loop) {
  double twice = 0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    twice += cross(loop[i], loop[(i + 1) % loop.size()]);
  }
  return twice / 2;
}

void check_panel(const Panel& panel, const std::string& file) {
  const std::string place = "panel '" + panel.name + "'";
  const int edges = static_cast<int>(panel.edges.size());
  if (edges < 2) {
    throw DataError(file, place, std::to_string(edges) + " edges", "a closed loop");
  }
  if (!panel.corners.allFinite() || !panel.placement.origin.allFinite() ||
      !panel.placement.rotation.allFinite() || !(panel.placement.bend_radius >= 0)) {
    throw DataError(file, place, "a number that is not finite", "finite metres and radians");
  }
  for (int i = 0; i < edges; ++i) {
    const PanelEdge& edge = panel.edges[static_cast<std::size_t>(i)];
    const std::string edge_place = place + " edge " + std::to_string(i);
    if (edge.start < 0 || edge.start >= panel.corners.rows() || edge.end < 0 ||
        edge.end >= panel.corners.rows()) {
      throw DataError(file, edge_place, "a corner that does not exist",
                      "0 to " + std::to_string(panel.corners.rows() - 1));
    }
    if (edge.controls.size() > 2) {
      throw DataError(file, edge_place, std::to_string(edge.controls.size()) + " control points",
                      "at most 2");
    }
    constexpr double kLargestBulge = 1e4;  // of a circle that is open by less than 0.03 degrees
    if (!(std::abs(edge.bulge) <= kLargestBulge) || (edge.bulge != 0 && !edge.controls.empty())) {
      throw DataError(file, edge_place, "an arc of bulge " + short_number(edge.bulge),
                      "less than a circle, without control points");
    }
    for (const Vector2& control : edge.controls) {
      if (!control.allFinite()) {
        throw DataError(file, edge_place, "a control point that is not finite", "finite metres");
      }
    }
    if (edge.end != panel.edges[static_cast<std::size_t>((i + 1) % edges)].start) {
      throw DataError(file, edge_place, "it does not end where the next one starts",
                      "a closed loop of edges");
    }
    if (!(edge_length(panel, i) > 0)) {
      throw DataError(file, edge_place, "no length", "two different corners");
    }
  }
  const std::vector<Vector2> loop = outline(panel, 32);
  // Before the area, which is 0 of a loop like an 8.
  const std::size_t count = loop.size();
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = i + 2; j < count; ++j) {
      if (segments_cross(loop[i], loop[(i + 1) % count], loop[j], loop[(j + 1) % count])) {
        throw DataError(file, place, "an outline that crosses itself", "a simple loop");
      }
    }
  }
  const double area = signed_area(loop);
  if (!(area > 0)) {
    throw DataError(file, place, "an area of " + short_number(area) + " m2",
                    "edges counter-clockwise round a positive area");
  }
}

}  // namespace

bool is_straight(const PanelEdge& edge) {
  return edge.controls.empty() && edge.bulge == 0;
}

Points2 sample_edge(const Panel& panel, int edge, int count) {
  ATELIER_CHECK(edge >= 0 && edge < static_cast<int>(panel.edges.size()), "no such edge");
  ATELIER_CHECK(count >= 1, "an edge has at least one segment");
  const Polyline line = fine_polyline(panel, edge);
  const double length = line.lengths.back();
  Points2 samples(count + 1, 2);
  std::size_t segment = 0;
  for (int i = 0; i <= count; ++i) {
    const double target = length * i / count;
    while (segment + 2 < line.points.size() && line.lengths[segment + 1] < target) {
      ++segment;
    }
    const double span = line.lengths[segment + 1] - line.lengths[segment];
    const double t = span > 0 ? (target - line.lengths[segment]) / span : 0;
    samples.row(i) = (1 - t) * line.points[segment] + t * line.points[segment + 1];
  }
  samples.row(0) = line.points.front();
  samples.row(count) = line.points.back();
  return samples;
}

double edge_length(const Panel& panel, int edge) {
  return fine_polyline(panel, edge).lengths.back();
}

double panel_area(const Panel& panel) {
  return signed_area(outline(panel, kFineSteps));
}

Eigen::Vector3d place(const PanelPlacement& placement, const Vector2& point_in_panel) {
  Eigen::Vector3d local(point_in_panel.x(), point_in_panel.y(), 0);
  if (placement.bend_radius > 0) {
    const double angle = point_in_panel.x() / placement.bend_radius;
    local.x() = placement.bend_radius * std::sin(angle);
    local.z() = placement.bend_radius * (std::cos(angle) - 1);
  }
  const double angle = placement.rotation.norm();
  if (angle > 0) {
    local = Eigen::AngleAxisd(angle, placement.rotation / angle) * local;
  }
  return placement.origin + local;
}

void check_sewing_pattern(const SewingPattern& pattern, const std::string& file) {
  if (pattern.panels.empty()) {
    throw DataError(file, "pattern '" + pattern.name + "'", "no panels", "at least one");
  }
  std::set<std::string> names;
  for (const Panel& panel : pattern.panels) {
    if (panel.name.empty() || !names.insert(panel.name).second) {
      throw DataError(file, "panel '" + panel.name + "'", "a name that is empty or taken",
                      "a unique name");
    }
    check_panel(panel, file);
  }
  std::set<std::pair<int, int>> sewn;
  for (const SewnEdges& seam : pattern.seams) {
    for (const auto& [panel, edge] :
         {std::pair(seam.panel_a, seam.edge_a), std::pair(seam.panel_b, seam.edge_b)}) {
      const std::string place = "seam '" + seam.name + "'";
      if (panel < 0 || panel >= static_cast<int>(pattern.panels.size())) {
        throw DataError(file, place, "panel " + std::to_string(panel), "a panel that exists");
      }
      const Panel& side = pattern.panels[static_cast<std::size_t>(panel)];
      if (edge < 0 || edge >= static_cast<int>(side.edges.size())) {
        throw DataError(file, place, "edge " + std::to_string(edge) + " of '" + side.name + "'",
                        "an edge that exists");
      }
      if (!sewn.emplace(panel, edge).second) {
        throw DataError(file, place, "edge " + std::to_string(edge) + " of '" + side.name + "'",
                        "an edge that is not sewn already");
      }
    }
  }
}

}  // namespace atelier
