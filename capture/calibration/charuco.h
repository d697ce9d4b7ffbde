#pragma once

#include <Eigen/Core>
#include <vector>

namespace atelier {

/// A marker in an image: its number and its corners, px, clockwise from its own upper left one.
struct SeenMarker {
  int id = 0;
  Eigen::Matrix<double, 4, 2, Eigen::RowMajor> corners;
};

/// How the markers of a ChArUco board fill its white squares: row by row. OpenCV prints the upper
/// left square black; before 4.6 it printed it white where the number of rows is even
/// (`CharucoBoard::setLegacyPattern`).
struct CharucoPattern {
  int columns = 0;      ///< squares across
  bool legacy = false;  ///< the upper left square is white
};

/// Square of a marker, counted from the upper left one.
struct MarkerSquare {
  int column = 0;
  int row = 0;
};
MarkerSquare marker_square(int id, const CharucoPattern& pattern);

/// An inner corner of the board at which the corners of two markers face each other.
struct FacingCorners {
  int column = 0, row = 0;  ///< of the inner corner, 1 to squares - 1
  Eigen::Vector2d middle;   ///< px, between the two: near the inner corner
  double distance = 0;      ///< px, from the middle to either
  bool fits = false;        ///< each marker is where the other, continued as a plane, puts it
};

/// Every inner corner whose two markers were seen, by a pattern that may be the wrong one: then few
/// fit. Of several markers with one number the first counts. Our choice of the test: a marker's
/// corner in the coordinates of the other one (homography of its four corners) lies on the diagonal
/// of it, to 0.15 of its side and 0.3 of the gap between them.
std::vector<FacingCorners> facing_corners(const std::vector<SeenMarker>& markers,
                                          const CharucoPattern& pattern);

/// How many of them fit, and of how many.
struct PatternFit {
  CharucoPattern pattern;
  int fitting = 0;
  int all = 0;
  bool fits = false;  ///< more than two thirds of at least one
};
PatternFit pattern_fit(const std::vector<SeenMarker>& markers, const CharucoPattern& pattern);

/// The better of today's and the legacy pattern; today's where no two markers face each other.
PatternFit fitting_pattern(const std::vector<SeenMarker>& markers, int columns);

}  // namespace atelier
