#include "registration/find_pattern.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "core/tree.h"
#include "registration/blunt_corners.h"
#include "registration/straight_seams.h"
#include "registration/unstretched_surface.h"

namespace atelier {
namespace {

constexpr int kSeamSearches = 4;         // at most
constexpr double kForEqualSeams = 0.97;  // of the stretch: what equal seams cost
constexpr double kLessStretch = 0.95;    // of the stretch, after a search whose pattern missed it
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

/// Patterns as they are tried; what is best is kept.
class PatternTrial {
 public:
  PatternTrial(const Mesh& mesh, const FindPatternOptions& options, const SeamWatch& watch)
      : options_(options), watch_(watch), surface_(mesh), moved_(mesh) {
    options_.flatten.panel.even = stiffening_of(options.find.stretch);
    quick_ = options_.flatten;
    quick_.equal_seams = false;
  }

  /// The surface as it is now.
  const Mesh& mesh() const { return moved_; }
  /// Of the best that keeps the bound, m; infinite where none does.
  double cost() const { return cost_; }
  const FoundPattern& best() const { return best_; }

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
    for (int i = 0; i < kTimes && options_.give > 0; ++i) {
      unstretch(flatten_surface(moved_, seams.cut, quick_));
    }
  }

  /// Lays the surface out by these seams; true if the bound holds.
  bool keeps_bound(const FoundSeams& seams, const char* what) {
    FlatPattern pattern = flatten_surface(moved_, seams.cut, options_.flatten);
    FlatMeasures measures = measure_flat(moved_, pattern);
    const double bound = options_.find.stretch;
    const auto nearly = [&] {
      return measures.strain_p99 > bound && measures.strain_p99 < kNearlyKept * bound;
    };
    constexpr int kTimes = 3;
    for (int i = 0; i < kTimes && options_.give > 0 && nearly(); ++i) {
      unstretch(pattern);
      pattern = flatten_surface(moved_, seams.cut, options_.flatten);
      measures = measure_flat(moved_, pattern);
    }
    say(what, pattern, measures);
    const bool reached = measures.strain_p99 <= bound && measures.overlaps == 0;
    const double cost = reached ? measures.seam_length + kPanelLength * pattern.cut.panel_count
                                : std::numeric_limits<double>::infinity();
    if (cost < kShorter * cost_ || !best_.reached) {
      cost_ = cost;
      const Eigen::VectorXd ways = ways_off(surface_, moved_.vertices);
      best_ = {moved_,  seams,       std::move(pattern), std::move(measures),
               reached, ways.mean(), ways.maxCoeff()};
    }
    return reached;
  }

 private:
  void unstretch(const FlatPattern& pattern) {
    moved_.vertices = unstretched_surface(surface_, pattern, options_.find.stretch, options_.give,
                                          moved_.vertices);
    moved_ = with_blunt_corners(moved_, {.flips = false});
  }

  void say(const char* what, const FlatPattern& pattern, const FlatMeasures& measures) const {
    if (watch_) {
      char text[120];
      std::snprintf(text, sizeof text, "%s: %d panels, %.2f m, stretch p99 %.2f%%", what,
                    pattern.cut.panel_count, measures.seam_length, 100 * measures.strain_p99);
      watch_(text);
    }
  }

  FindPatternOptions options_;
  FlattenOptions quick_;  // sides of seams as they come
  const SeamWatch& watch_;
  Mesh surface_;  // as it was given, but for sliding along itself
  Mesh moved_;    // what of it is laid flat
  FoundPattern best_;
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
  find.stretch *= kForEqualSeams;
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
        continue;  // on what gave way for these seams, some more may not be needed
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
      find.stretch *= kLessStretch;
    }
  }
  // Rough surfaces may lie flat by seams that run zigzag alone.
  find.stretch = kForEqualSeams * options.find.stretch;
  for (int i = 0; i < kSeamSearches && !trial.best().reached; ++i) {
    trial.return_to({mesh, mesh});
    seams = find_seams(mesh, none, find, watch);
    if (trial.keeps_bound(seams, "along edges") || !seams.reached) {
      break;
    }
    find.stretch *= kLessStretch;
  }
  return trial.best();
}

}  // namespace atelier
