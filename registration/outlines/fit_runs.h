#pragma once

#include <vector>

#include "core/types.h"
#include "registration/sewing/sewing_pattern.h"

namespace atelier {

/// How closely runs of points are drawn as lines, arcs and cubics.
struct FitRunsOptions {
  double reach = 0.02;  ///< m over which noise is smoothed before; 0: points stay
  double tolerance =
      0.003;  ///< m that an edge keeps to the smoothed points; 0: each segment a line
};

/// Runs as edges, all parted at the same points.
struct FittedRuns {
  std::vector<std::size_t> joints;            ///< [E+1] points where edges meet, ends included
  std::vector<Points2> corners;               ///< [R][E+1,2] m: where they meet, smoothed
  std::vector<std::vector<PanelEdge>> edges;  ///< [R][E] their corners and names are not set
};

/// Points of a run that are corners: its ends, and where it turns by more than 0.7 rad over `reach`
/// metres (three segments at least, so that a zigzag of single edges is none). Our choice.
std::vector<std::size_t> run_corners(const Points2& run, double reach);

/// A run smoothed over `reach` metres by Whittaker's penalty of second differences (Eilers, "A
/// perfect smoother", 2003); ends stay. O(n).
Points2 smoothed_points(const Points2& run, double reach);

/// Draws runs of points - the two sides of a seam, or an edge alone - by the fewest simple curves.
///
/// Corners of any run are kept on all. Between them points are smoothed (smoothed_points), and the
/// first of line, circular arc and cubic that keeps to them within the tolerance is taken, cubics
/// by least squares with parameters improved by Newton's method (Schneider, "An algorithm for
/// automatically fitting digitized curves", 1990). Where none does on some run, all are parted at
/// the point that is farthest off, and go on there in a common direction. Ends stay exactly where
/// they are.
///
/// `runs` have the same number of points, two at least, of which no two in a row coincide;
/// LogicError otherwise.
FittedRuns fit_runs(const std::vector<Points2>& runs, const FitRunsOptions& options = {});

}  // namespace atelier
