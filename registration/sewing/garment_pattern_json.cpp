#include "registration/sewing/garment_pattern_json.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/error.h"
#include "core/io/json.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

using nlohmann::json;
using Vector2 = Eigen::Vector2d;

struct Reader {
  std::string file;
  double metres_per_unit = 1;
  bool relative_curvature = true;

  [[noreturn]] void refuse(const std::string& where, const std::string& found,
                           const std::string& expected) const {
    throw DataError(file, where, found, expected);
  }

  const json& member(const json& object, const std::string& name, const std::string& where) const {
    if (!object.is_object() || !object.contains(name)) {
      refuse(where, "no '" + name + "'", "a Garment-Pattern-Generator pattern");
    }
    return object.at(name);
  }

  double number(const json& value, const std::string& where) const {
    if (!value.is_number()) {
      refuse(where, value.type_name(), "a number");
    }
    return value.get<double>();
  }

  int index(const json& value, std::size_t count, const std::string& where) const {
    if (!value.is_number_integer() || value.get<std::int64_t>() < 0 ||
        value.get<std::int64_t>() >= static_cast<std::int64_t>(count)) {
      refuse(where, value.dump(), "an index from 0 to " + std::to_string(count) + " exclusive");
    }
    return value.get<int>();
  }

  template <int N>
  Eigen::Matrix<double, N, 1> vector(const json& value, const std::string& where) const {
    if (!value.is_array() || value.size() != N) {
      refuse(where, value.dump().substr(0, 40), std::to_string(N) + " numbers");
    }
    Eigen::Matrix<double, N, 1> out;
    for (int i = 0; i < N; ++i) {
      out[i] = number(value[static_cast<std::size_t>(i)], where);
    }
    return out;
  }

  // The control point of a curve: relative to the edge, (along, across) in edge lengths, or
  // absolute in the panel. A file that says the one and has the other is refused.
  Vector2 control_point(const Vector2& start, const Vector2& end, const Vector2& curvature,
                        const std::string& where) const {
    const Vector2 along = end - start;
    const Vector2 across(-along.y(), along.x());
    const Vector2 as_relative = start + curvature.x() * along + curvature.y() * across;
    const Vector2 as_absolute = curvature * metres_per_unit;
    const Vector2& point = relative_curvature ? as_relative : as_absolute;
    const Vector2& otherwise = relative_curvature ? as_absolute : as_relative;
    constexpr double kFar = 3;  // edge lengths: no curve of a garment reaches so far aside
    const auto reach = [&](const Vector2& control) {
      return (control - 0.5 * (start + end)).norm() / std::max(along.norm(), 1e-9);
    };
    if (reach(point) > kFar) {
      refuse(where,
             "a control point " + short_number(reach(point)) + " edge lengths away from its edge",
             reach(otherwise) > kFar
                 ? "one beside it"
                 : std::string("one beside it, as curvature_coords \"") +
                       (relative_curvature ? "absolute" : "relative") +
                       "\" makes of these numbers, which the file does not say");
    }
    return point;
  }

  // Of a circle: the arc over an edge by SVG's flags.
  double bulge(const json& params, double chord, const std::string& where) const {
    const Eigen::Vector3d values = vector<3>(params, where);
    const double radius = values[0] * metres_per_unit;
    constexpr double kRounding = 1e-3;  // of the radius: files are written with few digits
    if (!(radius > 0) || !(chord > 0) || !(chord <= 2 * radius * (1 + kRounding))) {
      refuse(where, "a circle of radius " + params[0].dump().substr(0, 20),
             "at least half the distance of the edge's ends");
    }
    for (int flag : {1, 2}) {
      if (values[flag] != 0 && values[flag] != 1) {
        refuse(where, params.dump().substr(0, 40), "a radius and two flags, 0 or 1");
      }
    }
    const double less = 2 * std::asin(std::min(1.0, 0.5 * chord / radius));
    const double angle = values[1] == 0 ? less : 2 * std::numbers::pi - less;
    return (values[2] == 0 ? -1 : 1) * std::tan(angle / 4);
  }

