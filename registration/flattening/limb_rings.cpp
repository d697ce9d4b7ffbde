#include "registration/flattening/limb_rings.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/normals.h"
#include "registration/edge_paths.h"
#include "registration/flattening/limb_root.h"
#include "registration/flattening/loop_across.h"
#include "registration/flattening/surface_cut.h"
#include "registration/flattening/worn_rims.h"

namespace atelier {
namespace {

constexpr double kNowhere = std::numeric_limits<double>::infinity();
constexpr double kMostOfLimb = 0.35;  // of the area

std::vector<int> vertices_of_way(const EdgeGraph& graph, const EdgePaths& paths, int from) {
  std::vector<int> vertices{from};
  for (const int edge : graph.way_back(paths, from)) {
    vertices.push_back(graph.other_end(edge, vertices.back()));
  }
  return vertices;
}

/// Edges of the loop round one arm; empty where there is none.
std::vector<int> ring_of(const Mesh& mesh, const Topology& topology, const EdgeGraph& graph,
                         const std::vector<double>& lengths, const std::vector<RimLoop>& loops,
                         std::size_t arm, const Eigen::Vector3d& outwards) {
  const EdgePaths paths = graph.paths_from(loops[arm].vertices, lengths);
  const LimbRoot root = limb_root(mesh, topology, paths);
  const int armpit = root.vertex;
  if (armpit < 0) {
    return {};
  }
  std::vector<int> others;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    if (i != arm) {
      others.insert(others.end(), loops[i].vertices.begin(), loops[i].vertices.end());
    }
  }
  if (others.empty()) {
    return {};
  }
  // From the opening through the armpit to another one: what goes round the arm crosses it once.
  std::vector<int> arc = vertices_of_way(graph, paths, armpit);
  std::vector<double> apart = lengths;  // the way on does not come back to the way here
  for (const int v : arc) {
    if (v != armpit) {
      for (const int e : graph.edges_of(v)) {
        apart[static_cast<std::size_t>(e)] = kNowhere;
      }
    }
  }
  const EdgePaths away = graph.paths_from(others, apart);
  if (!std::isfinite(away.distances[static_cast<std::size_t>(armpit)])) {
    return {};
  }
  std::reverse(arc.begin(), arc.end());
  const std::vector<int> onwards = vertices_of_way(graph, away, armpit);
  arc.insert(arc.end(), onwards.begin() + 1, onwards.end());
  constexpr double kOffPlane = 0.02;  // m that costs as much again
  const Eigen::Vector3d along = (loops[arm].middle - root.middle).normalized();
  const Eigen::Vector3d normal = (along + outwards).normalized();
  const Eigen::Vector3d at_armpit = mesh.vertices.row(armpit);
  std::vector<double> costs = lengths;
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const Eigen::Vector3d at =
        (mesh.vertices.row(topology.edges(e, 0)) + mesh.vertices.row(topology.edges(e, 1))) / 2;
    costs[static_cast<std::size_t>(e)] *= 1 + std::pow((at - at_armpit).dot(normal) / kOffPlane, 2);
    if (corners_of_edge(topology, e).size() != 2) {
      costs[static_cast<std::size_t>(e)] = kNowhere;
    }
  }
  return loop_across(topology, graph, arc, armpit, costs);
}

}  // namespace

std::vector<char> limb_rings(const Mesh& mesh, const Topology& topology,
                             const Eigen::Vector3d& facing) {
  const std::vector<char> none(static_cast<std::size_t>(topology.edges.rows()), 0);
  std::vector<char> cut = none;
  const WornRims rims = worn_rims(mesh, topology, facing);
  const std::vector<RimLoop>& loops = rims.loops;
  const Eigen::Vector3d& left = rims.left;
  if (rims.limbs.arms.empty()) {
    return cut;
  }
  const EdgeGraph graph(topology);
  const std::vector<double> lengths = edge_lengths(topology, mesh.vertices);
  const Eigen::VectorXd areas = face_areas(mesh.vertices, mesh.faces);
  for (const std::size_t arm : rims.limbs.arms) {
    std::vector<char> with = cut;
    for (const int edge : ring_of(mesh, topology, graph, lengths, loops, arm,
                                  loops[arm].left > 0 ? left : Eigen::Vector3d(-left))) {
      with[static_cast<std::size_t>(edge)] = 1;
    }
    if (with == cut) {
      return none;  // sleeves come in pairs
    }
    // The limb holds its own opening alone.
    const SurfaceCut parted = cut_surface(topology, with);
    std::vector<int> panel_of(static_cast<std::size_t>(mesh.vertices.rows()), -1);
    std::vector<double> sizes(static_cast<std::size_t>(parted.panel_count), 0);
    for (Index f = 0; f < mesh.faces.rows(); ++f) {
      const int panel = parted.panels[static_cast<std::size_t>(f)];
      sizes[static_cast<std::size_t>(panel)] += areas[f];
      for (int k = 0; k < 3; ++k) {
        panel_of[static_cast<std::size_t>(mesh.faces(f, k))] = panel;
      }
    }
    const auto panel_at = [&](const RimLoop& loop) {
      return panel_of[static_cast<std::size_t>(loop.vertices.front())];
    };
    const int limb = panel_at(loops[arm]);
    const bool alone = std::count_if(loops.begin(), loops.end(), [&](const RimLoop& loop) {
                         return panel_at(loop) == limb;
                       }) == 1;
    if (!alone || sizes[static_cast<std::size_t>(limb)] >= kMostOfLimb * areas.sum()) {
      return none;
    }
    cut = std::move(with);
  }
  return cut;
}

}  // namespace atelier
