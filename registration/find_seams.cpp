#include "registration/find_seams.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <numeric>

#include "core/error.h"
#include "core/normals.h"
#include "core/parallel.h"
#include "registration/flat_pattern.h"
#include "registration/flat_seams.h"
#include "registration/front_and_back.h"
#include "registration/open_to_discs.h"
#include "registration/seam_piece.h"
#include "registration/surface_cut.h"

namespace atelier {
namespace {

/// What angles at each inner vertex lack of a full turn, spread over its neighbourhood: where the
/// surface cannot be laid flat. Absolute value, rad.
std::vector<double> curvature_of(const Mesh& mesh, const Topology& topology) {
  std::vector<double> defect(static_cast<std::size_t>(mesh.vertices.rows()), 2 * std::numbers::pi);
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d at = mesh.vertices.row(mesh.faces(f, k));
      const Eigen::Vector3d a = mesh.vertices.row(mesh.faces(f, (k + 1) % 3)).transpose() - at;
      const Eigen::Vector3d b = mesh.vertices.row(mesh.faces(f, (k + 2) % 3)).transpose() - at;
      defect[static_cast<std::size_t>(mesh.faces(f, k))] -= std::atan2(a.cross(b).norm(), a.dot(b));
    }
  }
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    if (corners_of_edge(topology, e).size() != 2) {
      defect[static_cast<std::size_t>(topology.edges(e, 0))] = 0;
      defect[static_cast<std::size_t>(topology.edges(e, 1))] = 0;
    }
  }
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    // A share goes to each neighbour; what is there stays there in sum.
    std::vector<double> sums = defect;
    std::vector<int> counts(defect.size(), 1);
    for (Index e = 0; e < topology.edges.rows(); ++e) {
      const auto a = static_cast<std::size_t>(topology.edges(e, 0));
      const auto b = static_cast<std::size_t>(topology.edges(e, 1));
      sums[a] += defect[b];
      sums[b] += defect[a];
      ++counts[a];
      ++counts[b];
    }
    for (std::size_t v = 0; v < defect.size(); ++v) {
      defect[v] = sums[v] / counts[v];
    }
  }
  for (double& value : defect) {
    value = std::abs(value);
  }
  // The few sharpest places are not to hide the rest.
  std::vector<double> sorted = defect;
  std::sort(sorted.begin(), sorted.end());
  const double most = sorted[sorted.size() * 98 / 100];
  for (double& value : defect) {
    value = std::min(value, most);
  }
  return defect;
}

/// 1 at the sides, under the arms and on the shoulders, up to 1 + `dearer` in front and at the
/// back.
std::vector<double> side_costs(const Mesh& mesh, const Topology& topology, double dearer) {
  const Points normals = vertex_normals(mesh.vertices, mesh.faces);
  std::vector<double> costs;
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const double facing =
        (std::abs(normals(topology.edges(e, 0), 2)) + std::abs(normals(topology.edges(e, 1), 2))) /
        2;
    costs.push_back(1 + dearer * facing);
  }
  return costs;
}

class Search {
 public:
  Search(const Mesh& mesh, const FindSeamsOptions& options)
      : mesh_(mesh),
        options_(options),
        topology_(topology_of(mesh.faces, mesh.vertices.rows())),
        sides_(side_costs(mesh, topology_, options.sides)),
        lengths_(edge_lengths(topology_, mesh.vertices)) {
    whole_.vertices = mesh.vertices;
    whole_.faces = mesh.faces;
    whole_.of_face.resize(static_cast<std::size_t>(mesh.faces.rows()));
    std::iota(whole_.of_face.begin(), whole_.of_face.end(), 0);
    whole_.topology = topology_;
    whole_.bends = curvature_of(mesh, topology_);
    area_ = face_areas(mesh.vertices, mesh.faces).sum();
  }

  const Topology& topology() const { return topology_; }

  std::vector<char> opened(const std::vector<char>& given) const {
    std::vector<double> costs = lengths_;
    for (std::size_t e = 0; e < costs.size(); ++e) {
      costs[e] *= sides_[e];
    }
    return opened_to_discs(topology_, given, costs);
  }

  /// Every panel of a cut laid flat anew.
  std::vector<SeamPiece> pieces_of(const std::vector<char>& cut) const {
    std::vector<SeamPiece> pieces = parts_of(whole_, cut);
    parallel_for(static_cast<Index>(pieces.size()), 1, [&](Index begin, Index end) {
      for (Index p = begin; p < end; ++p) {
        lay_flat(pieces[static_cast<std::size_t>(p)], options_.stretch, 100, 1e-6);
      }
    });
    return pieces;
  }

  /// Share of the area that is stretched too far; more than 1 where a panel lies over itself.
  double too_far(const std::vector<SeamPiece>& pieces) const {
    double sum = 0;
    for (const SeamPiece& piece : pieces) {
      for (Index f = 0; f < piece.faces.rows(); ++f) {
        sum += piece.strain[f] > options_.stretch ? piece.areas[f] : 0;
      }
      sum += piece.overlaps ? area_ : 0;
    }
    return sum / area_;
  }

