#include "registration/flattening/find_pattern.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "core/normals.h"
#include "core/topology.h"
#include "core/tree.h"
#include "registration/edge_paths.h"
#include "registration/flattening/front_and_back.h"
#include "registration/flattening/straight_seams.h"
#include "registration/flattening/unstretched_surface.h"
#include "registration/outlines/outline_measures.h"
#include "registration/remove_slivers.h"

namespace atelier {
namespace {

constexpr int kSeamSearches = 4;         // at most
constexpr double kForEqualSeams = 0.97;  // of the stretch: what equal seams cost
constexpr double kLessStretch = 0.95;    // of the stretch, after a search whose pattern missed it
constexpr double kLeastStretch = 0.6;    // the same, of woven cloth that misses it by far
constexpr double kPanelLength = 0.15;    // m of seam that a panel is worth
constexpr double kShorter = 0.98;        // of what there is: worth taking, since it stretches more
constexpr double kNearlyKept = 1.15;     // of the stretch: what may still come within it

/// How far points are from a surface, m.
Eigen::VectorXd ways_off(const Mesh& surface, const Points& points) {
  const std::vector<ClosestPoint> nearest =
      closest_points(build_tree(surface.vertices, surface.faces), points);
  Eigen::VectorXd ways(points.rows());
  for (Index i = 0; i < points.rows(); ++i) {
    ways[i] = std::sqrt(nearest[static_cast<std::size_t>(i)].squared_distance);
  }
  return ways;
}

void tighten(FindSeamsOptions& find, double share) {
  find.stretch *= share;
  find.thread_stretch *= share;
  find.bias_stretch *= share;
}

/// How many corners panels have beyond so many each.
int corners_beyond(const FlatPattern& pattern, int allowed) {
  int beyond = 0;
  for (const std::vector<int>& loop : boundary_loops(
           topology_of(pattern.cut.faces, static_cast<Index>(pattern.cut.source.size())))) {
    Points2 outline(static_cast<Index>(loop.size()), 2);
    for (std::size_t i = 0; i < loop.size(); ++i) {
      outline.row(static_cast<Index>(i)) = pattern.vertices.row(loop[i]);
    }
    beyond += std::max(0, corner_count(outline) - allowed);
  }
  return beyond;
}

/// Patterns as they are tried; what is best is kept.
class PatternTrial {
 public:
  PatternTrial(const Mesh& mesh, const FindPatternOptions& options, const SeamWatch& watch)
      : options_(options), watch_(watch), surface_(mesh), moved_(mesh) {
    options_.flatten.panel.even = stiffening_of(stretch_bound(options.find));
    quick_ = options_.flatten;
    quick_.panel.woven = false;  // a surface is not to be sheared as its pattern is
    options_.flatten.panel.woven = options.find.woven;
    quick_.equal_seams = false;
  }

  /// The surface as it is now.
  const Mesh& mesh() const { return moved_; }
  /// Of the best that keeps the bound, m; infinite where none does.
  double cost() const { return cost_; }
  const FoundPattern& best() const { return best_; }
  /// The share of its bound that the next search is to keep, after one whose pattern missed it. Of
  /// woven cloth as much less as the last pattern stretched more: it takes a dart or a cut.
  double next_share() const {
    const double missed = stretch_bound(options_.find) / std::max(strain_, 1e-9);
    return options_.find.woven ? std::clamp(missed, kLeastStretch, kLessStretch) : kLessStretch;
  }

  /// Where vertices are.
  std::pair<Mesh, Mesh> places() const { return {surface_, moved_}; }
  void return_to(const std::pair<Mesh, Mesh>& places) {
    surface_ = places.first;
    moved_ = places.second;
  }

  /// Seams straightened by so many rounds; what would need stretch is taken out of the surface.
  void straighten(const FoundSeams& seams, int rounds) {
    surface_.vertices = straightened_seams(surface_, seams.cut, rounds);
    moved_.vertices = surface_.vertices;
    constexpr int kTimes = 2;  // the pattern follows the surface, which follows the pattern
    for (int i = 0; i < kTimes && options_.tolerance > 0; ++i) {
      unstretch(laid_quickly(seams));
    }
  }

