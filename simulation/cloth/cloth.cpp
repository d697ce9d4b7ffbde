#include "simulation/cloth/cloth.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <numbers>
#include <queue>
#include <tuple>

#include "core/error.h"

namespace atelier {
namespace {

std::string short_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

/// Flat shape of one face: its corners in the plane of the pattern (y is warp), or of the template.
struct FlatFace {
  Eigen::Vector2d corner[3];
  double area;
};

/// A mesh edge with its one or two faces.
struct FaceEdge {
  int v0, v1;           ///< in the order of `face[0]`
  int face[2];          ///< -1: boundary
  int opposite[2];      ///< corner vertex across
  int first_corner[2];  ///< corner of v0 in face 0, of v1 in face 1
};

std::string face_name(Index face) {
  return "face " + std::to_string(face);
}

std::vector<FlatFace> flat_faces(const Garment& garment, double min_angle_deg) {
  const Triangles& faces = garment.mesh.faces;
  const bool pattern = garment.rest_faces.rows() > 0;
  std::vector<FlatFace> out(static_cast<std::size_t>(faces.rows()));
  for (Index f = 0; f < faces.rows(); ++f) {
    FlatFace& flat = out[f];
    if (pattern) {
      for (int c = 0; c < 3; ++c) {
        flat.corner[c] = garment.rest.row(garment.rest_faces(f, c)).transpose();
      }
    } else {
      const Eigen::Vector3d p0 = garment.mesh.vertices.row(faces(f, 0)).transpose();
      const Eigen::Vector3d e1 = garment.mesh.vertices.row(faces(f, 1)).transpose() - p0;
      const Eigen::Vector3d e2 = garment.mesh.vertices.row(faces(f, 2)).transpose() - p0;
      const double length = e1.norm();
      const double x = length > 0 ? e1.dot(e2) / length : 0;
      flat.corner[0].setZero();
      flat.corner[1] = {length, 0};
      flat.corner[2] = {x, std::sqrt(std::max(0.0, e2.squaredNorm() - x * x))};
    }
    const Eigen::Vector2d e1 = flat.corner[1] - flat.corner[0];
    const Eigen::Vector2d e2 = flat.corner[2] - flat.corner[0];
    const double twice = e1.x() * e2.y() - e1.y() * e2.x();
    flat.area = 0.5 * std::abs(twice);
    double longest = 0;
    for (int c = 0; c < 3; ++c) {
      longest = std::max(longest, (flat.corner[(c + 1) % 3] - flat.corner[c]).norm());
    }
    // The smallest angle faces the shortest edge; height over the longest edge bounds its sine.
    const double sine = longest > 0 ? 2 * flat.area / (longest * longest) : 0;
    if (!(sine > std::sin(min_angle_deg * std::numbers::pi / 180) * 0.5)) {
      throw DataError(garment.name, face_name(f), "a degenerate triangle of the rest shape",
                      "triangles with corners above " + short_text(min_angle_deg) +
                          " degrees; remesh the garment");
    }
  }
  return out;
}

std::vector<FaceEdge> face_edges(const Garment& garment) {
  const Triangles& faces = garment.mesh.faces;
  struct Half {
    int low, high, face, corner;
    bool forward;
  };
  std::vector<Half> halves;
  halves.reserve(static_cast<std::size_t>(faces.rows()) * 3);
  for (int f = 0; f < faces.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const int a = faces(f, c);
      const int b = faces(f, (c + 1) % 3);
      if (a == b) {
        throw DataError(garment.name, face_name(f), "vertex " + std::to_string(a) + " twice",
                        "three different vertices");
      }
      halves.push_back({std::min(a, b), std::max(a, b), f, c, a < b});
    }
  }
  std::sort(halves.begin(), halves.end(), [](const Half& a, const Half& b) {
    return std::tie(a.low, a.high, a.face) < std::tie(b.low, b.high, b.face);
  });
  std::vector<FaceEdge> edges;
  for (std::size_t i = 0; i < halves.size();) {
    std::size_t j = i + 1;
    while (j < halves.size() && halves[j].low == halves[i].low &&
           halves[j].high == halves[i].high) {
      ++j;
    }
    const std::string name =
        "edge " + std::to_string(halves[i].low) + "-" + std::to_string(halves[i].high);
    if (j - i > 2) {
      throw DataError(garment.name, name, std::to_string(j - i) + " faces (not manifold)",
                      "at most two faces at an edge; split the garment there");
    }
    const Half& h = halves[i];
    FaceEdge edge{faces(h.face, h.corner),
                  faces(h.face, (h.corner + 1) % 3),
                  {h.face, -1},
                  {faces(h.face, (h.corner + 2) % 3), -1},
                  {h.corner, -1}};
    if (j - i == 2) {
      const Half& g = halves[i + 1];
      if (g.forward == h.forward) {
        throw DataError(garment.name, name, "two faces of opposite orientation",
                        "faces that agree on which side is outside");
      }
      edge.face[1] = g.face;
      edge.opposite[1] = faces(g.face, (g.corner + 2) % 3);
      edge.first_corner[1] = g.corner;
    }
    edges.push_back(edge);
    i = j;
  }
  return edges;
}

/// Flat distance between the two corners across an edge of length `length`, both triangles unfolded
/// into one plane; from their heights and feet.
double distance_across(const FlatFace& a, int corner_a, const FlatFace& b, int corner_b,
                       double length) {
  const auto foot_and_height = [](const FlatFace& f, int corner, double& foot, double& height) {
    const Eigen::Vector2d e = f.corner[(corner + 1) % 3] - f.corner[corner];
    const Eigen::Vector2d o = f.corner[(corner + 2) % 3] - f.corner[corner];
    foot = o.dot(e) / e.norm();
    height = 2 * f.area / e.norm();
  };
  double foot_a = 0;
  double height_a = 0;
  double foot_b = 0;
  double height_b = 0;
  foot_and_height(a, corner_a, foot_a, height_a);
  foot_and_height(b, corner_b, foot_b, height_b);
  // Face b walks the edge the other way round.
  const double along = (length - foot_b) - foot_a;
  return std::hypot(along, height_a + height_b);
}

double dihedral_angle(const Points& x, const FaceEdge& e) {
  const auto p = [&](int v) -> Eigen::Vector3d { return x.row(v).transpose(); };
  const Eigen::Vector3d edge = p(e.v1) - p(e.v0);
  const Eigen::Vector3d n1 = edge.cross(p(e.opposite[0]) - p(e.v0));
  const Eigen::Vector3d n2 = (p(e.opposite[1]) - p(e.v0)).cross(edge);
  return std::atan2(n1.cross(n2).dot(edge) / edge.norm(), n1.dot(n2));
}

double directional_modulus(const Material& material, const Eigen::Vector2d& direction,
                           bool pattern) {
  if (!pattern) {
    return 0.5 * (material.stretch_warp + material.stretch_weft);
  }
  const double c2 = direction.y() * direction.y() / direction.squaredNorm();
  return material.stretch_warp * c2 + material.stretch_weft * (1 - c2);
}

void add_edges(const Garment& garment, const ClothOptions& options,
               const std::vector<FlatFace>& flat, const std::vector<FaceEdge>& edges,
               Cloth& cloth) {
  const bool pattern = garment.rest_faces.rows() > 0;
  const Material& m = garment.material;
  const bool springs = options.membrane == "springs";
  std::vector<ClothSpring> shear;
  for (const FaceEdge& e : edges) {
    double stiffness = 0;
    double area = 0;
    double length = 0;
    double right_angle_error = 0;
    const int count = e.face[1] >= 0 ? 2 : 1;
    for (int k = 0; k < count; ++k) {
      const FlatFace& f = flat[e.face[k]];
      const int c = e.first_corner[k];
      const Eigen::Vector2d d = f.corner[(c + 1) % 3] - f.corner[c];
      length += d.norm() / count;
      area += f.area;
      stiffness += directional_modulus(m, d, pattern) * f.area / d.squaredNorm();
      const Eigen::Vector2d o0 = f.corner[c] - f.corner[(c + 2) % 3];
      const Eigen::Vector2d o1 = f.corner[(c + 1) % 3] - f.corner[(c + 2) % 3];
      right_angle_error =
          std::max(right_angle_error, std::abs(o0.dot(o1)) / (o0.norm() * o1.norm()));
    }
    const bool inner = count == 2;
    const bool diagonal = inner && options.shear == "quads" && right_angle_error < 0.05;
    if (diagonal) {
      stiffness = m.shear * length * length / (2 * area);
    }
    cloth.springs.push_back({e.v0, e.v1, length, springs || diagonal ? stiffness : 0.0});
    if (!inner) {
      continue;
    }
    if (e.opposite[0] == e.opposite[1]) {
      throw DataError(garment.name, face_name(e.face[1]), "two faces with the same three vertices",
                      "each triangle once");
    }
    const double across = distance_across(flat[e.face[0]], e.first_corner[0], flat[e.face[1]],
                                          e.first_corner[1], length);
    if (diagonal || options.shear == "cross") {
      const double k =
          diagonal ? m.shear * across * across / (2 * area) : m.shear * area / (across * across);
      shear.push_back({e.opposite[0], e.opposite[1], across, k});
    }
    // A triangle whose corners are all fixed stays as flat as it is held: the whole bend is in the
    // other one. With its area counted, a strip clamped by two rows would be half an element longer
    // than it is.
    double bending_area = 0;
    for (int k = 0; k < 2; ++k) {
      const bool held = cloth.fixed[e.v0] && cloth.fixed[e.v1] && cloth.fixed[e.opposite[k]];
      bending_area += held ? 0 : flat[e.face[k]].area;
    }
    const double weight = std::min(options.max_hinge_weight,
                                   length * length / (bending_area > 0 ? bending_area : area));
    const double rest =
        options.rest_angles == "template" ? dihedral_angle(garment.mesh.vertices, e) : 0;
    if (m.bending > 0) {
      cloth.hinges.push_back({e.v0, e.v1, e.opposite[0], e.opposite[1], rest, m.bending * weight});
    }
  }
  if (options.shear == "quads" && shear.empty()) {
    throw DataError(
        garment.name, "faces", "no two triangles that form a rectangle",
        "a mesh of rectangles, each of two triangles, which shear = \"quads\" needs; or "
        "\"cross\"");
  }
  cloth.fibre_count = static_cast<int>(cloth.springs.size());
  cloth.springs.insert(cloth.springs.end(), shear.begin(), shear.end());
}

void add_strains(const Garment& garment, const std::vector<FlatFace>& flat, Cloth& cloth) {
  const Material& m = garment.material;
  for (Index f = 0; f < garment.mesh.faces.rows(); ++f) {
    const FlatFace& face = flat[f];
    Eigen::Matrix2d edges;
    edges << face.corner[1] - face.corner[0], face.corner[2] - face.corner[0];
    const double det = edges.determinant();
    // [e1 e2] in 3D = F [edges], so F = [e1 e2] inverse; columns of F: weft (x), warp (y).
    Eigen::Matrix2d inverse;
    inverse << edges(1, 1), -edges(0, 1), -edges(1, 0), edges(0, 0);
    inverse /= det;
    ClothStrain s{
        garment.mesh.faces(f, 0), garment.mesh.faces(f, 1), garment.mesh.faces(f, 2), {}, 0, 0, 0};
    s.inverse_rest[0] = inverse(0, 1);
    s.inverse_rest[1] = inverse(1, 1);
    s.inverse_rest[2] = inverse(0, 0);
    s.inverse_rest[3] = inverse(1, 0);
    s.warp = m.stretch_warp * face.area;
    s.weft = m.stretch_weft * face.area;
    s.shear = m.shear * face.area;
    cloth.strains.push_back(s);
  }
}

/// Refuses options that would do nothing, or the same thing twice, and cloth that falls apart.
void check_together(const Garment& garment, const ClothOptions& options) {
  if (options.membrane == "strain" && options.shear != "none") {
    throw DataError(garment.name, "cloth options",
                    "shear \"" + options.shear + "\" with membrane \"strain\"",
                    "shear \"none\": these triangles have their shear already");
  }
  if (options.tether_stretch > 0 && options.tether_stretch < 1.01) {
    throw DataError(garment.name, "cloth options",
                    "tether_stretch " + short_text(options.tether_stretch),
                    "0 for no tethers, or 1.01 to 2 times the way along the cloth");
  }
  const Material& material = garment.material;
  if (!(material.stretch_warp > 0) || !(material.stretch_weft > 0)) {
    throw DataError(garment.name, "material stretch", "0 N/m along or across the grain",
                    "more than zero, without which nothing holds the cloth together; shear and "
                    "bending may be 0");
  }
}

/// Tethers every free vertex to the fixed vertex that is nearest along edges.
void add_tethers(double stretch, Cloth& cloth) {
  const int n = static_cast<int>(cloth.mass.size());
  std::vector<std::vector<std::pair<int, double>>> neighbours(static_cast<std::size_t>(n));
  for (int i = 0; i < cloth.fibre_count; ++i) {
    const ClothSpring& s = cloth.springs[i];
    neighbours[s.a].emplace_back(s.b, s.rest);
    neighbours[s.b].emplace_back(s.a, s.rest);
  }
  std::vector<double> distance(static_cast<std::size_t>(n),
                               std::numeric_limits<double>::infinity());
  std::vector<int> anchor(static_cast<std::size_t>(n), -1);
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (int v = 0; v < n; ++v) {
    if (cloth.fixed[v]) {
      distance[v] = 0;
      anchor[v] = v;
      queue.emplace(0.0, v);
    }
  }
  while (!queue.empty()) {
    const auto [d, v] = queue.top();
    queue.pop();
    if (d > distance[v]) {
      continue;
    }
    for (const auto& [u, length] : neighbours[v]) {
      if (d + length < distance[u]) {
        distance[u] = d + length;
        anchor[u] = anchor[v];
        queue.emplace(distance[u], u);
      }
    }
  }
  for (int v = 0; v < n; ++v) {
    if (!cloth.fixed[v] && anchor[v] >= 0) {
      cloth.tethers.push_back({v, anchor[v], stretch * distance[v]});
    }
  }
}

}  // namespace

