#include "registration/flattening/find_seams.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <numeric>

#include "core/angle_defects.h"
#include "core/error.h"
#include "core/neighbor_means.h"
#include "core/normals.h"
#include "core/parallel.h"
#include "registration/flattening/cross_field.h"
#include "registration/flattening/cut_to_disks.h"
#include "registration/flattening/flat_pattern.h"
#include "registration/flattening/flat_seams.h"
#include "registration/flattening/front_and_back.h"
#include "registration/flattening/limb_rings.h"
#include "registration/flattening/mirrored_way.h"
#include "registration/flattening/rise_seams.h"
#include "registration/flattening/seam_piece.h"
#include "registration/flattening/surface_cut.h"

namespace atelier {
namespace {

/// Angular defect at each inner vertex, spread over its neighbourhood: it is large where the
/// surface cannot be laid flat. Absolute value, rad.
std::vector<double> curvature_of(const Mesh& mesh, const Topology& topology) {
  constexpr int kRounds = 3;
  std::vector<double> defect =
      neighbor_means(topology, angle_defects(mesh.vertices, topology), kRounds);
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
std::vector<double> side_costs(const Mesh& mesh, const Topology& topology,
                               const Eigen::Vector3d& facing, double dearer) {
  const Eigen::VectorXd ahead = (vertex_normals(mesh.vertices, mesh.faces) * facing).cwiseAbs();
  std::vector<double> costs;
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    costs.push_back(1 + dearer * (ahead[topology.edges(e, 0)] + ahead[topology.edges(e, 1)]) / 2);
  }
  return costs;
}

constexpr double kOwnLength = 0.15;  // m: what a seam costs however short it is

class Search {
 public:
  Search(const Mesh& mesh, const Eigen::Vector3d& facing, const FindSeamsOptions& options)
      : mesh_(mesh),
        options_(options),
        topology_(topology_of(mesh.faces, mesh.vertices.rows())),
        bound_(stretch_bound(options)),
        plane_(options.woven ? mirror_plane(mesh, facing) : MirrorPlane{}),
        sides_(side_costs(mesh, topology_, facing, options.front_back_cost)),
        lengths_(edge_lengths(topology_, mesh.vertices)) {
    whole_.vertices = mesh.vertices;
    whole_.faces = mesh.faces;
    whole_.of_face.resize(static_cast<std::size_t>(mesh.faces.rows()));
    std::iota(whole_.of_face.begin(), whole_.of_face.end(), 0);
    whole_.topology = topology_;
    whole_.bends = curvature_of(mesh, topology_);
    area_ = face_areas(mesh.vertices, mesh.faces).sum();
    if (options.woven) {
      constexpr double kOff = 3;  // times as dear halfway between two directions
      const std::vector<double> off = off_field(mesh, topology_, cross_field(mesh, topology_));
      for (std::size_t e = 0; e < off.size(); ++e) {
        sides_[e] *= 1 + kOff * off[e];
      }
      const Points normals = vertex_normals(mesh.vertices, mesh.faces);
      for (Index e = 0; e < topology_.edges.rows(); ++e) {
        up_.push_back((normals(topology_.edges(e, 0), 1) + normals(topology_.edges(e, 1), 1)) / 2);
      }
    }
  }

  const Topology& topology() const { return topology_; }

  std::vector<char> opened(const std::vector<char>& given) const {
    std::vector<double> costs = lengths_;
    for (std::size_t e = 0; e < costs.size(); ++e) {
      costs[e] *= sides_[e];
    }
    return cut_to_disks(topology_, given, costs);
  }

  /// Every panel of a cut, flattened again.
  std::vector<SeamPiece> pieces_of(const std::vector<char>& cut) const {
    std::vector<SeamPiece> pieces = parts_of(whole_, cut);
    parallel_for(static_cast<Index>(pieces.size()), 1, [&](Index begin, Index end) {
      for (Index p = begin; p < end; ++p) {
        lay_flat(pieces[static_cast<std::size_t>(p)], options_, 100, 1e-6);
      }
    });
    return pieces;
  }

