#include "registration/front_and_back.h"

#include <Eigen/SparseCholesky>
#include <algorithm>

#include "core/error.h"
#include "core/normals.h"
#include "core/topology.h"
#include "registration/edge_paths.h"
#include "registration/minimum_cut.h"
#include "registration/surface_cut.h"

namespace atelier {
namespace {

/// z of the normals of faces, smoothed: (area + reach^2 L) z = area z0, with the graph Laplacian of
/// neighbouring faces, which no triangle's shape can upset.
Eigen::VectorXd smooth_facing(const Mesh& mesh, const Triangles& neighbors,
                              const Eigen::VectorXd& areas, double reach) {
  const Index faces = mesh.faces.rows();
  const Points normals = face_normals(mesh.vertices, mesh.faces);
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd right(faces);
  for (Index f = 0; f < faces; ++f) {
    const double own = std::max(areas[f], 1e-12);
    right[f] = own * normals(f, 2);
    double sum = own;
    for (int k = 0; k < 3; ++k) {
      if (neighbors(f, k) >= 0) {
        sum += reach * reach;
        entries.emplace_back(f, neighbors(f, k), -reach * reach);
      }
    }
    entries.emplace_back(f, f, sum);
  }
  Eigen::SparseMatrix<double> system(faces, faces);
  system.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(system);
  return solver.solve(right);
}

/// Two sides of least cost: 1 in front.
std::vector<int> cut_in_two(const Topology& topology, const Eigen::VectorXd& facing,
                            const Eigen::VectorXd& areas, const std::vector<double>& lengths,
                            double reach) {
  const auto faces = static_cast<std::size_t>(topology.faces.rows());
  std::vector<double> in_front(faces);
  std::vector<double> at_the_back(faces);
  for (std::size_t f = 0; f < faces; ++f) {
    const double weight = facing[static_cast<Index>(f)] * areas[static_cast<Index>(f)];
    in_front[f] = std::max(0.0, -weight);
    at_the_back[f] = std::max(0.0, weight);
  }
  std::vector<CutLink> links;
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const auto sharing = corners_of_edge(topology, e);
    if (sharing.size() == 2) {
      links.push_back({static_cast<std::size_t>(sharing[0] / 3),
                       static_cast<std::size_t>(sharing[1] / 3),
                       reach * lengths[static_cast<std::size_t>(e)]});
    }
  }
  const std::vector<char> sides = minimum_cut(in_front, at_the_back, links);
  return {sides.begin(), sides.end()};
}

}  // namespace

std::vector<char> front_and_back(const Mesh& mesh, double reach) {
  ATELIER_CHECK(reach > 0, "a reach of more than zero");
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  const Triangles neighbors = face_neighbors(topology);
  const Eigen::VectorXd areas = face_areas(mesh.vertices, mesh.faces);
  const Eigen::VectorXd facing = smooth_facing(mesh, neighbors, areas, reach);
  const std::vector<double> lengths = edge_lengths(topology, mesh.vertices);
  std::vector<int> front = cut_in_two(topology, facing, areas, lengths, reach);
  // Small pieces go to the other side, with what surrounds them.
  for (int round = 0; round < 8; ++round) {
    const SurfaceCut cut = cut_surface(topology, cut_between_labels(topology, front));
    std::vector<double> sizes(static_cast<std::size_t>(cut.panel_count), 0);
    for (Index f = 0; f < mesh.faces.rows(); ++f) {
      sizes[static_cast<std::size_t>(cut.panels[static_cast<std::size_t>(f)])] += areas[f];
    }
    std::size_t smallest = sizes.size();
    for (std::size_t p = 0; p < sizes.size(); ++p) {
      if (sizes[p] < areas.sum() / 30 && (smallest == sizes.size() || sizes[p] < sizes[smallest])) {
        smallest = p;
      }
    }
    if (smallest == sizes.size()) {
      break;
    }
    for (std::size_t f = 0; f < front.size(); ++f) {
      if (cut.panels[f] == static_cast<int>(smallest)) {
        front[f] = 1 - front[f];
      }
    }
  }
  return cut_between_labels(topology, front);
}

}  // namespace atelier