  void add_curvature(PanelEdge& edge, const Panel& panel, const json& curvature,
                     const std::string& where) const {
    const Vector2 start = panel.corners.row(edge.start);
    const Vector2 end = panel.corners.row(edge.end);
    const auto add = [&](const json& point) {
      edge.controls.push_back(control_point(start, end, vector<2>(point, where), where));
    };
    if (!curvature.is_object()) {
      add(curvature);
      return;
    }
    const json& type = member(curvature, "type", where);
    const json& params = member(curvature, "params", where);
    if (type == "circle") {
      edge.bulge = bulge(params, (end - start).norm(), where);
      return;
    }
    if (type != "quadratic" && type != "cubic") {
      refuse(where, "curvature of type " + type.dump().substr(0, 40), "quadratic, cubic or circle");
    }
    const std::size_t points = type == "quadratic" ? 1 : 2;
    if (!params.is_array() || params.size() != points) {
      refuse(where, params.dump().substr(0, 40), std::to_string(points) + " control points");
    }
    for (const json& point : params) {
      add(point);
    }
  }

  Panel panel(const std::string& name, const json& source, std::vector<int>& edge_order) const {
    const std::string where = "panel '" + name + "'";
    Panel out;
    out.name = name;
    const json& vertices = member(source, "vertices", where);
    const json& edges = member(source, "edges", where);
    if (!vertices.is_array() || !edges.is_array() || edges.size() < 2 || edges.size() > 10'000) {
      refuse(where, "vertices or edges that are no lists of a loop", "lists with at least 2 edges");
    }
    out.corners.resize(static_cast<Index>(vertices.size()), 2);
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      out.corners.row(static_cast<Index>(i)) =
          metres_per_unit * vector<2>(vertices[i], where + " vertex").transpose();
    }
    for (std::size_t i = 0; i < edges.size(); ++i) {
      const std::string edge_where = where + " edge " + std::to_string(i);
      const json& ends = member(edges[i], "endpoints", edge_where);
      if (!ends.is_array() || ends.size() != 2) {
        refuse(edge_where, ends.dump().substr(0, 40), "two endpoints");
      }
      PanelEdge edge;
      edge.start = index(ends[0], vertices.size(), edge_where);
      edge.end = index(ends[1], vertices.size(), edge_where);
      if (edges[i].contains("curvature")) {
        add_curvature(edge, out, edges[i]["curvature"], edge_where);
      }
      out.edges.push_back(edge);
      edge_order.push_back(static_cast<int>(i));
    }
    const Eigen::Vector3d degrees = vector<3>(member(source, "rotation", where), where);
    const Eigen::Vector3d radians = degrees * std::numbers::pi / 180;
    const Eigen::AngleAxisd rotation(Eigen::AngleAxisd(radians.z(), Eigen::Vector3d::UnitZ()) *
                                     Eigen::AngleAxisd(radians.y(), Eigen::Vector3d::UnitY()) *
                                     Eigen::AngleAxisd(radians.x(), Eigen::Vector3d::UnitX()));
    out.placement.rotation = rotation.angle() * rotation.axis();
    out.placement.origin = metres_per_unit * vector<3>(member(source, "translation", where), where);
    return out;
  }
};

// Along the curves: of two corners and two arcs all is between them.
double loop_area(const Panel& panel) {
  double twice = 0;
  for (std::size_t e = 0; e < panel.edges.size(); ++e) {
    constexpr int kSteps = 16;
    const Points2 points =
        sample_edge(panel, static_cast<int>(e), is_straight(panel.edges[e]) ? 1 : kSteps);
    for (Index i = 0; i + 1 < points.rows(); ++i) {
      twice += points(i, 0) * points(i + 1, 1) - points(i, 1) * points(i + 1, 0);
    }
  }
  return twice / 2;
}

// The file's number of each edge of a panel, as they lie now.
struct EdgeOrder {
  std::vector<int> numbers;
  bool turned = false;  // against the file's own direction
};

// The loop the other way round.
void turn_round(Panel& panel, EdgeOrder& edge_order) {
  std::reverse(panel.edges.begin(), panel.edges.end());
  std::reverse(edge_order.numbers.begin(), edge_order.numbers.end());
  edge_order.turned = !edge_order.turned;
  for (PanelEdge& edge : panel.edges) {
    std::swap(edge.start, edge.end);
    std::reverse(edge.controls.begin(), edge.controls.end());
    edge.bulge = -edge.bulge;
  }
}