OptionTable describe(ClothOptions& o) {
  OptionTable table;
  table.add("membrane", o.membrane, {"springs", "strain"},
            "Model of the membrane: springs along edges, or strain of orthotropic triangles from "
            "the flat rest shape");
  table.add("shear", o.shear, {"none", "cross", "quads"},
            "Additional shear springs: none, cross (across inner edges) or quads (both diagonals "
            "of quads)");
  table.add("rest_angles", o.rest_angles, {"flat", "template"},
            "Rest angle of hinges: flat, or template, that of the 3D template");
  table.add("min_rest_angle", o.min_rest_angle, 0.01, 20, "deg",
            "Minimum corner angle of a triangle at rest; smaller ones are refused");
  table.add("seam_stiffness", o.seam_stiffness, 1, 1e6, "N/m", "Stiffness of each sewing spring");
  table.add("max_hinge_weight", o.max_hinge_weight, 2, 1000, "",
            "Upper bound of the hinge weight l^2/(A1 + A2), which keeps slivers solvable");
  table.add("tether_stretch", o.tether_stretch, 0, 2, "",
            "Length of tethers to fixed vertices relative to the geodesic distance; 0: no tethers");
  return table;
}

void rebuild_schedule(Cloth& cloth, const ScheduleOptions& options) {
  std::vector<ConstraintParticles> constraints;
  constraints.reserve(cloth.springs.size() + cloth.hinges.size() + cloth.strains.size());
  for (const ClothSpring& s : cloth.springs) {
    constraints.push_back({{s.a, s.b, -1, -1}, 1});
  }
  for (const ClothHinge& h : cloth.hinges) {
    constraints.push_back({{h.edge0, h.edge1, h.left, h.right}, 0});
  }
  for (const ClothStrain& s : cloth.strains) {
    constraints.push_back({{s.v0, s.v1, s.v2, -1}, 2});
  }
  // A constraint without stiffness is nothing to project.
  std::vector<ConstraintParticles> kept;
  std::vector<int> index;
  for (std::size_t i = 0; i < constraints.size(); ++i) {
    const std::size_t springs = cloth.springs.size();
    const std::size_t hinges = springs + cloth.hinges.size();
    const bool stiff = i < springs  ? cloth.springs[i].stiffness > 0
                       : i < hinges ? cloth.hinges[i - springs].stiffness > 0
                                    : true;
    if (stiff) {
      kept.push_back(constraints[i]);
      index.push_back(static_cast<int>(i));
    }
  }
  cloth.schedule = make_schedule(cloth.rest_positions, kept, options);
  for (int& c : cloth.schedule.order) {
    c = index[c];
  }
}

