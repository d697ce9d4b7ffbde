#include "registration/tracking/garment_scan.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/normals.h"
#include "core/parallel.h"
#include "registration/rim_vertices.h"

namespace atelier {
namespace {

using Vector3 = Eigen::Vector3d;

Vector3 at(const Points& x, Index v) {
  return x.row(v).transpose();
}

Vector3 interpolated(const Points& values, const Triangles& faces, const ClosestPoint& closest) {
  Vector3 sum = Vector3::Zero();
  for (int k = 0; k < 3; ++k) {
    sum += closest.barycentric[k] * at(values, faces(closest.face, k));
  }
  return sum;
}

SurfaceRow vertex_row(Index v, const Vector3& point, const Vector3& normal, double weight,
                      double scale) {
  const int vertex = static_cast<int>(v);
  SurfaceRow row;
  row.vertices = {vertex, vertex, vertex};
  row.normal = normal;
  row.offset = normal.dot(point);
  row.weight = weight;
  row.scale = scale;
  return row;
}

/// Sum over a vertex's boundary edges of the directions that leave the surface there, in it.
Points boundary_conormals(const Points& x, const Topology& topology, std::vector<char>& border) {
  Points sums = Points::Zero(x.rows(), 3);
  border.assign(static_cast<std::size_t>(x.rows()), 0);
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const auto corners = corners_of_edge(topology, e);
    if (corners.size() != 1) {
      continue;
    }
    const int face = corners[0] / 3;
    const int k = corners[0] % 3;
    const int a = topology.faces(face, k);
    const int b = topology.faces(face, (k + 1) % 3);
    const Vector3 along = at(x, b) - at(x, a);
    const Vector3 inward = at(x, topology.faces(face, (k + 2) % 3)) - at(x, a);
    const double squared = along.squaredNorm();
    const Vector3 out = squared > 0 ? Vector3(along * (along.dot(inward) / squared) - inward)
                                    : Vector3(Vector3::Zero());
    const double length = out.norm();
    for (const int v : {a, b}) {
      border[static_cast<std::size_t>(v)] = 1;
      if (length > 0) {
        sums.row(v) += std::sqrt(squared) / length * out.transpose();
      }
    }
  }
  for (Index v = 0; v < sums.rows(); ++v) {
    const double length = sums.row(v).norm();
    sums.row(v) /= length > 1e-12 ? length : 1;
  }
  return sums;
}

/// The vertices of the border that are openings.
void set_openings(GarmentScan& part, const std::vector<char>& open) {
  part.border_vertices.clear();
  for (std::size_t v = 0; v < open.size(); ++v) {
    if (open[v] != 0) {
      part.border_vertices.push_back(static_cast<int>(v));
    }
  }
  Points points(static_cast<Index>(part.border_vertices.size()), 3);
  for (std::size_t i = 0; i < part.border_vertices.size(); ++i) {
    points.row(static_cast<Index>(i)) = part.vertices.row(part.border_vertices[i]);
  }
  part.border_tree = build_point_tree(points);
}

}  // namespace