  /// Share of the area that is stretched too far.
  double stretched(const std::vector<SeamPiece>& pieces) const {
    double sum = 0;
    for (const SeamPiece& piece : pieces) {
      for (Index f = 0; f < piece.faces.rows(); ++f) {
        sum += piece.strain[f] > bound_ ? piece.areas[f] : 0;
      }
    }
    return sum / area_;
  }

  /// The same, and 1 for each panel that lies over itself: what is to be cut away.
  double too_far(const std::vector<SeamPiece>& pieces) const {
    return stretched(pieces) + static_cast<double>(overlaps(pieces));
  }

  static std::ptrdiff_t overlaps(const std::vector<SeamPiece>& pieces) {
    return std::count_if(pieces.begin(), pieces.end(),
                         [](const SeamPiece& piece) { return piece.overlaps; });
  }

  /// A piece cut in two, or by a dart.
  struct CutPiece {
    std::vector<SeamPiece> parts;
    Points chain;         ///< places of the cut, from the rim on
    bool to_rim = false;  ///< it ends there, too
  };

  /// The piece cut in the best way that was tried; no parts where there is none.
  CutPiece best_cut(const SeamPiece& piece) const {
    std::vector<double> sides(static_cast<std::size_t>(piece.topology.edges.rows()), 1);
    for (Index e = 0; e < piece.topology.edges.rows(); ++e) {
      sides[static_cast<std::size_t>(e)] = sides_[static_cast<std::size_t>(whole_edge(piece, e))];
    }
    constexpr double kManyCorners = 4;  // times as long
    const int most_corners = options_.woven ? std::max(options_.corners, corners_of(piece)) : 0;
    const std::vector<std::vector<int>> ways = ways_to_cut(piece, sides, bound_);
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
        int corners = 0;
        for (SeamPiece& part : tried[w]) {
          if (!is_disk(part)) {
            after = std::numeric_limits<double>::infinity();
            break;
          }
          lay_flat(part, options_, 25, 1e-4);
          after += part.excess;
          if (options_.woven) {
            corners = std::max(corners, corners_of(part));
          }
        }
        if (corners > most_corners) {
          length *= kManyCorners;  // where nothing else helps
        }
        gains[w] = (piece.excess - after) / (length + kOwnLength);
      }
    });
    const auto best = std::max_element(gains.begin(), gains.end());
    if (best == gains.end() || !(*best > 0)) {
      return {};
    }
    const auto way = static_cast<std::size_t>(best - gains.begin());
    CutPiece cut{std::move(tried[way]), {}, false};
    for (SeamPiece& part : cut.parts) {
      lay_flat(part, options_, 100, 1e-6);
    }
    std::vector<char> on_rim(static_cast<std::size_t>(piece.vertices.rows()), 0);
    const std::vector<std::vector<int>> rims = boundary_loops(piece.topology);
    for (const int v : rims.front()) {
      on_rim[static_cast<std::size_t>(v)] = 1;
    }
    std::vector<int> chain = chain_of(piece.topology, ways[way]);
    if (!chain.empty() && on_rim[static_cast<std::size_t>(chain.front())] == 0) {
      std::reverse(chain.begin(), chain.end());
    }
    cut.chain.resize(std::ssize(chain), 3);
    for (std::size_t i = 0; i < chain.size(); ++i) {
      cut.chain.row(static_cast<Index>(i)) = piece.vertices.row(chain[i]);
    }
    cut.to_rim = !chain.empty() && on_rim[static_cast<std::size_t>(chain.back())] != 0;
    return cut;
  }

  /// Cuts the other half as one half was cut. Returns how many cuts that were.
  int cut_alike(std::vector<SeamPiece>& pieces, std::vector<char>& stuck,
                const CutPiece& cut) const {
    if (!options_.woven || !plane_.holds || cut.chain.rows() < 2) {
      return 0;
    }
    const MirroredWay way = mirrored_way(pieces, plane_, cut.chain, cut.to_rim);
    if (way.edges.empty()) {
      return 0;
    }
    SeamPiece& piece = pieces[way.piece];
    std::vector<char> flags(static_cast<std::size_t>(piece.topology.edges.rows()), 0);
    for (const int edge : way.edges) {
      flags[static_cast<std::size_t>(edge)] = 1;
    }
    std::vector<SeamPiece> parts = parts_of(piece, flags);
    double after = 0;
    for (SeamPiece& part : parts) {
      if (!is_disk(part)) {
        return 0;
      }
      lay_flat(part, options_, 100, 1e-6);
      after += part.excess;
    }
    if (after >= piece.excess) {
      return 0;  // it needs none
    }
    replace(pieces, stuck, way.piece, std::move(parts));
    return 1;
  }

  static void replace(std::vector<SeamPiece>& pieces, std::vector<char>& stuck, std::size_t at,
                      std::vector<SeamPiece> parts) {
    pieces[at] = std::move(parts.front());
    for (std::size_t p = 1; p < parts.size(); ++p) {
      pieces.push_back(std::move(parts[p]));
      stuck.push_back(0);
    }
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

  /// Effects of sewing a seam again.
  struct Sewn {
    SeamPiece piece;
    bool possible = false;  ///< a disk that does not lie over itself
    double excess = 0;      ///< more of it, m2
    double strained = 0;    ///< more area that is stretched too far, m2
  };

  /// Sews seams again while the bound holds, the one first that adds least excess for its length.
  /// Those in `kept` stay, and those in `sides` that part a front from its back. Returns how many.
  int sew(std::vector<SeamPiece>& pieces, const std::vector<char>& kept,
          const std::vector<char>& sides) const {
    struct Known {
      int version_a, version_b;
      Sewn sewn;
    };
    std::map<std::vector<int>, Known> known;  // by edges
    std::vector<int> versions(pieces.size());
    std::iota(versions.begin(), versions.end(), 0);
    int version = static_cast<int>(pieces.size());
    int count = 0;
    for (;;) {
      const std::vector<char> cut = cut_of(pieces);
      std::vector<std::size_t> piece_of_face(static_cast<std::size_t>(mesh_.faces.rows()), 0);
      double strained = 0;
      for (std::size_t p = 0; p < pieces.size(); ++p) {
        strained += strained_area(pieces[p]);
        for (const int face : pieces[p].of_face) {
          piece_of_face[static_cast<std::size_t>(face)] = p;
        }
      }
      struct Candidate {
        std::vector<int> edges;
        std::size_t a, b;
        double saved;
      };
      std::vector<Candidate> candidates;
      for (std::vector<int>& edges : runs_of(cut)) {
        double length = 0;
        bool free = true;
        bool side = false;
        for (const int edge : edges) {
          length += lengths_[static_cast<std::size_t>(edge)];
          free = free && kept[static_cast<std::size_t>(edge)] == 0;
          side = side || sides[static_cast<std::size_t>(edge)] != 0;
        }
        const auto sharing = corners_of_edge(topology_, edges.front());
        const std::size_t a = piece_of_face[static_cast<std::size_t>(sharing[0] / 3)];
        const std::size_t b = piece_of_face[static_cast<std::size_t>(sharing[1] / 3)];
        // A front and its back stay two, but for a sleeve: what is small may lie round a limb.
        constexpr double kSleeve = 0.25;  // of the area
        const double area = pieces[a].areas.sum() + (a != b ? pieces[b].areas.sum() : 0);
        if (free && (!side || (!options_.woven && area < kSleeve * area_))) {
          candidates.push_back(
              {std::move(edges), std::min(a, b), std::max(a, b), length + kOwnLength});
        }
      }
      std::vector<std::size_t> unknown;
      for (std::size_t i = 0; i < candidates.size(); ++i) {
        const auto found = known.find(candidates[i].edges);
        if (found == known.end() || found->second.version_a != versions[candidates[i].a] ||
            found->second.version_b != versions[candidates[i].b]) {
          unknown.push_back(i);
        }
      }
      std::vector<Sewn> tried(unknown.size());
      parallel_for(static_cast<Index>(unknown.size()), 1, [&](Index begin, Index end) {
        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
          const Candidate& candidate = candidates[unknown[i]];
          tried[i] = sewn(pieces[candidate.a], pieces[candidate.b], cut, candidate.edges);
        }
      });
      for (std::size_t i = 0; i < unknown.size(); ++i) {
        const Candidate& candidate = candidates[unknown[i]];
        known[candidate.edges] = {versions[candidate.a], versions[candidate.b],
                                  std::move(tried[i])};
      }
      constexpr double kSeen = 0.01;  // m2 of excess for a metre of seam that looks up
      const Candidate* best = nullptr;
      double least = 0;
      for (const Candidate& candidate : candidates) {
        const Sewn& result = known.at(candidate.edges).sewn;
        const double here = result.excess / candidate.saved - kSeen * upwards(candidate.edges);
        const bool allowed = result.possible && strained + result.strained <= 0.01 * area_;
        if (allowed && (best == nullptr || here < least)) {
          best = &candidate;
          least = here;
        }
      }
      if (best == nullptr) {
        return count;
      }
      Sewn& result = known.at(best->edges).sewn;
      const double apart = strained_area(pieces[best->a]) +
                           (best->b != best->a ? strained_area(pieces[best->b]) : 0);
      lay_flat(result.piece, options_, 100, 1e-6);
      result.strained = strained_area(result.piece) - apart;
      if (result.piece.overlaps || strained + result.strained > 0.01 * area_) {
        result.possible = false;  // which shows only when it is laid out well
        continue;
      }
      ++count;
      pieces[best->a] = std::move(result.piece);
      versions[best->a] = version++;
      known.erase(best->edges);
      if (best->b != best->a) {
        pieces.erase(pieces.begin() + static_cast<std::ptrdiff_t>(best->b));
        versions.erase(versions.begin() + static_cast<std::ptrdiff_t>(best->b));
      }
    }
  }

 private:
  static bool is_disk(const SeamPiece& piece) {
    return boundary_loops(piece.topology).size() == 1 && euler_characteristic(piece.topology) == 1;
  }

  double strained_area(const SeamPiece& piece) const {
    double sum = piece.overlaps ? area_ : 0;
    for (Index f = 0; f < piece.faces.rows(); ++f) {
      sum += piece.strain[f] > bound_ ? piece.areas[f] : 0;
    }
    return sum;
  }

  /// The edges of each run of seam from one place where seams meet to the next, increasing.
  std::vector<std::vector<int>> runs_of(const std::vector<char>& cut) const {
    std::map<std::pair<int, int>, int> edge_at;
    for (Index e = 0; e < topology_.edges.rows(); ++e) {
      if (cut[static_cast<std::size_t>(e)] != 0) {
        edge_at[{topology_.edges(e, 0), topology_.edges(e, 1)}] = static_cast<int>(e);
      }
    }
    const SurfaceCut open = cut_surface(topology_, cut);
    std::vector<std::vector<int>> runs;
    for (const FlatSeam& seam : flat_seams(topology_, cut, open)) {
      std::vector<int> edges;
      for (std::size_t i = 1; i < seam.a.size(); ++i) {
        const int a = open.source[static_cast<std::size_t>(seam.a[i - 1])];
        const int b = open.source[static_cast<std::size_t>(seam.a[i])];
        edges.push_back(edge_at.at({std::min(a, b), std::max(a, b)}));
      }
      std::sort(edges.begin(), edges.end());
      runs.push_back(std::move(edges));
    }
    return runs;
  }

  /// Two pieces (or one, twice) without the seam `edges` between them.
  Sewn sewn(const SeamPiece& a, const SeamPiece& b, const std::vector<char>& cut,
            const std::vector<int>& edges) const {
    std::vector<int> faces = a.of_face;
    double excess = a.excess;
    double strained = strained_area(a);
    if (&a != &b) {
      faces.insert(faces.end(), b.of_face.begin(), b.of_face.end());
      excess += b.excess;
      strained += strained_area(b);
    }
    std::sort(faces.begin(), faces.end());
    SeamPiece both;
    both.faces.resize(std::ssize(faces), 3);
    std::vector<int> local(static_cast<std::size_t>(mesh_.vertices.rows()), -1);
    std::vector<int> sources;
    for (std::size_t f = 0; f < faces.size(); ++f) {
      for (int k = 0; k < 3; ++k) {
        const int source = mesh_.faces(faces[f], k);
        int& place = local[static_cast<std::size_t>(source)];
        if (place < 0) {
          place = static_cast<int>(sources.size());
          sources.push_back(source);
        }
        both.faces(static_cast<Index>(f), k) = place;
      }
    }
    both.vertices.resize(std::ssize(sources), 3);
    for (std::size_t v = 0; v < sources.size(); ++v) {
      both.vertices.row(static_cast<Index>(v)) = mesh_.vertices.row(sources[v]);
      both.bends.push_back(whole_.bends[static_cast<std::size_t>(sources[v])]);
    }
    both.of_face = std::move(faces);
    both.topology = topology_of(both.faces, both.vertices.rows());
    std::vector<char> flags(static_cast<std::size_t>(both.topology.edges.rows()), 0);
    for (Index e = 0; e < both.topology.edges.rows(); ++e) {
      const int whole = whole_edge(both, e);
      flags[static_cast<std::size_t>(e)] =
          cut[static_cast<std::size_t>(whole)] != 0 &&
                  !std::binary_search(edges.begin(), edges.end(), whole)
              ? 1
              : 0;
    }
    std::vector<SeamPiece> parts = parts_of(both, flags);
    Sewn result;
    if (parts.size() != 1 || !is_disk(parts.front())) {
      return result;
    }
    result.piece = std::move(parts.front());
    lay_flat(result.piece, options_, 40, 1e-5);
    result.possible =
        !result.piece.overlaps &&
        (!options_.woven ||
         corners_of(result.piece) <= std::max({options_.corners, corners_of(a), corners_of(b)}));
    result.excess = result.piece.excess - excess;
    result.strained = strained_area(result.piece) - strained;
    return result;
  }

  /// How far a seam of woven cloth looks up, -1 to 1: where it is seen.
  double upwards(const std::vector<int>& edges) const {
    double sum = 0;
    for (const int edge : edges) {
      sum += up_.empty() ? 0 : up_[static_cast<std::size_t>(edge)];
    }
    return sum / static_cast<double>(edges.size());
  }

  int whole_edge(const SeamPiece& piece, Index edge) const {
    const int corner = corners_of_edge(piece.topology, edge).front();
    return topology_.face_edges(piece.of_face[static_cast<std::size_t>(corner / 3)], corner % 3);
  }

  const Mesh& mesh_;
  FindSeamsOptions options_;
  Topology topology_;
  double bound_;
  MirrorPlane plane_;
  std::vector<double> up_;  // [E] of woven cloth
  std::vector<double> sides_;
  std::vector<double> lengths_;
  SeamPiece whole_;
  double area_ = 0;
};

