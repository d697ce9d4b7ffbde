#include "core/mesh_statistics.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/normals.h"
#include "core/saturating_cast.h"
#include "core/topology.h"

namespace atelier {
namespace {

double quantile(const std::vector<double>& sorted, double share) {
  const double at = share * static_cast<double>(sorted.size() - 1);
  const auto below = saturating_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (at - std::floor(at)) * (sorted[above] - sorted[below]);
}

/// Divergence theorem, about the centre of the bounds, so that a mesh far from the origin loses no
/// digits.
double signed_volume(const Mesh& mesh, const Eigen::Vector3d& center) {
  double six_volumes = 0;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    const auto corner = [&](int k) -> Eigen::Vector3d {
      return mesh.vertices.row(mesh.faces(f, k)).transpose() - center;
    };
    six_volumes += corner(0).dot(corner(1).cross(corner(2)));
  }
  return six_volumes / 6;
}

bool is_degenerate(const Eigen::RowVector3i& face) {
  return face[0] == face[1] || face[1] == face[2] || face[2] == face[0];
}

/// True for a face no higher than rounding makes it over its longest edge.
bool is_flat(const Mesh& mesh, Index face, double area) {
  constexpr double kRounding = 1e-10;
  double longest = 0;
  for (int k = 0; k < 3; ++k) {
    longest = std::max(longest, (mesh.vertices.row(mesh.faces(face, k)) -
                                 mesh.vertices.row(mesh.faces(face, (k + 1) % 3)))
                                    .squaredNorm());
  }
  return !(area > kRounding * longest);
}

}  // namespace

MeshStatistics mesh_statistics(const Mesh& mesh, const MeshStatisticsOptions& options) {
  check_mesh(mesh);
  ATELIER_CHECK(std::all_of(options.edge_quantiles.begin(), options.edge_quantiles.end(),
                            [](double share) { return share >= 0 && share <= 1; }),
                "quantiles are in [0, 1]");
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  const ManifoldDefects defects = manifold_defects(topology);
  MeshStatistics result;
  result.vertices = mesh.vertices.rows();
  result.faces = mesh.faces.rows();
  result.edges = topology.edges.rows();
  result.components = connected_components(topology).count;
  result.non_manifold_edges = static_cast<Index>(defects.non_manifold_edges.size());
  result.inconsistent_edges = static_cast<Index>(defects.inconsistent_edges.size());
  result.degenerate_faces = static_cast<Index>(defects.degenerate_faces.size());
  result.isolated_vertices = static_cast<Index>(defects.isolated_vertices.size());
  result.boundary_loops = static_cast<Index>(boundary_loops(topology).size());
  const Eigen::VectorXd areas = face_areas(mesh.vertices, mesh.faces);
  result.area = areas.sum();
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    if (!is_degenerate(mesh.faces.row(f)) && is_flat(mesh, f, areas[f])) {
      result.first_flat_face =
          result.flat_faces == 0 ? static_cast<int>(f) : result.first_flat_face;
      ++result.flat_faces;
    }
  }
  if (mesh.vertices.rows() > 0) {
    result.lowest = mesh.vertices.colwise().minCoeff();
    result.highest = mesh.vertices.colwise().maxCoeff();
  }
  if (result.faces > result.degenerate_faces && is_closed(topology) &&
      defects.inconsistent_edges.empty()) {
    result.volume = signed_volume(mesh, 0.5 * (result.lowest + result.highest));
  }
  std::vector<double> lengths(static_cast<std::size_t>(topology.edges.rows()));
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    lengths[static_cast<std::size_t>(e)] =
        (mesh.vertices.row(topology.edges(e, 0)) - mesh.vertices.row(topology.edges(e, 1))).norm();
    if (topology.edge_offsets[static_cast<std::size_t>(e) + 1] -
            topology.edge_offsets[static_cast<std::size_t>(e)] ==
        1) {
      result.boundary_length += lengths[static_cast<std::size_t>(e)];
    }
  }
  std::sort(lengths.begin(), lengths.end());
  if (!lengths.empty()) {
    for (const double share : options.edge_quantiles) {
      result.edge_lengths.push_back(quantile(lengths, share));
    }
  }
  return result;
}

double mean_edge_length(const Mesh& mesh) {
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  double sum = 0;
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    sum +=
        (mesh.vertices.row(topology.edges(e, 0)) - mesh.vertices.row(topology.edges(e, 1))).norm();
  }
  return sum / static_cast<double>(std::max<Index>(1, topology.edges.rows()));
}

}  // namespace atelier