  /// The piece cut in the best way that was tried; empty where there is none.
  std::vector<SeamPiece> best_cut(const SeamPiece& piece) const {
    std::vector<double> sides(static_cast<std::size_t>(piece.topology.edges.rows()), 1);
    for (Index e = 0; e < piece.topology.edges.rows(); ++e) {
      sides[static_cast<std::size_t>(e)] = sides_[static_cast<std::size_t>(whole_edge(piece, e))];
    }
    const std::vector<std::vector<int>> ways = ways_to_cut(piece, sides, options_.stretch);
    std::vector<std::vector<SeamPiece>> tried(ways.size());
    std::vector<double> gains(ways.size(), 0);
    parallel_for(static_cast<Index>(ways.size()), 1, [&](Index begin, Index end) {
      for (auto w = static_cast<std::size_t>(begin); w < static_cast<std::size_t>(end); ++w) {
        std::vector<char> cut(static_cast<std::size_t>(piece.topology.edges.rows()), 0);
        double length = 0;
        for (const int edge : ways[w]) {
          cut[static_cast<std::size_t>(edge)] = 1;
          length += lengths_[static_cast<std::size_t>(whole_edge(piece, edge))];
        }
        tried[w] = parts_of(piece, cut);
        double after = 0;
        for (SeamPiece& part : tried[w]) {
          const bool disc =
              boundary_loops(part.topology).size() == 1 && euler_characteristic(part.topology) == 1;
          if (!disc) {
            after = std::numeric_limits<double>::infinity();
            break;
          }
          lay_flat(part, options_.stretch, 25, 1e-4);
          after += part.excess;
        }
        constexpr double kOwnLength = 0.15;  // m: what a seam costs however short it is
        gains[w] = (piece.excess - after) / (length + kOwnLength);
      }
    });
    const auto best = std::max_element(gains.begin(), gains.end());
    if (best == gains.end() || !(*best > 0)) {
      return {};
    }
    std::vector<SeamPiece> parts = std::move(tried[static_cast<std::size_t>(best - gains.begin())]);
    for (SeamPiece& part : parts) {
      lay_flat(part, options_.stretch, 100, 1e-6);
    }
    return parts;
  }

  /// The edges of the whole that are cut between pieces and inside of them.
  std::vector<char> cut_of(const std::vector<SeamPiece>& pieces) const {
    std::vector<int> inside(static_cast<std::size_t>(topology_.edges.rows()), 0);
    for (const SeamPiece& piece : pieces) {
      for (Index e = 0; e < piece.topology.edges.rows(); ++e) {
        if (corners_of_edge(piece.topology, e).size() == 2) {
          inside[static_cast<std::size_t>(whole_edge(piece, e))] = 1;
        }
      }
    }
    std::vector<char> cut(inside.size(), 0);
    for (Index e = 0; e < topology_.edges.rows(); ++e) {
      cut[static_cast<std::size_t>(e)] =
          corners_of_edge(topology_, e).size() == 2 && inside[static_cast<std::size_t>(e)] == 0 ? 1
                                                                                                : 0;
    }
    return cut;
  }

  /// Sews found seams again, the longest first, as long as the bounds hold. Returns how many.
  int join(std::vector<char>& cut, const std::vector<char>& kept) const {
    int joined = 0;
    std::vector<double> strained = strained_area(pieces_of(cut));
    for (bool again = true; again;) {
      again = false;
      const SurfaceCut open = cut_surface(topology_, cut);
      std::vector<std::pair<double, std::vector<int>>> seams;
      for (const FlatSeam& seam : flat_seams(topology_, cut, open)) {
        std::vector<std::pair<int, int>> ends;
        double length = 0;
        for (std::size_t i = 1; i < seam.a.size(); ++i) {
          ends.emplace_back(open.source[static_cast<std::size_t>(seam.a[i - 1])],
                            open.source[static_cast<std::size_t>(seam.a[i])]);
        }
        const std::vector<char> flags = cut_at_edges(topology_, ends);
        std::vector<int> edges;
        bool free = true;
        for (std::size_t e = 0; e < flags.size(); ++e) {
          if (flags[e] != 0) {
            edges.push_back(static_cast<int>(e));
            length += lengths_[e];
            free = free && kept[e] == 0;
          }
        }
        if (free) {
          seams.emplace_back(-length, std::move(edges));
        }
      }
      std::sort(seams.begin(), seams.end());
      for (const auto& [length, edges] : seams) {
        std::vector<char> tried = cut;
        for (const int edge : edges) {
          tried[static_cast<std::size_t>(edge)] = 0;
        }
        if (opened(tried) != tried || !try_joined(tried, edges.front(), strained)) {
          continue;
        }
        cut = std::move(tried);
        ++joined;
        again = true;
        break;
      }
    }
    return joined;
  }

