#include "registration/flattening/rise_seams.h"

#include <cmath>
#include <limits>

#include "registration/edge_paths.h"
#include "registration/flattening/limb_root.h"
#include "registration/flattening/worn_rims.h"

namespace atelier {

std::vector<char> rise_seams(const Mesh& mesh, const Topology& topology,
                             const Eigen::Vector3d& facing) {
  constexpr double kOffMiddle = 0.02;  // m that costs as much again
  std::vector<char> cut(static_cast<std::size_t>(topology.edges.rows()), 0);
  const WornRims rims = worn_rims(mesh, topology, facing);
  if (rims.limbs.legs.empty() || rims.limbs.central.empty()) {
    return cut;
  }
  const EdgeGraph graph(topology);
  const std::vector<double> lengths = edge_lengths(topology, mesh.vertices);
  const EdgePaths paths = graph.paths_from(rims.loops[rims.limbs.legs.front()].vertices, lengths);
  const int crotch = limb_root(mesh, topology, paths).vertex;
  constexpr double kAtMiddle = 0.06;  // m
  if (crotch < 0 || std::abs(mesh.vertices.row(crotch).dot(rims.left) - rims.middle) > kAtMiddle) {
    return cut;
  }
  std::vector<int> waist;
  for (const std::size_t central : rims.limbs.central) {
    const RimLoop& loop = rims.loops[central];
    if (loop.low > mesh.vertices(crotch, 1)) {
      waist.insert(waist.end(), loop.vertices.begin(), loop.vertices.end());
    }
  }
  if (waist.empty()) {
    return cut;
  }
  for (const int side : {1, -1}) {
    std::vector<double> costs = lengths;
    for (Index e = 0; e < topology.edges.rows(); ++e) {
      const Eigen::Vector3d at =
          (mesh.vertices.row(topology.edges(e, 0)) + mesh.vertices.row(topology.edges(e, 1))) / 2;
      const double ahead = side * (at - Eigen::Vector3d(mesh.vertices.row(crotch))).dot(facing);
      const double off = (at.dot(rims.left) - rims.middle) / kOffMiddle;
      costs[static_cast<std::size_t>(e)] *= 1 + off * off;
      if (corners_of_edge(topology, e).size() != 2 || ahead < -kOffMiddle) {
        costs[static_cast<std::size_t>(e)] = std::numeric_limits<double>::infinity();
      }
    }
    const EdgePaths to_waist = graph.paths_from(waist, costs);
    if (std::isfinite(to_waist.distances[static_cast<std::size_t>(crotch)])) {
      for (const int edge : graph.way_back(to_waist, crotch)) {
        cut[static_cast<std::size_t>(edge)] = 1;
      }
    }
  }
  return cut;
}

}  // namespace atelier
