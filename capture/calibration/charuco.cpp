#include "capture/calibration/charuco.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

namespace atelier {
namespace {

/// The plane of a marker whose corners are (0, 0), (1, 0), (1, 1), (0, 1); nothing where they are
/// no convex quadrangle. Heckbert, "Fundamentals of texture mapping and image warping",
/// 1989, 2.2.3.
std::optional<Eigen::Matrix3d> marker_from_image(const SeenMarker& marker) {
  const auto corner = [&](int i) -> Eigen::Vector2d { return marker.corners.row(i).transpose(); };
  const Eigen::Vector2d bend = corner(0) - corner(1) + corner(2) - corner(3);
  Eigen::Matrix2d sides;
  sides << corner(1) - corner(2), corner(3) - corner(2);
  if (std::abs(sides.determinant()) < 1e-9) {
    return std::nullopt;
  }
  const Eigen::Vector2d g = sides.inverse() * bend;
  Eigen::Matrix3d image_from_marker;
  image_from_marker << corner(1) - corner(0) + g.x() * corner(1),
      corner(3) - corner(0) + g.y() * corner(3), corner(0), g.x(), g.y(), 1;
  const Eigen::Matrix3d inverse = image_from_marker.inverse();
  return inverse.allFinite() ? std::optional(inverse) : std::nullopt;
}

/// Whether a pixel lies beyond this corner of the marker, on its diagonal.
bool on_diagonal(const SeenMarker& marker, int corner, const Eigen::Vector2d& pixel) {
  const auto plane = marker_from_image(marker);
  if (!plane) {
    return false;
  }
  const Eigen::Vector3d at = *plane * Eigen::Vector3d(pixel.x(), pixel.y(), 1);
  const double x = at.x() / at.z();
  const double y = at.y() / at.z();
  const double across = corner == 1 || corner == 2 ? x - 1 : -x;  // sides beyond the corner
  const double down = corner == 2 || corner == 3 ? y - 1 : -y;
  constexpr double kLeast = 0.005;
  constexpr double kMost = 6;  // markers a seventh of their square
  return across > kLeast && down > kLeast && across < kMost && down < kMost &&
         std::abs(across - down) < 0.15 + 0.15 * (across + down);
}

}  // namespace

MarkerSquare marker_square(int id, const CharucoPattern& pattern) {
  // Two rows have as many white squares as there are columns.
  const int first = pattern.legacy ? 0 : 1;
  const int in_first_row = (pattern.columns + 1 - first) / 2;
  const int pair = id / pattern.columns;
  const int place = id % pattern.columns;
  if (place < in_first_row) {
    return {2 * place + first, 2 * pair};
  }
  return {2 * (place - in_first_row) + 1 - first, 2 * pair + 1};
}

std::vector<FacingCorners> facing_corners(const std::vector<SeenMarker>& markers,
                                          const CharucoPattern& pattern) {
  std::map<std::pair<int, int>, const SeenMarker*> by_square;  // row, column
  for (const SeenMarker& marker : markers) {
    const MarkerSquare square = marker_square(marker.id, pattern);
    by_square.try_emplace({square.row, square.column}, &marker);
  }
  std::vector<FacingCorners> facing;
  for (const auto& [square, marker] : by_square) {
    const auto [row, column] = square;
    for (const bool right : {false, true}) {
      const auto below = by_square.find({row + 1, right ? column + 1 : column - 1});
      if (below == by_square.end()) {
        continue;
      }
      const int corner = right ? 2 : 3;
      const int other_corner = right ? 0 : 1;
      const Eigen::Vector2d a = marker->corners.row(corner).transpose();
      const Eigen::Vector2d b = below->second->corners.row(other_corner).transpose();
      facing.push_back(
          {right ? column + 1 : column, row + 1, 0.5 * (a + b), 0.5 * (a - b).norm(),
           on_diagonal(*marker, corner, b) && on_diagonal(*below->second, other_corner, a)});
    }
  }
  return facing;
}

PatternFit pattern_fit(const std::vector<SeenMarker>& markers, const CharucoPattern& pattern) {
  const std::vector<FacingCorners> facing = facing_corners(markers, pattern);
  PatternFit fit;
  fit.pattern = pattern;
  fit.all = static_cast<int>(facing.size());
  fit.fitting = static_cast<int>(std::count_if(
      facing.begin(), facing.end(), [](const FacingCorners& corners) { return corners.fits; }));
  fit.fits = fit.fitting > 0 && 3 * fit.fitting > 2 * fit.all;
  return fit;
}

PatternFit fitting_pattern(const std::vector<SeenMarker>& markers, int columns) {
  const PatternFit today = pattern_fit(markers, {columns, false});
  const PatternFit legacy = pattern_fit(markers, {columns, true});
  return legacy.fitting > today.fitting ? legacy : today;
}

}  // namespace atelier