  /// Lays the surface out by these seams; true if the bound holds.
  bool keeps_bound(const FoundSeams& seams, const char* what) {
    const bool woven = options_.find.woven;
    const Points2 start = woven ? laid_quickly(seams).vertices : Points2();
    FlatPattern pattern = flatten_surface(moved_, seams.cut, options_.flatten, start);
    FlatMeasures measures = measure_flat(moved_, pattern);
    const double bound = stretch_bound(options_.find);
    const auto strain = [&] { return bounded_strain(measures, options_.find); };
    const auto nearly = [&] { return strain() > bound && strain() < kNearlyKept * bound; };
    constexpr int kTimes = 3;
    for (int i = 0; i < kTimes && options_.tolerance > 0 && nearly(); ++i) {
      unstretch(woven ? laid_quickly(seams) : pattern);
      pattern = flatten_surface(moved_, seams.cut, options_.flatten,
                                woven ? pattern.vertices : Points2());
      measures = measure_flat(moved_, pattern);
    }
    say(what, pattern, measures);
    strain_ = strain();
    const int corners = woven ? corners_beyond(pattern, options_.find.corners) : 0;
    const bool few = !best_.reached || corners <= corners_;
    const bool reached = strain_ <= bound && measures.overlaps == 0 && few;
    const double cost = reached ? measures.seam_length + kPanelLength * pattern.cut.panel_count
                                : std::numeric_limits<double>::infinity();
    if (cost < kShorter * cost_ || !best_.reached) {
      cost_ = cost;
      corners_ = corners;
      const Eigen::VectorXd ways = ways_off(surface_, moved_.vertices);
      best_ = {moved_,  seams,       std::move(pattern), std::move(measures),
               reached, ways.mean(), ways.maxCoeff()};
      best_places_ = {surface_, moved_};
    }
    return reached;
  }

  /// Sews seams of the best again that are not needed once the surface has stretched, the one first
  /// that saves most. Each is tried once, until so many in a row are needed that few others will
  /// not be.
  void sew() {
    constexpr int kNeeded = 24;
    std::set<std::vector<int>> tried;
    for (int needed = 0; needed < kNeeded;) {
      const std::vector<std::vector<int>> runs = seams_to_sew();
      const auto next = std::find_if(runs.begin(), runs.end(),
                                     [&](const auto& run) { return !tried.contains(run); });
      if (next == runs.end()) {
        return;
      }
      tried.insert(*next);
      FoundSeams seams = best_.seams;
      for (const int edge : *next) {
        seams.cut[static_cast<std::size_t>(edge)] = 0;
      }
      ++seams.joined;
      return_to(best_places_);
      const double before = cost_;
      keeps_bound(seams, "sewn");
      needed = cost_ < before ? 0 : needed + 1;
    }
  }

 private:
  /// Runs of edges between two panels of the best, and darts, the longest first. A front and its
  /// back stay two, but for what is small, as a sleeve.
  std::vector<std::vector<int>> seams_to_sew() const {
    constexpr double kSmall = 0.25;  // of the area
    const FlatPattern& pattern = best_.pattern;
    const Topology topology = topology_of(best_.mesh.faces, best_.mesh.vertices.rows());
    std::map<std::pair<int, int>, int> edge_at;
    for (Index e = 0; e < topology.edges.rows(); ++e) {
      edge_at[{topology.edges(e, 0), topology.edges(e, 1)}] = static_cast<int>(e);
    }
    const std::vector<double> lengths = edge_lengths(topology, best_.mesh.vertices);
    const Eigen::VectorXd areas = face_areas(best_.mesh.vertices, best_.mesh.faces);
    std::vector<double> of_panel(static_cast<std::size_t>(pattern.cut.panel_count), 0);
    for (Index f = 0; f < areas.size(); ++f) {
      of_panel[static_cast<std::size_t>(pattern.cut.panels[static_cast<std::size_t>(f)])] +=
          areas[f];
    }
    std::vector<std::pair<double, std::vector<int>>> runs;
    for (const FlatSeam& seam : pattern.seams) {
      std::vector<int> edges;
      double length = 0;
      bool side = false;
      for (std::size_t i = 1; i < seam.a.size(); ++i) {
        const int a = pattern.cut.source[static_cast<std::size_t>(seam.a[i - 1])];
        const int b = pattern.cut.source[static_cast<std::size_t>(seam.a[i])];
        edges.push_back(edge_at.at({std::min(a, b), std::max(a, b)}));
        length += lengths[static_cast<std::size_t>(edges.back())];
        side = side || best_.seams.sides[static_cast<std::size_t>(edges.back())] != 0;
      }
      const bool ring = std::any_of(edges.begin(), edges.end(), [&](int edge) {
        return best_.seams.rings[static_cast<std::size_t>(edge)] != 0;
      });
      const bool apart = seam.panel_a != seam.panel_b;
      const bool dart = !apart && seam.a.back() == seam.b.back();
      const double area = of_panel[static_cast<std::size_t>(seam.panel_a)] +
                          (apart ? of_panel[static_cast<std::size_t>(seam.panel_b)] : 0);
      if (!ring && (apart || dart) &&
          (!side || (!options_.find.woven && area < kSmall * areas.sum()))) {
        std::sort(edges.begin(), edges.end());
        runs.emplace_back(-length - (apart ? kPanelLength : 0), std::move(edges));
      }
    }
    std::sort(runs.begin(), runs.end());
    std::vector<std::vector<int>> sorted;
    sorted.reserve(runs.size());
    for (auto& run : runs) {
      sorted.push_back(std::move(run.second));
    }
    return sorted;
  }