// Shows the panel's other side outside, where it lies: the cloth is the same.
void turn_over(Panel& panel, EdgeOrder& edge_order) {
  panel.corners.col(0) *= -1;
  for (PanelEdge& edge : panel.edges) {
    edge.bulge = -edge.bulge;
    for (Vector2& control : edge.controls) {
      control.x() *= -1;
    }
  }
  turn_round(panel, edge_order);
  const double angle = panel.placement.rotation.norm();
  const Eigen::Matrix3d rotation =
      angle > 0 ? Eigen::AngleAxisd(angle, panel.placement.rotation / angle).toRotationMatrix()
                : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
  const Eigen::AngleAxisd turned(rotation *
                                 Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitY()));
  panel.placement.rotation = turned.angle() * turned.axis();
}

Eigen::Vector3d placed_corner(const Panel& panel, int corner) {
  return place(panel.placement, panel.corners.row(corner).transpose());
}

// Two edges that are sewn together, by the file's own numbers.
struct Stitch {
  int panel[2] = {0, 0};
  int edge[2] = {0, 0};
  bool right_wrong = false;  // the right side of one on the wrong side of the other
};

SewnEdges seam_of(const SewingPattern& pattern, const std::vector<EdgeOrder>& edge_orders,
                  const Stitch& stitch) {
  int edges[2] = {0, 0};
  for (int side = 0; side < 2; ++side) {
    const std::vector<int>& order =
        edge_orders[static_cast<std::size_t>(stitch.panel[side])].numbers;
    edges[side] =
        static_cast<int>(std::find(order.begin(), order.end(), stitch.edge[side]) - order.begin());
  }
  SewnEdges seam{"", stitch.panel[0], edges[0], stitch.panel[1], edges[1]};
  if (stitch.right_wrong) {  // start on start, in the file's own directions
    seam.reversed = edge_orders[static_cast<std::size_t>(seam.panel_a)].turned !=
                    edge_orders[static_cast<std::size_t>(seam.panel_b)].turned;
    return seam;
  }
  const Panel& a = pattern.panels[static_cast<std::size_t>(seam.panel_a)];
  const Panel& b = pattern.panels[static_cast<std::size_t>(seam.panel_b)];
  const PanelEdge& edge_a = a.edges[static_cast<std::size_t>(seam.edge_a)];
  const PanelEdge& edge_b = b.edges[static_cast<std::size_t>(seam.edge_b)];
  const Eigen::Vector3d a0 = placed_corner(a, edge_a.start);
  const Eigen::Vector3d a1 = placed_corner(a, edge_a.end);
  const Eigen::Vector3d b0 = placed_corner(b, edge_b.start);
  const Eigen::Vector3d b1 = placed_corner(b, edge_b.end);
  seam.reversed = (a0 - b1).norm() + (a1 - b0).norm() <= (a0 - b0).norm() + (a1 - b1).norm();
  return seam;
}

// How far a panel shows its outside away from the wearer's axis, in m2.
double outwardness(const Panel& panel) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (Index i = 0; i < panel.corners.rows(); ++i) {
    middle += placed_corner(panel, static_cast<int>(i)) / static_cast<double>(panel.corners.rows());
  }
  const Eigen::Vector3d here = place(panel.placement, {0, 0});
  const Eigen::Vector3d normal =
      (place(panel.placement, {1, 0}) - here).cross(place(panel.placement, {0, 1}) - here);
  const Eigen::Vector3d outwards(middle.x(), 0, middle.z());
  return outwards.norm() > 0 ? std::abs(loop_area(panel)) * normal.dot(outwards.normalized()) : 0;
}

