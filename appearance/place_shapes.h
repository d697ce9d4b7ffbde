#pragma once

#include <vector>

#include "core/types.h"

namespace atelier {

/// A flat shape as its triangles, whichever way round.
struct FlatShape {
  Points2 points;   ///< [P,2]
  Triangles faces;  ///< [F,3] into points
};

/// Where a shape lies: p goes to scale * R(angle) * p + place.
struct PlacedShape {
  double angle = 0;             ///< rad, counter-clockwise
  Eigen::Vector2d place{0, 0};  ///< in the square
};

struct ShapePlacement {
  double scale = 0;  ///< 0: no room at any scale that was tried
  std::vector<PlacedShape> shapes;
};

/// Lays shapes into the unit square at one scale, as large as it finds room for, turned as suits,
/// at least `margin` from each other and from the border: on a raster of cells, the largest first,
/// each as low as it gets at the angle at which its top is lowest ("Tetris", Lévy et al. 2002,
/// "Least squares conformal maps", with whole outlines for horizons; the first shape's angle is
/// tried in turn where there are few). Concave shapes fit into one another. The same shapes give
/// the same placement.
///
/// Scales from `least` (none smaller is tried) to the one that would fill the square, by bisection.
/// Cost: some tens of milliseconds for two shapes, seconds for fifty.
ShapePlacement place_shapes(const std::vector<FlatShape>& shapes, double margin, double least);

}  // namespace atelier