GarmentScan garment_scan(const Mesh& scan, const std::vector<std::uint8_t>& labels,
                         const std::string& file, const GarmentScanOptions& options) {
  check_mesh(scan, file);
  GarmentScan part;
  std::vector<char> wanted(static_cast<std::size_t>(scan.vertices.rows()), 1);
  for (std::size_t v = 0; v < scan.labels.size(); ++v) {
    wanted[v] = std::find(labels.begin(), labels.end(), scan.labels[v]) != labels.end() ? 1 : 0;
  }
  for (Index v = 0; v < scan.confidence.size(); ++v) {
    if (!(scan.confidence[v] > 0)) {
      wanted[static_cast<std::size_t>(v)] = 0;
    }
  }
  std::vector<Index> kept;
  for (Index f = 0; f < scan.faces.rows(); ++f) {
    const auto is = [&](int k) { return wanted[static_cast<std::size_t>(scan.faces(f, k))] != 0; };
    if (is(0) && is(1) && is(2)) {
      kept.push_back(f);
    }
  }
  if (kept.empty()) {
    return part;
  }
  Triangles faces(static_cast<Index>(kept.size()), 3);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    faces.row(static_cast<Index>(i)) = scan.faces.row(kept[i]);
  }
  // Specks of wrong labels are no cloth.
  const Components pieces = connected_components(topology_of(faces, scan.vertices.rows()));
  const Eigen::VectorXd face_area = face_areas(scan.vertices, faces);
  Eigen::VectorXd piece_area = Eigen::VectorXd::Zero(pieces.count);
  for (Index f = 0; f < faces.rows(); ++f) {
    piece_area[pieces.of_face[static_cast<std::size_t>(f)]] += face_area[f];
  }
  const double least = options.min_component_area * face_area.sum();
  const Points all_normals = vertex_normals(scan.vertices, scan.faces);
  std::vector<int> to(static_cast<std::size_t>(scan.vertices.rows()), -1);
  std::vector<int> from;
  Index count = 0;
  part.faces.resize(faces.rows(), 3);
  for (Index f = 0; f < faces.rows(); ++f) {
    if (!(piece_area[pieces.of_face[static_cast<std::size_t>(f)]] >= least)) {
      continue;
    }
    for (int k = 0; k < 3; ++k) {
      int& index = to[static_cast<std::size_t>(faces(f, k))];
      if (index < 0) {
        index = static_cast<int>(from.size());
        from.push_back(faces(f, k));
      }
      part.faces(count, k) = index;
    }
    ++count;
  }
  part.faces.conservativeResize(count, 3);
  part.vertices.resize(static_cast<Index>(from.size()), 3);
  part.normals.resize(part.vertices.rows(), 3);
  for (std::size_t v = 0; v < from.size(); ++v) {
    part.vertices.row(static_cast<Index>(v)) = scan.vertices.row(from[v]);
    part.normals.row(static_cast<Index>(v)) = all_normals.row(from[v]);
  }
  part.areas = vertex_areas(part.vertices, part.faces);
  const Topology topology = topology_of(part.faces, part.vertices.rows());
  part.conormals = boundary_conormals(part.vertices, topology, part.border);
  part.tree = build_tree(part.vertices, part.faces);
  set_openings(part, part.border);
  return part;
}

GarmentScan without_covered_border(GarmentScan part, const GarmentScan& other,
                                   const TriangleTree& body) {
  constexpr double kTouch = 0.02;   // m
  constexpr double kAside = 0.015;  // m off the border, where what lies over it is not yet a slope
  if (other.faces.rows() == 0 || body.nodes.empty()) {
    return part;
  }
  std::vector<char> open(part.border.size(), 0);
  std::vector<int> touching;
  double higher = 0;
  for (const int v : part.border_vertices) {
    open[static_cast<std::size_t>(v)] = 1;
    if (closest_point(other.tree, at(part.vertices, v), kTouch).face < 0) {
      continue;
    }
    touching.push_back(v);
    const Vector3 aside = kAside * at(part.conormals, v);
    const auto height = [&](const TriangleTree& tree, const Vector3& near) {
      return std::sqrt(closest_point(body, closest_point(tree, near).point).squared_distance);
    };
    higher += height(other.tree, at(part.vertices, v) + aside) -
              height(part.tree, at(part.vertices, v) - aside);
  }
  if (touching.empty() || higher <= 0) {
    return part;
  }
  for (const int v : touching) {
    open[static_cast<std::size_t>(v)] = 0;
  }
  set_openings(part, open);
  return part;
}