// How clearly a stitch says which way round its edges meet: 0 not at all, 1 as two edges that lie
// on each other.
double clarity(const SewingPattern& pattern, const std::vector<EdgeOrder>& edge_orders,
               const Stitch& stitch) {
  const SewnEdges seam = seam_of(pattern, edge_orders, stitch);
  const Panel& a = pattern.panels[static_cast<std::size_t>(seam.panel_a)];
  const Panel& b = pattern.panels[static_cast<std::size_t>(seam.panel_b)];
  const PanelEdge& edge_a = a.edges[static_cast<std::size_t>(seam.edge_a)];
  const PanelEdge& edge_b = b.edges[static_cast<std::size_t>(seam.edge_b)];
  const Eigen::Vector3d along_a = placed_corner(a, edge_a.end) - placed_corner(a, edge_a.start);
  const Eigen::Vector3d along_b = placed_corner(b, edge_b.end) - placed_corner(b, edge_b.start);
  const double lengths = along_a.norm() * along_b.norm();
  return lengths > 0 ? std::abs(along_a.dot(along_b)) / lengths : 0;
}

// Panels that are sewn together show the same side: two loops that both run counter-clockwise meet
// the other way round along a seam. Sides are told from the clearest seams on (Prim's tree), for a
// seam whose edges lie across each other may be read either way. Each connected piece shows outside
// what lies further from the wearer.
void show_one_side_outside(SewingPattern& pattern, std::vector<EdgeOrder>& edge_orders,
                           const std::vector<Stitch>& stitches) {
  const std::size_t count = pattern.panels.size();
  std::vector<int> side(count, 0);  // 1 as it is, -1 turned over
  for (std::size_t first = 0; first < count; ++first) {
    if (side[first] != 0) {
      continue;
    }
    std::vector<std::size_t> piece{first};
    side[first] = 1;
    for (bool grown = true; grown;) {
      grown = false;
      double clearest = -1;
      std::size_t next = 0;
      int next_side = 0;
      for (const Stitch& stitch : stitches) {
        for (int end = 0; end < 2; ++end) {
          const auto one = static_cast<std::size_t>(stitch.panel[end]);
          const auto other = static_cast<std::size_t>(stitch.panel[1 - end]);
          const bool reaches_on =
              std::find(piece.begin(), piece.end(), one) != piece.end() && side[other] == 0;
          if (!reaches_on || clarity(pattern, edge_orders, stitch) <= clearest) {
            continue;
          }
          clearest = clarity(pattern, edge_orders, stitch);
          next = other;
          next_side = side[one] * (seam_of(pattern, edge_orders, stitch).reversed ? 1 : -1);
          grown = true;
        }
      }
      if (grown) {
        side[next] = next_side;
        piece.push_back(next);
      }
    }
    double outward = 0;
    for (const std::size_t panel : piece) {
      outward += side[panel] * outwardness(pattern.panels[panel]);
    }
    for (const std::size_t panel : piece) {
      if (side[panel] * (outward < 0 ? -1 : 1) < 0) {
        turn_over(pattern.panels[panel], edge_orders[panel]);
      }
    }
  }
}

// Bodies and designs of GarmentCode, in YAML or JSON: what its programs make patterns from.
void refuse_other_garmentcode(std::string_view text, const Reader& reader) {
  const std::size_t first = text.find_first_not_of(" \t\r\n{");
  const std::string_view begin = first == std::string_view::npos ? "" : text.substr(first);
  for (const auto& [key, what] :
       {std::pair("body", "measures of a body"), {"design", "parameters of a design"}}) {
    if (begin.starts_with(std::string(key) + ":") ||
        begin.starts_with("\"" + std::string(key) + "\"")) {
      reader.refuse("", std::string(what) + ", of GarmentCode",
                    "the pattern that GarmentCode made with them: *_specification.json");
    }
  }
}

/// Refuses panels that are too large or too small for a garment, by the bounds of meshes of one
/// (flattening/flatten_diagnostics.h): a wrong unit.
void require_garment_size(const SewingPattern& pattern, double units, const Reader& reader) {
  constexpr double kLargest = 5;      // m
  constexpr double kSmallest = 0.05;  // m
  double extent = 0;
  for (const Panel& panel : pattern.panels) {
    extent = std::max(
        extent,
        (panel.corners.colwise().maxCoeff() - panel.corners.colwise().minCoeff()).maxCoeff());
  }
  if (extent <= kLargest && extent >= kSmallest) {
    return;
  }
  char found[120];
  std::snprintf(found, sizeof found, "%g, by which the largest panel is %.4g m", units, extent);
  reader.refuse(
      "units_in_meter", found,
      "the number of the file's units in a metre, 100 of centimetres, by which it is 0.05 "
      "to 5 m");
}

}  // namespace