/// Takes seams along sleeves out of those between front and back: what the rings cut off each
/// piece, but for its largest part, may be sewn round.
void free_limbs(const Mesh& mesh, const Topology& topology, FoundSeams& found) {
  const std::vector<char> none(found.rings.size(), 0);
  const SurfaceCut whole = cut_surface(topology, none);
  const SurfaceCut parted = cut_surface(topology, found.rings);
  const Eigen::VectorXd areas = face_areas(mesh.vertices, mesh.faces);
  std::vector<double> sizes(static_cast<std::size_t>(parted.panel_count), 0);
  for (Index f = 0; f < areas.size(); ++f) {
    sizes[static_cast<std::size_t>(parted.panels[static_cast<std::size_t>(f)])] += areas[f];
  }
  std::vector<double> largest(static_cast<std::size_t>(whole.panel_count), 0);
  for (std::size_t f = 0; f < parted.panels.size(); ++f) {
    double& most = largest[static_cast<std::size_t>(whole.panels[f])];
    most = std::max(most, sizes[static_cast<std::size_t>(parted.panels[f])]);
  }
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const auto face = static_cast<std::size_t>(corners_of_edge(topology, e).front() / 3);
    if (sizes[static_cast<std::size_t>(parted.panels[face])] <
        largest[static_cast<std::size_t>(whole.panels[face])]) {
      found.sides[static_cast<std::size_t>(e)] = 0;
    }
  }
}

}  // namespace

