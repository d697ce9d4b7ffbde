#include "registration/flattening/limb_rings.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>

#include "core/error.h"
#include "core/normals.h"
#include "core/saturating_cast.h"
#include "registration/edge_paths.h"
#include "registration/flattening/surface_cut.h"

namespace atelier {
namespace {

constexpr double kNowhere = std::numeric_limits<double>::infinity();
constexpr double kBinWidth = 0.01;    // m of distance from an opening
constexpr double kMostOfLimb = 0.35;  // of the area

/// A boundary loop on the wearer.
struct RimLoop {
  std::vector<int> vertices;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double left = 0, low = kNowhere;
};

std::vector<RimLoop> rim_loops(const Mesh& mesh, const Topology& topology,
                               const Eigen::Vector3d& left, double middle) {
  std::vector<RimLoop> loops;
  for (std::vector<int>& vertices : boundary_loops(topology)) {
    RimLoop loop;
    for (const int v : vertices) {
      loop.middle += mesh.vertices.row(v).transpose() / static_cast<double>(vertices.size());
      loop.low = std::min(loop.low, mesh.vertices(v, 1));
    }
    loop.left = loop.middle.dot(left) - middle;
    loop.vertices = std::move(vertices);
    loops.push_back(std::move(loop));
  }
  return loops;
}

/// Which loops arms and legs come out of.
struct LimbLoops {
  std::vector<std::size_t> arms, legs, central;
};

LimbLoops limb_loops(const std::vector<RimLoop>& loops, double half_width, double height) {
  constexpr double kBeside = 0.2;  // of half the width
  LimbLoops limbs;
  std::vector<std::size_t> beside;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const auto is_twin = [&](const RimLoop& other) {
      return &other != &loops[i] &&
             std::abs(other.left + loops[i].left) < 0.4 * std::abs(loops[i].left) &&
             std::abs(other.middle.y() - loops[i].middle.y()) < 0.2 * height;
    };
    if (std::abs(loops[i].left) <= kBeside * half_width) {
      limbs.central.push_back(i);
    } else if (std::any_of(loops.begin(), loops.end(), is_twin)) {
      beside.push_back(i);
    }
  }
  std::sort(beside.begin(), beside.end(), [&](std::size_t a, std::size_t b) {
    return loops[a].middle.y() > loops[b].middle.y();
  });
  const auto is_lower = [&](std::size_t c) {
    return std::all_of(beside.begin(), beside.end(),
                       [&](std::size_t b) { return loops[c].low < loops[b].middle.y(); });
  };
  constexpr std::size_t kPair = 2;
  const bool arms = beside.size() > kPair || limbs.central.size() >= kPair ||
                    std::any_of(limbs.central.begin(), limbs.central.end(), is_lower);
  const std::size_t first_leg = arms ? std::min(kPair, beside.size()) : 0;
  limbs.arms.assign(beside.begin(), beside.begin() + static_cast<std::ptrdiff_t>(first_leg));
  limbs.legs.assign(beside.begin() + static_cast<std::ptrdiff_t>(first_leg), beside.end());
  return limbs;
}

/// Angular defect of each vertex, 0 at rims, averaged over a few neighbours. Rad.
std::vector<double> smooth_defects(const Mesh& mesh, const Topology& topology) {
  std::vector<double> defects(static_cast<std::size_t>(mesh.vertices.rows()), 2 * std::numbers::pi);
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d at = mesh.vertices.row(mesh.faces(f, k));
      const Eigen::Vector3d a = mesh.vertices.row(mesh.faces(f, (k + 1) % 3)).transpose() - at;
      const Eigen::Vector3d b = mesh.vertices.row(mesh.faces(f, (k + 2) % 3)).transpose() - at;
      defects[static_cast<std::size_t>(mesh.faces(f, k))] -=
          std::atan2(a.cross(b).norm(), a.dot(b));
    }
  }
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    if (corners_of_edge(topology, e).size() != 2) {
      defects[static_cast<std::size_t>(topology.edges(e, 0))] = 0;
      defects[static_cast<std::size_t>(topology.edges(e, 1))] = 0;
    }
  }
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<double> sums = defects;
    std::vector<int> counts(defects.size(), 1);
    for (Index e = 0; e < topology.edges.rows(); ++e) {
      const auto a = static_cast<std::size_t>(topology.edges(e, 0));
      const auto b = static_cast<std::size_t>(topology.edges(e, 1));
      sums[a] += defects[b];
      sums[b] += defects[a];
      ++counts[a];
      ++counts[b];
    }
    for (std::size_t v = 0; v < defects.size(); ++v) {
      defects[v] = sums[v] / counts[v];
    }
  }
  return defects;
}