  /// The surface laid flat as what does not shear, each seam's sides as they come. Of woven cloth
  /// it goes on from where it lay by the same seams.
  FlatPattern laid_quickly(const FoundSeams& seams) {
    const bool again = options_.find.woven && quickly_cut_ == seams.cut;
    FlatPattern pattern =
        flatten_surface(moved_, seams.cut, quick_, again ? quickly_laid_ : Points2());
    quickly_cut_ = seams.cut;
    quickly_laid_ = pattern.vertices;
    return pattern;
  }

  void unstretch(const FlatPattern& pattern) {
    moved_.vertices = unstretched_surface(surface_, pattern, stretch_bound(options_.find),
                                          options_.tolerance, moved_.vertices);
    moved_ = remove_slivers(moved_, {.flips = false});
  }

  void say(const char* what, const FlatPattern& pattern, const FlatMeasures& measures) const {
    if (watch_) {
      char text[120];
      std::snprintf(text, sizeof text, "%s: %d panels, %.2f m, stretch p99 %.2f%%%s", what,
                    pattern.cut.panel_count, measures.seam_length,
                    100 * bounded_strain(measures, options_.find),
                    measures.overlaps > 0 ? ", over itself" : "");
      watch_(text);
    }
  }

  FindPatternOptions options_;
  FlattenOptions quick_;  // sides of seams as they come
  const SeamWatch& watch_;
  Mesh surface_;  // as it was given, but for vertices that slid along it
  Mesh moved_;    // what of it is laid flat
  FoundPattern best_;
  std::pair<Mesh, Mesh> best_places_;
  std::vector<char> quickly_cut_;
  Points2 quickly_laid_;
  double strain_ = 0;  // of the last pattern, what stretch_bound bounds
  int corners_ = 0;    // of the best, beyond those that panels may have
  double cost_ = std::numeric_limits<double>::infinity();
};

}  // namespace

FoundPattern find_pattern(const Mesh& mesh, const FindPatternOptions& options,
                          const SeamWatch& watch) {
  check_flattenable(mesh);
  constexpr int kStraight = 30;
  PatternTrial trial(mesh, options, watch);
  const std::vector<char> none(
      static_cast<std::size_t>(topology_of(mesh.faces, mesh.vertices.rows()).edges.rows()), 0);
  FindSeamsOptions find = options.find;
  if (find.facing.isZero()) {
    find.facing = facing_of(mesh);  // of all that the surface becomes
  }
  tighten(find, kForEqualSeams);
  FindSeamsOptions first = find;
  first.cuts = 0;
  first.join = false;
  FoundSeams seams = find_seams(mesh, none, first, {});
  trial.straighten(seams, kStraight);
  for (int i = 0; i < kSeamSearches; ++i) {
    seams = find_seams(trial.mesh(), none, find, watch, seams);
    const auto before = trial.places();
    trial.straighten(seams, kStraight);
    const double cost_before = trial.cost();
    if (trial.keeps_bound(seams, "straight")) {
      if (trial.cost() < cost_before) {
        continue;  // on what stretched for these seams, some more may not be needed
      }
      break;
    }
    const auto straight = trial.places();
    for (const int rounds : {4, 0}) {
      trial.return_to(before);
      trial.straighten(seams, rounds);
      if (trial.keeps_bound(seams, rounds > 0 ? "straighter" : "as found") || !seams.reached) {
        break;
      }
    }
    trial.return_to(straight);
    if (!seams.reached) {
      break;  // no seams keep it, however they run
    }
    if (!trial.best().reached) {
      tighten(find, trial.next_share());
    }
  }
  // Rough surfaces may lie flat by seams that run zigzag alone.
  find.stretch = options.find.stretch;
  find.thread_stretch = options.find.thread_stretch;
  find.bias_stretch = options.find.bias_stretch;
  tighten(find, kForEqualSeams);
  for (int i = 0; i < kSeamSearches && !trial.best().reached; ++i) {
    trial.return_to({mesh, mesh});
    seams = find_seams(mesh, none, find, watch);
    if (trial.keeps_bound(seams, "along edges") || !seams.reached) {
      break;
    }
    tighten(find, trial.next_share());
  }
  if (trial.best().reached && options.find.join) {
    trial.sew();
  }
  return trial.best();
}

}  // namespace atelier