OptionTable describe(FindSeamsOptions& options) {
  OptionTable table;
  table.add("stretch", options.stretch, 0.001, 1, "",
            "Stretch below which 99% of the area must lie; seams are added until it does");
  table.add("cuts", options.cuts, 0, 1000, "", "Maximum number of seams and darts added");
  table.add("front_and_back", options.front_and_back, "Initial cut into a front and a back");
  table.add("front_back_cost", options.front_back_cost, 0, 100, "",
            "Relative cost of seams in front and at the back compared with the sides; raise it to "
            "keep seams at the sides");
  table.add("thread_stretch", options.thread_stretch, 0.001, 1, "",
            "Stretch along warp and weft each below which 99% of the area must lie, of the layout "
            "woven");
  table.add(
      "bias_stretch", options.bias_stretch, 0.001, 1, "",
      "Stretch in every direction, by shear between warp and weft, below which 99% of the area "
      "must lie, of the layout woven; raise it for loosely woven cloth");
  table.add("corners", options.corners, 4, 100, "",
            "Corners of a panel that cuts and joins of the layout woven keep to where they can");
  table.add("join", options.join, "Removal of seams that turn out to be unnecessary");
  return table;
}

FoundSeams find_seams(const Mesh& mesh, const std::vector<char>& given,
                      const FindSeamsOptions& options, const SeamWatch& watch,
                      const FoundSeams& from) {
  check_flattenable(mesh);
  const Eigen::Vector3d facing = options.facing.isZero() ? facing_of(mesh) : options.facing;
  const Search search(mesh, facing, options);
  const bool goes_on = !from.cut.empty();
  ATELIER_CHECK(
      static_cast<Index>(given.size()) == search.topology().edges.rows() &&
          (!goes_on || (from.cut.size() == given.size() && from.sides.size() == given.size() &&
                        from.rings.size() == given.size())),
      "a flag for each edge");
  FoundSeams found;
  std::vector<char> begun;
  if (goes_on) {
    found.sides = from.sides;
    found.rings = from.rings;
  } else {
    found.rings = options.woven && options.front_and_back
                      ? limb_rings(mesh, search.topology(), facing)
                      : std::vector<char>(given.size(), 0);
    found.sides =
        options.front_and_back ? front_and_back(mesh, facing) : std::vector<char>(given.size(), 0);
    if (options.woven && options.front_and_back) {
      begun = found.sides;
      free_limbs(mesh, search.topology(), found);
      const std::vector<char> rise = rise_seams(mesh, search.topology(), facing);
      for (std::size_t e = 0; e < rise.size(); ++e) {
        found.rings[e] = static_cast<char>(found.rings[e] | rise[e]);
      }
    }
  }
  const std::vector<char>& sides = found.sides;
  std::vector<char> kept = given;
  if (goes_on) {
    begun = from.cut;
  } else if (begun.empty()) {
    begun = sides;
  }
  std::vector<char> start = given;
  for (std::size_t e = 0; e < start.size(); ++e) {
    start[e] = static_cast<char>(start[e] | begun[e] | found.rings[e]);
    kept[e] = static_cast<char>(kept[e] | found.rings[e]);
  }
  std::vector<SeamPiece> pieces = search.pieces_of(search.opened(start));
  std::vector<char> stuck;  // pieces that no cut betters
  const auto say = [&](const std::string& what) {
    if (watch) {
      char text[120];
      std::snprintf(text, sizeof text, "%s: %zu panels, %.1f%% stretched too far", what.c_str(),
                    pieces.size(), 100 * search.stretched(pieces));
      const auto over = Search::overlaps(pieces);
      watch(text + (over > 0 ? ", " + std::to_string(over) + " over themselves" : std::string()));
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
    Search::CutPiece cut = search.best_cut(pieces[worst]);
    if (cut.parts.empty()) {
      stuck[worst] = 1;
      continue;
    }
    const bool split = cut.parts.size() > 1;
    Search::replace(pieces, stuck, worst, std::move(cut.parts));
    found.added += 1 + search.cut_alike(pieces, stuck, cut);
    say(split ? "seam" : "dart");
  }
  if (options.join && search.too_far(pieces) <= 0.01) {
    found.joined = search.sew(pieces, kept, sides);
  }
  found.reached = search.too_far(pieces) <= 0.01;
  found.cut = search.cut_of(pieces);
  return found;
}

}  // namespace atelier