namespace {

/// True if the closest point lies where the part ends.
bool on_border(const GarmentScan& scan, const ClosestPoint& closest) {
  for (int k = 0; k < 3; ++k) {
    if (closest.barycentric[k] > 1e-9 &&
        scan.border[static_cast<std::size_t>(scan.faces(closest.face, k))] == 0) {
      return false;
    }
  }
  return true;
}

bool goes_on(const ClothModel& model, Index v) {
  return !model.goes_on.empty() && model.goes_on[static_cast<std::size_t>(v)] != 0;
}

/// Cloth to scan: one row for each vertex, and one more for those of the cloth's boundary that lie
/// beyond the scan's.
void add_cloth_rows(const ClothModel& model, const Points& x, const Points& normals,
                    const Points& conormals, const std::vector<char>& border,
                    const GarmentScan& scan, const ScanRowOptions& options, ScanRows& result) {
  std::vector<SurfaceRow> rows(static_cast<std::size_t>(2 * x.rows()));
  parallel_for(x.rows(), 128, [&](Index begin, Index end) {
    for (Index v = begin; v < end; ++v) {
      const Vector3 here = at(x, v);
      const Vector3 normal = at(normals, v);
      const double area = model.areas[v];
      const ClosestPoint closest = closest_point(scan.tree, here, options.reach);
      if (closest.face < 0) {
        continue;
      }
      const Vector3 scan_normal = interpolated(scan.normals, scan.faces, closest).normalized();
      const bool ends = on_border(scan, closest);
      const auto row = static_cast<std::size_t>(2 * v);
      if (!ends && scan_normal.dot(normal) > options.same_way) {
        rows[row] =
            vertex_row(v, closest.point, scan_normal, 0.5 * options.weight * area, options.scale);
        result.support[v] = 1;
      }
      if (border[static_cast<std::size_t>(v)] == 0 || scan.border_vertices.empty() ||
          goes_on(model, v)) {
        continue;
      }
      const ClosestPoint edge = closest_point(scan.border_tree, here, options.border_reach);
      if (edge.face < 0) {
        continue;
      }
      const int on = scan.border_vertices[static_cast<std::size_t>(edge.face)];
      const Vector3 out = at(scan.conormals, on);
      const Vector3 mine = at(conormals, v);
      const double beyond = out.dot(here - edge.point);
      // Cloth that ends short of the border is pulled by the scan's own points.
      if (ends && beyond > 0 && out.dot(mine) > 0.6 &&
          at(scan.normals, on).dot(normal) > options.same_way) {
        rows[row + 1] = vertex_row(v, edge.point, out, 0.5 * options.border_weight * area,
                                   options.border_reach / 2);
      }
    }
  });
  for (const SurfaceRow& row : rows) {
    if (row.weight > 0) {
      result.rows.push_back(row);
    }
  }
}

/// Scan to cloth: one row for each point, to the plane of what is nearest; beyond the cloth's
/// boundary one that pulls it outwards.
void add_scan_rows(const ClothModel& model, const Points& normals, const Points& conormals,
                   const std::vector<char>& border, const TriangleTree& tree,
                   const GarmentScan& scan, const ScanRowOptions& options, ScanRows& result) {
  const Index count = (scan.vertices.rows() - options.first + options.every - 1) / options.every;
  const Triangles& faces = model.topology.faces;
  std::vector<SurfaceRow> rows(static_cast<std::size_t>(count));
  parallel_for(count, 256, [&](Index begin, Index end) {
    for (Index n = begin; n < end; ++n) {
      const Index i = options.first + n * options.every;
      const Vector3 point = at(scan.vertices, i);
      const ClosestPoint closest = closest_point(tree, point, options.reach);
      if (closest.face < 0) {
        continue;
      }
      const Vector3 normal = interpolated(normals, faces, closest).normalized();
      const Vector3 scan_normal = at(scan.normals, i);
      if (!(scan_normal.dot(normal) > options.same_way)) {
        continue;
      }
      bool ends = true;
      bool unknown = false;
      for (int k = 0; k < 3; ++k) {
        const int corner = faces(closest.face, k);
        const bool near = closest.barycentric[k] > 1e-9;
        ends = ends && (!near || border[static_cast<std::size_t>(corner)] != 0);
        unknown = unknown || (near && goes_on(model, corner));
      }
      SurfaceRow& row = rows[static_cast<std::size_t>(n)];
      for (int k = 0; k < 3; ++k) {
        row.vertices[static_cast<std::size_t>(k)] = faces(closest.face, k);
      }
      row.barycentric = closest.barycentric;
      row.scale = options.scale;
      row.weight = 0.5 * options.weight * options.every * scan.areas[i];
      row.normal = scan_normal;
      if (ends) {
        const Vector3 out = interpolated(conormals, faces, closest).normalized();
        if (unknown || !(std::sqrt(closest.squared_distance) < options.border_reach) ||
            !(out.dot(point - closest.point) > 0)) {
          row.weight = 0;
          continue;
        }
        row.normal = out;
        row.weight *= options.border_weight;
        row.scale = options.border_reach / 2;
      }
      row.offset = row.normal.dot(point);
    }
  });
  for (const SurfaceRow& row : rows) {
    if (row.weight > 0) {
      result.rows.push_back(row);
    }
  }
}

}  // namespace