 private:
  /// Area of each face that is stretched too far; of all of a panel that lies over itself.
  std::vector<double> strained_area(const std::vector<SeamPiece>& pieces) const {
    std::vector<double> areas(static_cast<std::size_t>(mesh_.faces.rows()), 0);
    for (const SeamPiece& piece : pieces) {
      for (Index f = 0; f < piece.faces.rows(); ++f) {
        areas[static_cast<std::size_t>(piece.of_face[static_cast<std::size_t>(f)])] =
            piece.overlaps || piece.strain[f] > options_.stretch ? piece.areas[f] : 0;
      }
    }
    return areas;
  }

  /// Lays the panel round a seam that was sewn again; if the bounds hold, `strained` becomes what
  /// it is then.
  bool try_joined(const std::vector<char>& cut, int edge, std::vector<double>& strained) const {
    const int face = corners_of_edge(topology_, edge).front() / 3;
    for (SeamPiece& part : parts_of(whole_, cut)) {
      if (!std::binary_search(part.of_face.begin(), part.of_face.end(), face)) {
        continue;
      }
      lay_flat(part, options_.stretch, 100, 1e-6);
      if (part.overlaps) {
        return false;
      }
      std::vector<double> tried = strained;
      for (Index f = 0; f < part.faces.rows(); ++f) {
        tried[static_cast<std::size_t>(part.of_face[static_cast<std::size_t>(f)])] =
            part.strain[f] > options_.stretch ? part.areas[f] : 0;
      }
      if (std::accumulate(tried.begin(), tried.end(), 0.0) > 0.01 * area_) {
        return false;
      }
      strained = std::move(tried);
      return true;
    }
    return false;
  }

  int whole_edge(const SeamPiece& piece, Index edge) const {
    const int corner = corners_of_edge(piece.topology, edge).front();
    return topology_.face_edges(piece.of_face[static_cast<std::size_t>(corner / 3)], corner % 3);
  }

  const Mesh& mesh_;
  FindSeamsOptions options_;
  Topology topology_;
  std::vector<double> sides_;
  std::vector<double> lengths_;
  SeamPiece whole_;
  double area_ = 0;
};

}  // namespace

OptionTable describe(FindSeamsOptions& options) {
  OptionTable table;
  table.add("stretch", options.stretch, 0.001, 1, "",
            "Seams are added until 99 hundredths of the area are stretched by less");
  table.add("cuts", options.cuts, 0, 1000, "", "Seams and darts added at most");
  table.add("front_and_back", options.front_and_back, "Begin with a front and a back");
  table.add("sides", options.sides, 0, 100, "",
            "How much dearer seams are in front and at the back than at the sides");
  table.add("join", options.join, "Seams that turn out not to be needed are sewn again");
  return table;
}

FoundSeams find_seams(const Mesh& mesh, const std::vector<char>& given,
                      const FindSeamsOptions& options, const SeamWatch& watch) {
  check_flattenable(mesh);
  const Search search(mesh, options);
  ATELIER_CHECK(static_cast<Index>(given.size()) == search.topology().edges.rows(),
                "a flag for each edge");
  FoundSeams found;
  std::vector<char> start = given;
  if (options.front_and_back) {
    const std::vector<char> between = front_and_back(mesh);
    for (std::size_t e = 0; e < start.size(); ++e) {
      start[e] = static_cast<char>(start[e] | between[e]);
    }
  }
  std::vector<SeamPiece> pieces = search.pieces_of(search.opened(start));
  std::vector<char> stuck;  // pieces that no cut betters
  const auto say = [&](const std::string& what) {
    if (watch) {
      char text[120];
      std::snprintf(text, sizeof text, "%s: %zu panels, %.1f%% stretched too far", what.c_str(),
                    pieces.size(), 100 * search.too_far(pieces));
      watch(text);
    }
  };
  say("opened");
  stuck.assign(pieces.size(), 0);
  while (found.added < options.cuts && search.too_far(pieces) > 0.01) {
    std::size_t worst = pieces.size();
    for (std::size_t p = 0; p < pieces.size(); ++p) {
      if (stuck[p] == 0 && pieces[p].excess > 0 &&
          (worst == pieces.size() || pieces[p].excess > pieces[worst].excess)) {
        worst = p;
      }
    }
    if (worst == pieces.size()) {
      break;
    }
    std::vector<SeamPiece> parts = search.best_cut(pieces[worst]);
    if (parts.empty()) {
      stuck[worst] = 1;
      continue;
    }
    ++found.added;
    pieces[worst] = std::move(parts.front());
    const bool split = parts.size() > 1;
    for (std::size_t p = 1; p < parts.size(); ++p) {
      pieces.push_back(std::move(parts[p]));
      stuck.push_back(0);
    }
    say(split ? "seam" : "dart");
  }
  found.reached = search.too_far(pieces) <= 0.01;
  found.cut = search.cut_of(pieces);
  if (options.join && found.reached) {
    found.joined = search.join(found.cut, start);
  }
  return found;
}

}  // namespace atelier
