#include "capture/surface/surface_from_points.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <mutex>
#include <string>
#include <vector>

#include "capture/surface/late/point_clouds.h"
#include "core/chosen_vertices.h"
#include "core/error.h"
#include "core/late_library.h"
#include "core/median.h"
#include "core/part_of_mesh.h"
#include "core/quantity_text.h"
#include "core/remesh/isotropic_remeshing.h"
#include "core/topology.h"
#include "core/tree.h"

namespace atelier {
namespace {

constexpr Index kMinPoints = 100;
constexpr const char* kLibrary = "libatelier_point_clouds.so";

void check_points(const Mesh& points) {
  check_mesh(points);
  if (points.vertices.rows() < kMinPoints) {
    throw DataError("", "points", std::to_string(points.vertices.rows()),
                    "at least " + std::to_string(kMinPoints) + ", to make a surface of");
  }
  if (points.normals.rows() != points.vertices.rows()) {
    throw DataError("", "points", "no normals", "oriented points");
  }
}

Mesh poisson(const Mesh& points, const SurfaceOptions& options) {
  // PCL's octree keeps its nodes in static storage: one surface at a time.
  static std::mutex one_at_a_time;
  const std::lock_guard lock(one_at_a_time);
  static const auto poisson_surface =
      late_function<decltype(atelier_poisson_surface)>(kLibrary, "atelier_poisson_surface");
  Mesh surface;
  poisson_surface(points, options.octree_depth, options.point_weight, surface);
  return surface;
}

/// Without the faces that have a vertex for which `keep` is false, and without unused vertices.
Mesh trimmed(const Mesh& mesh, const std::vector<char>& keep) {
  std::vector<Index> faces;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    const auto kept = [&](int k) { return keep[static_cast<std::size_t>(mesh.faces(f, k))] != 0; };
    if (kept(0) && kept(1) && kept(2)) {
      faces.push_back(f);
    }
  }
  return part_of_mesh(mesh, faces);
}

/// m from a point to its sixth neighbour: the median over some points.
double spacing_of(const Points& points) {
  constexpr Index kAsked = 200;
  constexpr Index kNeighbour = 6;
  std::vector<double> spacings;
  for (Index k = 0; k < kAsked; ++k) {
    const Eigen::RowVector3d own = points.row(k * points.rows() / kAsked);
    Eigen::VectorXd squared = (points.rowwise() - own).rowwise().squaredNorm();
    std::nth_element(squared.begin(), squared.begin() + kNeighbour, squared.end());
    spacings.push_back(std::sqrt(squared(kNeighbour)));
  }
  return median(spacings);
}

/// Whether the piece of each vertex has the area.
std::vector<char> of_large_pieces(const Mesh& mesh, double min_area) {
  const Components pieces = connected_components(topology_of(mesh.faces, mesh.vertices.rows()));
  std::vector<double> area(static_cast<std::size_t>(pieces.count), 0);
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    const Eigen::Vector3d a = mesh.vertices.row(mesh.faces(f, 0)).transpose();
    const Eigen::Vector3d b = mesh.vertices.row(mesh.faces(f, 1)).transpose();
    const Eigen::Vector3d c = mesh.vertices.row(mesh.faces(f, 2)).transpose();
    area[static_cast<std::size_t>(pieces.of_face[static_cast<std::size_t>(f)])] +=
        0.5 * (b - a).cross(c - a).norm();
  }
  std::vector<char> keep;
  for (const int piece : pieces.of_vertex) {
    keep.push_back(area[static_cast<std::size_t>(piece)] >= min_area ? 1 : 0);
  }
  return keep;
}

/// Of the nearest points. Farther than `beyond` from any, nobody saw the surface: confidence 0.
void take_attributes(Mesh& mesh, const Mesh& points, const std::vector<ClosestPoint>& nearest,
                     double beyond) {
  const Index n = mesh.vertices.rows();
  mesh.colors.resize(points.colors.rows() > 0 ? n : 0, 3);
  mesh.confidence.resize(points.confidence.size() > 0 ? n : 0);
  for (Index i = 0; i < n; ++i) {
    const int row = nearest[static_cast<std::size_t>(i)].face;
    if (mesh.colors.rows() > 0) {
      mesh.colors.row(i) = points.colors.row(row);
    }
    if (mesh.confidence.size() > 0) {
      const double squared = nearest[static_cast<std::size_t>(i)].squared_distance;
      mesh.confidence(i) = squared <= beyond * beyond ? points.confidence(row) : 0;
    }
    if (!points.labels.empty()) {
      mesh.labels.push_back(points.labels[static_cast<std::size_t>(row)]);
    }
  }
}

}  // namespace

OptionTable describe(SurfaceOptions& options) {
  OptionTable table;
  table.add("neighbours", options.neighbours, 2, 1000, "",
            "Number of neighbours of a point whose mean distance identifies outliers");
  table.add("outlier_sigma", options.outlier_sigma, 0.1, 100, "",
            "Number of standard deviations of the mean neighbour distance beyond which a point is "
            "an outlier");
  table.add("octree_depth", options.octree_depth, 4, 12, "",
            "Octree depth of Poisson reconstruction: 2^depth cells along the longest side");
  table.add(
      "point_weight", options.point_weight, 0, 100, "",
      "Weight of the points in screened Poisson reconstruction; higher fits them more closely");
  table.add("trim", options.trim, 0.001, 1, "m",
            "Distance to the nearest point beyond which the surface is cut away; more where points "
            "are sparse");
  table.add("min_component_area", options.min_component_area, 0, 100, "m2",
            "Minimum area of a connected component that is kept");
  table.add("edge_length", options.edge_length, 0, 1, "m",
            "Edge length of the isotropic remeshing of the result; 0: no remeshing");
  return table;
}

Mesh without_outliers(const Mesh& points, const SurfaceOptions& options) {
  check_points(points);
  static const auto sound_points =
      late_function<decltype(atelier_sound_points)>(kLibrary, "atelier_sound_points");
  std::vector<int> rows;
  sound_points(points, options.neighbours, options.outlier_sigma, rows);
  return chosen_vertices(points, rows);
}

Mesh surface_from_points(const Mesh& points, const SurfaceOptions& options) {
  check_points(points);
  Mesh mesh = poisson(points, options);
  const TriangleTree tree = build_point_tree(points.vertices);
  constexpr double kSpacings = 2.5;  // sparse points support what is between them
  constexpr double kBeyond = 1.2;    // of random points, one place in 5,000 is so far from any
  const double spacing = spacing_of(points.vertices);
  const double trim = std::max(options.trim, kSpacings * spacing);
  std::vector<char> supported;
  for (const ClosestPoint& nearest : closest_points(tree, mesh.vertices)) {
    supported.push_back(nearest.squared_distance <= trim * trim ? 1 : 0);
  }
  mesh = trimmed(mesh, supported);
  if (mesh.faces.rows() == 0) {
    throw DataError("", "points", "no surface within " + short_number(trim) + " m",
                    "points that lie on one; check their normals, or raise trim");
  }
  if (options.edge_length > 0) {
    mesh = isotropic_remeshing(mesh, {.edge_length = options.edge_length,
                                      .holes = {},
                                      .rounds = 3,
                                      .relaxations = 1,
                                      .rims_relax = false});
  }
  // After remeshing, which parts pieces that touch in a vertex.
  mesh = trimmed(mesh, of_large_pieces(mesh, options.min_component_area));
  take_attributes(mesh, points, closest_points(tree, mesh.vertices), kBeyond * spacing);
  return mesh;
}

}  // namespace atelier
