#include "registration/flattening/seam_piece.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/neighbor_means.h"
#include "core/normals.h"
#include "registration/flattening/flatten_panel.h"
#include "registration/flattening/grain_direction.h"
#include "registration/flattening/surface_cut.h"
#include "registration/flattening/woven_shape.h"
#include "registration/outlines/outline_measures.h"
#include "registration/principal_stretches.h"

namespace atelier {
namespace {

constexpr int kPeaks = 5;
constexpr double kNever = std::numeric_limits<double>::infinity();

std::vector<double> stretched_places(const SeamPiece& piece) {
  std::vector<double> sums(static_cast<std::size_t>(piece.vertices.rows()), 0);
  std::vector<double> areas(sums.size(), 0);
  for (Index f = 0; f < piece.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const auto v = static_cast<std::size_t>(piece.faces(f, k));
      sums[v] += piece.areas[f] * piece.strain[f];
      areas[v] += piece.areas[f];
    }
  }
  for (std::size_t v = 0; v < sums.size(); ++v) {
    sums[v] /= std::max(areas[v], 1e-18);
  }
  constexpr int kRounds = 3;
  return neighbor_means(piece.topology, std::move(sums), kRounds);
}

}  // namespace

void lay_flat(SeamPiece& piece, const FindSeamsOptions& find, int iterations, double tolerance) {
  const double bound = stretch_bound(find);
  FlattenPanelOptions options;
  options.woven = find.woven;
  options.iterations = iterations;
  options.tolerance = tolerance;
  options.even = stiffening_of(bound);
  FlatPanel flat = flatten_panel(piece.vertices, piece.faces, options, {}, piece.flat);
  piece.flat = std::move(flat.vertices);
  piece.overlaps = flat.overlaps;
  piece.areas = face_areas(piece.vertices, piece.faces);
  piece.strain.resize(piece.faces.rows());
  piece.excess = 0;
  for (Index f = 0; f < piece.faces.rows(); ++f) {
    const auto to_curved =
        face_deformation(piece.vertices, piece.faces, piece.flat, piece.faces, f);
    piece.strain[f] = counted_strain(find, find.woven ? thread_strain(to_curved) : 0,
                                     (principal_stretches(to_curved).array() - 1).abs().maxCoeff());
    // Beyond the bound it counts twice what it counts near it; a single face cannot count for all.
    const double over = std::min(piece.strain[f] / bound, 4.0);
    piece.excess += piece.areas[f] * std::max(0.0, over - 0.5);
  }
  if (piece.overlaps) {
    piece.excess += piece.areas.sum();
  }
}

int corners_of(const SeamPiece& piece) {
  const std::vector<std::vector<int>> loops = boundary_loops(piece.topology);
  Points2 outline(static_cast<Index>(loops.front().size()), 2);
  for (std::size_t i = 0; i < loops.front().size(); ++i) {
    outline.row(static_cast<Index>(i)) = piece.flat.row(loops.front()[i]);
  }
  return corner_count(outline);
}

std::vector<SeamPiece> parts_of(const SeamPiece& piece, const std::vector<char>& cut) {
  const SurfaceCut open = cut_surface(piece.topology, cut);
  std::vector<SeamPiece> parts(static_cast<std::size_t>(open.panel_count));
  std::vector<int> local(open.source.size(), -1);
  std::vector<std::vector<int>> sources(parts.size());
  std::vector<Index> rows(parts.size(), 0);
  for (const int panel : open.panels) {
    ++rows[static_cast<std::size_t>(panel)];
  }
  for (std::size_t p = 0; p < parts.size(); ++p) {
    parts[p].faces.resize(rows[p], 3);
    rows[p] = 0;
  }
  for (Index f = 0; f < open.faces.rows(); ++f) {
    const auto p = static_cast<std::size_t>(open.panels[static_cast<std::size_t>(f)]);
    for (int k = 0; k < 3; ++k) {
      int& place = local[static_cast<std::size_t>(open.faces(f, k))];
      if (place < 0) {
        place = static_cast<int>(sources[p].size());
        sources[p].push_back(open.source[static_cast<std::size_t>(open.faces(f, k))]);
      }
      parts[p].faces(rows[p], k) = place;
    }
    parts[p].of_face.push_back(piece.of_face[static_cast<std::size_t>(f)]);
    ++rows[p];
  }
  for (std::size_t p = 0; p < parts.size(); ++p) {
    SeamPiece& part = parts[p];
    const auto count = static_cast<Index>(sources[p].size());
    part.vertices.resize(count, 3);
    part.flat.resize(piece.flat.rows() > 0 ? count : 0, 2);
    for (Index v = 0; v < count; ++v) {
      const int source = sources[p][static_cast<std::size_t>(v)];
      part.vertices.row(v) = piece.vertices.row(source);
      part.bends.push_back(piece.bends[static_cast<std::size_t>(source)]);
      if (part.flat.rows() > 0) {
        part.flat.row(v) = piece.flat.row(source);
      }
    }
    part.topology = topology_of(part.faces, count);
  }
  return parts;
}