Cloth make_cloth(const Garment& garment, const std::vector<int>& pins,
                 const ClothOptions& options) {
  check_garment(garment);
  ClothOptions checked = options;
  for (const std::string& problem : check_options(describe(checked))) {
    throw DataError(garment.name, "cloth options", problem, "values in range");
  }
  check_together(garment, options);
  if (garment.mesh.faces.rows() == 0) {
    throw DataError(garment.name, "faces", "none", "a triangle mesh");
  }
  if (options.membrane == "strain" && garment.rest_faces.rows() == 0) {
    throw DataError(
        garment.name, "rest shape", "none",
        "a flat rest shape (panels), which membrane = \"strain\" needs; or \"springs\"");
  }
  const Index vertex_count = garment.mesh.vertices.rows();
  Cloth cloth;
  cloth.material = garment.material;
  cloth.rest_positions = garment.mesh.vertices;
  cloth.faces = garment.mesh.faces;
  const std::vector<FlatFace> flat = flat_faces(garment, options.min_rest_angle);
  const std::vector<FaceEdge> edges = face_edges(garment);
  cloth.mass.assign(static_cast<std::size_t>(vertex_count), 0.0);
  for (Index f = 0; f < cloth.faces.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      cloth.mass[cloth.faces(f, c)] += garment.material.density * flat[f].area / 3;
    }
  }
  for (Index v = 0; v < vertex_count; ++v) {
    if (!(cloth.mass[v] > 0)) {
      throw DataError(garment.name, "vertex " + std::to_string(v), "no mass (it is in no face)",
                      "every vertex in a face");
    }
  }
  cloth.fixed.assign(static_cast<std::size_t>(vertex_count), 0);
  for (int v : pins) {
    ATELIER_CHECK(v >= 0 && v < vertex_count, "pin " + std::to_string(v) + " is no vertex");
    cloth.fixed[v] = 1;
  }
  cloth.attachments = garment.attachments;
  for (const Attachment& a : cloth.attachments) {
    cloth.fixed[a.vertex] = 1;
  }
  add_edges(garment, options, flat, edges, cloth);
  if (options.membrane == "strain") {
    add_strains(garment, flat, cloth);
  }
  cloth.sewing_begin = static_cast<int>(cloth.springs.size());
  for (const Seam& seam : garment.seams) {
    for (std::size_t i = 0; i < seam.a.size(); ++i) {
      if (seam.a[i] != seam.b[i]) {
        cloth.springs.push_back({seam.a[i], seam.b[i], 0.0, options.seam_stiffness});
      }
    }
  }
  if (options.tether_stretch > 0) {
    add_tethers(options.tether_stretch, cloth);
    if (std::find(cloth.fixed.begin(), cloth.fixed.end(), 1) == cloth.fixed.end()) {
      throw DataError(garment.name, "tethers", "no fixed vertex for one to end at",
                      "pins or attachments, or tether_stretch 0");
    }
  }
  rebuild_schedule(cloth, options.schedule);
  return cloth;
}