std::vector<char> covered_rim(const Topology& topology, const Points& x, const GarmentScan& scan) {
  std::vector<char> rim = rim_vertices(topology);
  std::vector<char> covered = scan.border;
  for (const int v : scan.border_vertices) {
    covered[static_cast<std::size_t>(v)] = 0;
  }
  std::vector<Index> border;
  for (std::size_t v = 0; v < scan.border.size(); ++v) {
    if (scan.border[v] != 0) {
      border.push_back(static_cast<Index>(v));
    }
  }
  const TriangleTree tree = build_point_tree(scan.vertices(border, Eigen::all));
  for (Index v = 0; v < x.rows(); ++v) {
    char& is = rim[static_cast<std::size_t>(v)];
    if (is != 0) {
      const ClosestPoint nearest = closest_point(tree, at(x, v));
      is = nearest.face >= 0
               ? covered[static_cast<std::size_t>(border[static_cast<std::size_t>(nearest.face)])]
               : 0;
    }
  }
  return rim;
}

ScanRows scan_rows(const ClothModel& model, const Points& x, const TriangleTree& tree,
                   const GarmentScan& scan, const ScanRowOptions& options) {
  ScanRows result;
  result.support = Eigen::VectorXd::Zero(x.rows());
  if (scan.faces.rows() == 0) {
    return result;
  }
  const Points normals = vertex_normals(x, model.topology.faces);
  std::vector<char> border;
  const Points conormals = boundary_conormals(x, model.topology, border);
  add_cloth_rows(model, x, normals, conormals, border, scan, options, result);
  add_scan_rows(model, normals, conormals, border, tree, scan, options, result);
  return result;
}

BodyObstacle body_obstacle(const Points& vertices, const Triangles& faces) {
  BodyObstacle body;
  body.vertices = vertices;
  body.faces = faces;
  body.normals = vertex_normals(vertices, faces);
  body.tree = build_tree(vertices, faces);
  return body;
}

namespace {

/// A point of the cloth that stands for its area, not yet with a plane: vertices come first, then
/// the centres of triangles.
SurfaceRow cloth_point(const ClothModel& model, Index i) {
  SurfaceRow row;
  const auto vertex = static_cast<int>(i);
  const Index face = i - model.areas.size();
  if (face < 0) {
    row.vertices = {vertex, vertex, vertex};
    row.weight = model.areas[i];
    return row;
  }
  row.barycentric = Vector3::Constant(1.0 / 3);
  for (int k = 0; k < 3; ++k) {
    const int corner = model.topology.faces(face, k);
    row.vertices[static_cast<std::size_t>(k)] = corner;
    row.weight += model.areas[corner] / 6;  // each corner has six triangles, about
  }
  return row;
}

}  // namespace

std::vector<SurfaceRow> body_rows(const ClothModel& model, const Points& x,
                                  const BodyObstacle& body, const BodyRowOptions& options) {
  if (body.faces.rows() == 0) {
    return {};
  }
  const Index count = x.rows() + (options.centres ? model.topology.faces.rows() : 0);
  std::vector<SurfaceRow> all(static_cast<std::size_t>(count));
  parallel_for(count, 128, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      SurfaceRow row = cloth_point(model, i);
      Vector3 here = Vector3::Zero();
      for (int k = 0; k < 3; ++k) {
        here += row.barycentric[k] * at(x, row.vertices[static_cast<std::size_t>(k)]);
      }
      const ClosestPoint closest = closest_point(body.tree, here, options.reach);
      if (closest.face < 0) {
        continue;
      }
      row.normal = interpolated(body.normals, body.faces, closest).normalized();
      if (row.normal.dot(here - closest.point) < options.gap) {
        row.offset = row.normal.dot(closest.point) + options.gap;
        row.weight *= options.weight;
        all[static_cast<std::size_t>(i)] = row;
      }
    }
  });
  std::erase_if(all, [](const SurfaceRow& row) { return row.weight <= 0; });
  return all;
}

}  // namespace atelier