std::vector<std::vector<int>> ways_to_cut(const SeamPiece& piece, const std::vector<double>& sides,
                                          double bound) {
  const Topology& topology = piece.topology;
  const std::vector<std::vector<int>> loops = boundary_loops(topology);
  const std::vector<int>& boundary = loops.front();
  const std::vector<double> places = stretched_places(piece);
  const double max_bent = *std::max_element(piece.bends.begin(), piece.bends.end());
  const std::vector<double> lengths = edge_lengths(topology, piece.vertices);
  std::vector<double> costs(lengths.size());
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const auto a = static_cast<std::size_t>(topology.edges(e, 0));
    const auto b = static_cast<std::size_t>(topology.edges(e, 1));
    const double stretched = std::min(1.0, (places[a] + places[b]) / (4 * bound));
    const double bent = (piece.bends[a] + piece.bends[b]) / (2 * std::max(max_bent, 1e-12));
    costs[static_cast<std::size_t>(e)] = corners_of_edge(topology, e).size() != 2
                                             ? kNever
                                             : lengths[static_cast<std::size_t>(e)] *
                                                   sides[static_cast<std::size_t>(e)] /
                                                   (0.15 + 0.4 * stretched + 0.6 * bent);
  }
  // Arc length along the boundary, and its whole.
  std::vector<double> arc(static_cast<std::size_t>(piece.vertices.rows()), -1);
  double perimeter = 0;
  for (std::size_t i = 0; i < boundary.size(); ++i) {
    arc[static_cast<std::size_t>(boundary[i])] = perimeter;
    perimeter +=
        (piece.vertices.row(boundary[(i + 1) % boundary.size()]) - piece.vertices.row(boundary[i]))
            .norm();
  }
  const EdgeGraph graph(topology);
  // Most stretched places, apart from each other.
  std::vector<int> order(places.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    return places[static_cast<std::size_t>(a)] > places[static_cast<std::size_t>(b)] ||
           (places[static_cast<std::size_t>(a)] == places[static_cast<std::size_t>(b)] && a < b);
  });
  std::vector<int> peaks;
  for (const int v : order) {
    const bool apart = std::all_of(peaks.begin(), peaks.end(), [&](int peak) {
      return (piece.vertices.row(v) - piece.vertices.row(peak)).norm() > 0.06 * perimeter;
    });
    if (apart) {
      peaks.push_back(v);
      if (peaks.size() == kPeaks) {
        break;
      }
    }
  }
  const EdgePaths from_boundary = graph.paths_from(boundary, costs);
  std::vector<std::vector<int>> ways;
  for (const int peak : peaks) {
    const bool on_boundary = arc[static_cast<std::size_t>(peak)] >= 0;
    std::vector<int> first = graph.way_back(from_boundary, peak);
    int root = peak;
    std::vector<double> rest = costs;
    for (const int edge : first) {
      root = graph.other_end(edge, root);
      for (const int beside : graph.edges_of(root)) {
        rest[static_cast<std::size_t>(beside)] = kNever;
      }
    }
    // Boundary vertices are ends, never on the way.
    for (const int v : boundary) {
      if (v == peak) {
        continue;
      }
      for (const int beside : graph.edges_of(v)) {
        const int other = graph.other_end(beside, v);
        if (arc[static_cast<std::size_t>(other)] >= 0 && other != peak) {
          rest[static_cast<std::size_t>(beside)] = kNever;
        }
      }
    }
    const EdgePaths onwards = graph.paths_from({peak}, rest);
    // The cheapest other places of the boundary, a sixth and a quarter of it away.
    for (const double away : {0.12, 0.3}) {
      int best = -1;
      for (const int v : boundary) {
        const double apart =
            std::abs(arc[static_cast<std::size_t>(v)] - arc[static_cast<std::size_t>(root)]);
        if (std::min(apart, perimeter - apart) > away * perimeter &&
            onwards.distances[static_cast<std::size_t>(v)] <
                (best < 0 ? kNever : onwards.distances[static_cast<std::size_t>(best)])) {
          best = v;
        }
      }
      if (best >= 0) {
        std::vector<int> way = first;
        for (const int edge : graph.way_back(onwards, best)) {
          way.push_back(edge);
        }
        ways.push_back(std::move(way));
      }
    }
    if (!on_boundary && !first.empty()) {
      ways.push_back(std::move(first));
    }
  }
  std::sort(ways.begin(), ways.end());
  ways.erase(std::unique(ways.begin(), ways.end()), ways.end());
  return ways;
}

}  // namespace atelier
