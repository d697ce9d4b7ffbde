#include "registration/front_and_back.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/boykov_kolmogorov_max_flow.hpp>

#include "core/error.h"
#include "core/normals.h"
#include "core/topology.h"
#include "registration/edge_paths.h"
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
  using Traits = boost::adjacency_list_traits<boost::vecS, boost::vecS, boost::directedS>;
  using Graph = boost::adjacency_list<
      boost::vecS, boost::vecS, boost::directedS,
      boost::property<boost::vertex_index_t, long,
                      boost::property<boost::vertex_color_t, boost::default_color_type,
                                      boost::property<boost::vertex_distance_t, long,
                                                      boost::property<boost::vertex_predecessor_t,
                                                                      Traits::edge_descriptor>>>>,
      boost::property<
          boost::edge_capacity_t, double,
          boost::property<boost::edge_residual_capacity_t, double,
                          boost::property<boost::edge_reverse_t, Traits::edge_descriptor>>>>;
  const auto faces = static_cast<std::size_t>(topology.faces.rows());
  Graph graph(faces + 2);
  auto capacity = boost::get(boost::edge_capacity, graph);
  auto reverse = boost::get(boost::edge_reverse, graph);
  const auto add = [&](std::size_t a, std::size_t b, double there, double back) {
    const auto forth = boost::add_edge(a, b, graph).first;
    const auto other = boost::add_edge(b, a, graph).first;
    capacity[forth] = there;
    capacity[other] = back;
    reverse[forth] = other;
    reverse[other] = forth;
  };
  for (std::size_t f = 0; f < faces; ++f) {
    const double weight = facing[static_cast<Index>(f)] * areas[static_cast<Index>(f)];
    add(faces, f, std::max(0.0, weight), 0);
    add(f, faces + 1, std::max(0.0, -weight), 0);
  }
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const auto sharing = corners_of_edge(topology, e);
    if (sharing.size() == 2) {
      const double cost = reach * lengths[static_cast<std::size_t>(e)];
      add(static_cast<std::size_t>(sharing[0] / 3), static_cast<std::size_t>(sharing[1] / 3), cost,
          cost);
    }
  }
  boost::boykov_kolmogorov_max_flow(graph, faces, faces + 1);
  const auto color = boost::get(boost::vertex_color, graph);
  std::vector<int> front(faces, 0);
  for (std::size_t f = 0; f < faces; ++f) {
    front[f] = color[f] == boost::black_color ? 1 : 0;
  }
  return front;
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