/// How long the loops at each distance from an opening are, m: at the middles of bins.
std::vector<double> loop_lengths(const Mesh& mesh, const std::vector<double>& distances) {
  std::vector<double> lengths;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    std::array<double, 3> at{};
    for (int k = 0; k < 3; ++k) {
      at[static_cast<std::size_t>(k)] = distances[static_cast<std::size_t>(mesh.faces(f, k))];
    }
    const auto [low, high] = std::minmax_element(at.begin(), at.end());
    if (!std::isfinite(*high)) {
      continue;
    }
    const auto first = saturating_cast<int>(std::ceil(*low / kBinWidth - 0.5));
    const auto last = saturating_cast<int>(std::floor(*high / kBinWidth - 0.5));
    if (last >= 0) {
      lengths.resize(std::max(lengths.size(), static_cast<std::size_t>(last) + 1), 0);
    }
    for (int bin = std::max(0, first); bin <= last; ++bin) {
      const double level = (bin + 0.5) * kBinWidth;
      std::vector<Eigen::RowVector3d> ends;
      for (int k = 0; k < 3; ++k) {
        const double from = at[static_cast<std::size_t>(k)];
        const double to = at[static_cast<std::size_t>((k + 1) % 3)];
        if ((from < level) != (to < level)) {
          const double t = (level - from) / (to - from);
          ends.emplace_back((1 - t) * mesh.vertices.row(mesh.faces(f, k)) +
                            t * mesh.vertices.row(mesh.faces(f, (k + 1) % 3)));
        }
      }
      if (ends.size() == 2) {
        lengths[static_cast<std::size_t>(bin)] += (ends[0] - ends[1]).norm();
      }
    }
  }
  return lengths;
}

/// The distance at which a limb becomes a trunk; none where it does not.
double end_of_limb(const std::vector<double>& lengths) {
  constexpr std::size_t kOver = 5;  // bins
  constexpr double kGrowth = 1;     // m of loop for a metre of distance
  const auto mean = [&](std::size_t from) {
    double sum = 0;
    for (std::size_t i = from; i < from + kOver; ++i) {
      sum += lengths[i] / kOver;
    }
    return sum;
  };
  for (std::size_t i = kOver; i + 2 * kOver <= lengths.size(); ++i) {
    if (mean(i + kOver) - mean(i) > kGrowth * kOver * kBinWidth) {
      return static_cast<double>(i + kOver) * kBinWidth;
    }
  }
  return kNowhere;
}

/// The shortest closed way through `base` that crosses the arc `arc` once, by `costs`. Edges.
std::vector<int> loop_across(const Topology& topology, const EdgeGraph& graph,
                             const std::vector<int>& arc, int base,
                             const std::vector<double>& costs) {
  constexpr int kLevels = 3;  // crossed -1, 0, 1 times
  const auto count = static_cast<std::size_t>(topology.vertex_count);
  std::vector<int> place(count, -1);
  for (std::size_t i = 0; i < arc.size(); ++i) {
    place[static_cast<std::size_t>(arc[i])] = static_cast<int>(i);
  }
  // Faces to the left of the arc touch an edge of it in its direction; edges into the fan between
  // two arc edges on that side leave it to the left.
  std::vector<char> to_left(static_cast<std::size_t>(topology.edges.rows()), 0);
  const Triangles neighbors = face_neighbors(topology);
  for (std::size_t i = 0; i + 1 < arc.size(); ++i) {
    for (const int e : graph.edges_of(arc[i])) {
      if (graph.other_end(e, arc[i]) != arc[i + 1]) {
        continue;
      }
      for (const int corner : corners_of_edge(topology, e)) {
        if (topology.faces(corner / 3, corner % 3) != arc[i]) {
          continue;  // the face on the right
        }
        // Round each end, from this face on, until the arc goes on.
        for (const int v : {arc[i], arc[i + 1]}) {
          int face = corner / 3;
          int came_by = e;
          for (std::size_t turns = 0; turns < 64 && face >= 0; ++turns) {
            int next_edge = -1;
            int next_face = -1;
            for (int k = 0; k < 3; ++k) {
              const int edge = topology.face_edges(face, k);
              const bool at_v =
                  topology.faces(face, k) == v || topology.faces(face, (k + 1) % 3) == v;
              if (at_v && edge != came_by) {
                next_edge = edge;
                next_face = neighbors(face, k);
              }
            }
            if (next_edge < 0 ||
                place[static_cast<std::size_t>(graph.other_end(next_edge, v))] >= 0) {
              break;
            }
            to_left[static_cast<std::size_t>(next_edge)] = 1;
            came_by = next_edge;
            face = next_face;
          }
        }
      }
    }
  }
  const auto state = [&](int v, int level) {
    return static_cast<std::size_t>(v) * kLevels + static_cast<std::size_t>(level + 1);
  };
  std::vector<double> best(count * kLevels, kNowhere);
  std::vector<std::pair<int, int>> from(count * kLevels, {-1, 0});  // edge, level
  using Entry = std::pair<double, std::pair<int, int>>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  best[state(base, 0)] = 0;
  queue.push({0, {base, 0}});
  while (!queue.empty()) {
    const auto [cost, at] = queue.top();
    const auto [v, level] = at;
    queue.pop();
    if (cost > best[state(v, level)]) {
      continue;
    }
    if (v == base && level == 1) {
      break;
    }
    for (const int e : graph.edges_of(v)) {
      const int w = graph.other_end(e, v);
      int next = level;
      if (to_left[static_cast<std::size_t>(e)] != 0) {
        next += place[static_cast<std::size_t>(v)] >= 0 ? 1 : -1;
      }
      if (next < -1 || next > 1) {
        continue;
      }
      const double there = cost + costs[static_cast<std::size_t>(e)];
      if (there < best[state(w, next)]) {
        best[state(w, next)] = there;
        from[state(w, next)] = {e, level};
        queue.push({there, {w, next}});
      }
    }
  }
  std::vector<int> loop;
  int v = base;
  int level = 1;
  while (from[state(v, level)].first >= 0 && !(v == base && level == 0)) {
    const auto [edge, before] = from[state(v, level)];
    loop.push_back(edge);
    v = graph.other_end(edge, v);
    level = before;
  }
  return loop;
}