Cloth make_spring_net(const Points& positions, std::vector<double> mass,
                      std::vector<ClothSpring> springs, const std::vector<int>& pins,
                      const ScheduleOptions& schedule) {
  const Index n = positions.rows();
  ATELIER_CHECK(static_cast<Index>(mass.size()) == n, "one mass per particle");
  Cloth cloth;
  cloth.material.damping = 0;
  cloth.rest_positions = positions;
  cloth.faces.resize(0, 3);
  cloth.fixed.assign(static_cast<std::size_t>(n), 0);
  for (std::size_t v = 0; v < mass.size(); ++v) {
    ATELIER_CHECK(std::isfinite(mass[v]) && mass[v] > 0, "mass of particle " + std::to_string(v));
  }
  for (const ClothSpring& s : springs) {
    ATELIER_CHECK(s.a >= 0 && s.a < n && s.b >= 0 && s.b < n && s.a != s.b,
                  "spring between particles");
    ATELIER_CHECK(std::isfinite(s.stiffness) && s.stiffness >= 0 && s.rest >= 0,
                  "spring stiffness");
  }
  for (int v : pins) {
    ATELIER_CHECK(v >= 0 && v < n, "pin " + std::to_string(v) + " is no particle");
    cloth.fixed[v] = 1;
  }
  cloth.mass = std::move(mass);
  cloth.springs = std::move(springs);
  cloth.fibre_count = static_cast<int>(cloth.springs.size());
  cloth.sewing_begin = cloth.fibre_count;
  rebuild_schedule(cloth, schedule);
  return cloth;
}

