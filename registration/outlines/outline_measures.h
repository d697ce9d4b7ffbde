#pragma once

#include <optional>
#include <vector>

#include "core/types.h"
#include "registration/sewing/sewing_pattern.h"

namespace atelier {

/// Visual quality of a pattern's outlines. Lengths in metres.
struct OutlineMeasures {
  int panels = 0;
  double corners_mean = 0;  ///< of a panel: turns by more than 35 degrees over 3 cm to either side
  int corners_max = 0;
  /// Rms distance of the outlines from themselves, smoothed over 2 cm between corners.
  double jaggedness = 0;
  /// Changes between turning left and turning right (by more than 0.15 rad over 1 cm to either
  /// side) for each metre: none on straight lines and arcs, one in an S, one for each edge of a
  /// zigzag.
  double turns_per_metre = 0;
  /// Rms distance of a panel's outline, mirrored left to right, from the panel that it matches
  /// best, itself or one of those alike, after a rigid motion; a mean by area.
  double asymmetry = 0;
  /// The shortest straight cut through a panel with at least 20 cm2 and twice its square on either
  /// side.
  double narrowest_neck = 0;
};

/// Measures closed outlines, counter-clockwise, in points every 5 mm. Our choice of all. O(n^2) for
/// each panel and the six most alike (alike_outlines.h).
OutlineMeasures measure_outlines(const std::vector<Points2>& outlines);

/// Corners of one closed outline, as measure_outlines counts them.
int corner_count(const Points2& outline);

/// Area inside a closed outline, m2; negative where it runs clockwise.
double area_of_outline(const Points2& outline);

/// The same, as shares of the outline's length from its first point on, 0 to 1.
std::vector<double> corner_shares(const Points2& outline);

/// An outline mirrored left to right and moved onto another, counter-clockwise again, and the rms
/// distance that remains, m: the larger of both ways.
struct MirrorMatch {
  Points2 image;
  double off = 0;
};
MirrorMatch mirror_match(const Points2& moving, const Points2& fixed);

/// The largest difference between the two sides of a seam (all pairs of one name), share of their
/// mean length.
double seam_mismatch(const SewingPattern& pattern);

/// A panel's outline as points: corners, and on curves every `spacing` metres at most (an edge has
/// 2,000 points at most).
Points2 panel_outline(const Panel& panel, double spacing = 0.004);

/// The line about which an outline is its own mirror image.
struct MirrorLine {
  Eigen::Vector2d point, along;  ///< m; unit, upwards
  double off = 0;                ///< m: rms distance of the mirrored outline
};

/// The best one within 20 degrees of the grain (+y).
MirrorLine mirror_line(const Points2& outline);

}  // namespace atelier