std::vector<int> vertices_of_way(const EdgeGraph& graph, const EdgePaths& paths, int from) {
  std::vector<int> vertices{from};
  for (const int edge : graph.way_back(paths, from)) {
    vertices.push_back(graph.other_end(edge, vertices.back()));
  }
  return vertices;
}

/// Where a limb meets the trunk.
struct LimbRoot {
  int vertex = -1;  ///< the armpit, or the crotch; -1: there is none
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  ///< of what lies as far from the opening
};

LimbRoot limb_root(const Mesh& mesh, const EdgePaths& paths, const std::vector<double>& defects) {
  constexpr double kShortest = 0.04;               // m
  constexpr double kBefore = 0.03, kAfter = 0.05;  // m about the end of a limb
  LimbRoot root;
  const double end = end_of_limb(loop_lengths(mesh, paths.distances));
  if (!std::isfinite(end) || end < kShortest) {
    return root;
  }
  int count = 0;
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    const auto at = static_cast<std::size_t>(v);
    if (paths.distances[at] < end - kBefore || paths.distances[at] > end + kAfter) {
      continue;
    }
    root.middle += mesh.vertices.row(v).transpose();
    ++count;
    if (root.vertex < 0 || defects[at] < defects[static_cast<std::size_t>(root.vertex)]) {
      root.vertex = static_cast<int>(v);
    }
  }
  root.middle /= std::max(count, 1);
  return root;
}

/// Edges of the loop round one arm; empty where there is none.
std::vector<int> ring_of(const Mesh& mesh, const Topology& topology, const EdgeGraph& graph,
                         const std::vector<double>& lengths, const std::vector<double>& defects,
                         const std::vector<RimLoop>& loops, std::size_t arm,
                         const Eigen::Vector3d& outwards) {
  const EdgePaths paths = graph.paths_from(loops[arm].vertices, lengths);
  const LimbRoot root = limb_root(mesh, paths, defects);
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

/// A garment on its wearer.
struct WornRims {
  Eigen::Vector3d left = Eigen::Vector3d::UnitX();
  double middle = 0;
  std::vector<RimLoop> loops;
  LimbLoops limbs;
};

WornRims worn_rims(const Mesh& mesh, const Topology& topology, const Eigen::Vector3d& facing) {
  ATELIER_CHECK(std::abs(facing.norm() - 1) < 1e-6, "a direction of length 1");
  WornRims rims;
  rims.left = Eigen::Vector3d::UnitY().cross(facing);
  const Eigen::VectorXd across = mesh.vertices * rims.left;
  rims.middle = (across.minCoeff() + across.maxCoeff()) / 2;
  rims.loops = rim_loops(mesh, topology, rims.left, rims.middle);
  rims.limbs = limb_loops(rims.loops, (across.maxCoeff() - across.minCoeff()) / 2,
                          mesh.vertices.col(1).maxCoeff() - mesh.vertices.col(1).minCoeff());
  return rims;
}

}  // namespace

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
  const int crotch = limb_root(mesh, paths, smooth_defects(mesh, topology)).vertex;
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
        costs[static_cast<std::size_t>(e)] = kNowhere;
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

std::vector<char> limb_rings(const Mesh& mesh, const Topology& topology,
                             const Eigen::Vector3d& facing) {
  std::vector<char> cut(static_cast<std::size_t>(topology.edges.rows()), 0);
  const WornRims rims = worn_rims(mesh, topology, facing);
  const std::vector<RimLoop>& loops = rims.loops;
  const Eigen::Vector3d& left = rims.left;
  if (rims.limbs.arms.empty()) {
    return cut;
  }
  const EdgeGraph graph(topology);
  const std::vector<double> lengths = edge_lengths(topology, mesh.vertices);
  const std::vector<double> defects = smooth_defects(mesh, topology);
  const Eigen::VectorXd areas = face_areas(mesh.vertices, mesh.faces);
  for (const std::size_t arm : rims.limbs.arms) {
    std::vector<char> with = cut;
    for (const int edge : ring_of(mesh, topology, graph, lengths, defects, loops, arm,
                                  loops[arm].left > 0 ? left : Eigen::Vector3d(-left))) {
      with[static_cast<std::size_t>(edge)] = 1;
    }
    if (with == cut) {
      continue;
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
    if (alone && sizes[static_cast<std::size_t>(limb)] < kMostOfLimb * areas.sum()) {
      cut = std::move(with);
    }
  }
  return cut;
}

}  // namespace atelier