SewingPattern garment_pattern_from_json(std::string_view text, const std::string& file) {
  Reader reader{file};
  refuse_other_garmentcode(text, reader);
  const json root = parse_json(text, file);
  const json& properties = reader.member(root, "properties", "file");
  const double units =
      reader.number(reader.member(properties, "units_in_meter", "properties"), "units_in_meter");
  if (!(units > 0)) {
    reader.refuse("units_in_meter", short_number(units), "more than 0");
  }
  reader.metres_per_unit = 1 / units;
  const json& coordinates = reader.member(properties, "curvature_coords", "properties");
  if (coordinates != "relative" && coordinates != "absolute") {
    reader.refuse("curvature_coords", coordinates.dump().substr(0, 40), "relative or absolute");
  }
  reader.relative_curvature = coordinates == "relative";

  const bool says_outside = properties.contains(kOutsideProperty);
  if (says_outside && properties[kOutsideProperty] != kOutsideCounterClockwise) {
    reader.refuse(kOutsideProperty, properties[kOutsideProperty].dump().substr(0, 40),
                  kOutsideCounterClockwise);
  }

  const json& source = reader.member(root, "pattern", "file");
  const json& panels = reader.member(source, "panels", "pattern");
  if (!panels.is_object()) {
    reader.refuse("panels", panels.type_name(), "an object of named panels");
  }
  SewingPattern pattern;
  pattern.name = file;
  std::map<std::string, int> panel_idx;
  std::vector<EdgeOrder> edge_orders;
  for (const auto& [name, value] : panels.items()) {
    EdgeOrder order;
    Panel panel = reader.panel(name, value, order.numbers);
    if (loop_area(panel) < 0) {
      if (says_outside) {
        reader.refuse("panel '" + name + "'", "a clockwise loop",
                      std::string("loops that run as '") + kOutsideProperty + "' says, " +
                          kOutsideCounterClockwise);
      }
      turn_round(panel, order);
    }
    panel_idx[name] = static_cast<int>(pattern.panels.size());
    pattern.panels.push_back(std::move(panel));
    edge_orders.push_back(std::move(order));
  }
  const json& stitches = reader.member(source, "stitches", "pattern");
  if (!stitches.is_array()) {
    reader.refuse("stitches", stitches.type_name(), "a list");
  }
  std::vector<Stitch> sewn;
  for (std::size_t i = 0; i < stitches.size(); ++i) {
    const std::string where = "stitch " + std::to_string(i);
    Stitch stitch;
    if (stitches[i].is_array() && stitches[i].size() == 3) {
      if (stitches[i][2] != "right_wrong") {
        reader.refuse(where, stitches[i][2].dump().substr(0, 40),
                      "right_wrong, or two sides alone");
      }
      stitch.right_wrong = true;
    } else if (!stitches[i].is_array() || stitches[i].size() != 2) {
      reader.refuse(where, stitches[i].dump().substr(0, 40), "two sides");
    }
    for (std::size_t side = 0; side < 2; ++side) {
      const json& end = stitches[i][side];
      const json& name = reader.member(end, "panel", where);
      if (!name.is_string() || panel_idx.count(name.get<std::string>()) == 0) {
        reader.refuse(where, name.dump().substr(0, 40), "the name of a panel");
      }
      stitch.panel[side] = panel_idx[name.get<std::string>()];
      stitch.edge[side] = reader.index(
          reader.member(end, "edge", where),
          edge_orders[static_cast<std::size_t>(stitch.panel[side])].numbers.size(), where);
    }
    sewn.push_back(stitch);
  }
  if (!says_outside) {
    show_one_side_outside(pattern, edge_orders, sewn);
  }
  for (std::size_t i = 0; i < sewn.size(); ++i) {
    pattern.seams.push_back(seam_of(pattern, edge_orders, sewn[i]));
    pattern.seams.back().name = "stitch " + std::to_string(i);
    if (!sewn[i].right_wrong) {
      pattern.seams.back().reversed = true;  // of panels that show the same side, always
    }
  }
  check_sewing_pattern(pattern, file);
  require_garment_size(pattern, units, reader);
  return pattern;
}

}  // namespace atelier