Cloth join_cloths(const std::vector<Cloth>& cloths, const ScheduleOptions& schedule) {
  ATELIER_CHECK(!cloths.empty(), "no cloth to join");
  Cloth out;
  out.material = cloths[0].material;
  Index vertices = 0;
  Index faces = 0;
  for (const Cloth& c : cloths) {
    vertices += c.rest_positions.rows();
    faces += c.faces.rows();
  }
  out.rest_positions.resize(vertices, 3);
  out.faces.resize(faces, 3);
  int v0 = 0;
  Index f0 = 0;
  // Fibres of all, then shear springs of all, then sewing springs of all.
  for (int part = 0; part < 3; ++part) {
    v0 = 0;
    for (const Cloth& c : cloths) {
      const int begin = part == 0 ? 0 : part == 1 ? c.fibre_count : c.sewing_begin;
      const int end = part == 0   ? c.fibre_count
                      : part == 1 ? c.sewing_begin
                                  : static_cast<int>(c.springs.size());
      for (int i = begin; i < end; ++i) {
        ClothSpring s = c.springs[i];
        s.a += v0;
        s.b += v0;
        out.springs.push_back(s);
      }
      v0 += static_cast<int>(c.mass.size());
    }
    (part == 0 ? out.fibre_count : out.sewing_begin) =
        part < 2 ? static_cast<int>(out.springs.size()) : out.sewing_begin;
  }
  v0 = 0;
  int layer = 0;
  for (const Cloth& c : cloths) {
    const Index n = c.rest_positions.rows();
    out.rest_positions.middleRows(v0, n) = c.rest_positions;
    out.faces.middleRows(f0, c.faces.rows()) = c.faces.array() + v0;
    out.mass.insert(out.mass.end(), c.mass.begin(), c.mass.end());
    out.fixed.insert(out.fixed.end(), c.fixed.begin(), c.fixed.end());
    out.layer.insert(out.layer.end(), static_cast<std::size_t>(n), layer++);
    for (ClothHinge h : c.hinges) {
      h.edge0 += v0;
      h.edge1 += v0;
      h.left += v0;
      h.right += v0;
      out.hinges.push_back(h);
    }
    for (ClothCurvature around : c.curvatures) {
      for (int& vertex : around.vertices) {
        vertex += v0;
      }
      out.curvatures.push_back(std::move(around));
    }
    for (ClothStrain s : c.strains) {
      s.v0 += v0;
      s.v1 += v0;
      s.v2 += v0;
      out.strains.push_back(s);
    }
    for (ClothTether t : c.tethers) {
      t.vertex += v0;
      t.anchor += v0;
      out.tethers.push_back(t);
    }
    for (Attachment a : c.attachments) {
      a.vertex += v0;
      out.attachments.push_back(a);
    }
    v0 += static_cast<int>(n);
    f0 += c.faces.rows();
  }
  rebuild_schedule(out, schedule);
  return out;
}

}  // namespace atelier
