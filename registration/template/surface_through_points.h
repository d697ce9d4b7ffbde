#pragma once

#include "core/mesh.h"
#include "core/options.h"

namespace atelier {

struct ThroughPointsOptions {
  double cell = 0.009;  ///< m, of the grid; finer keeps smaller folds, 1e-4 to 1
  double reach = 0.05;  ///< m that the surface goes on beyond the points: holes twice as wide close
  double stiffness = 0.02;  ///< of what has no points, against points; larger is smoother, above 0
  int iterations = 150;     ///< of the solver, 1 to 10000
};
OptionTable describe(ThroughPointsOptions& options);

/// A surface through oriented points, which goes on smoothly past their rims and across holes: the
/// zero set of the smooth signed distance (Calakli and Taubin, "SSD: Smooth signed distance surface
/// reconstruction", 2011) on a grid near the points: least squares of its value and gradient at the
/// points (0 and the normal) and of its second differences everywhere. Unlike an indicator function
/// it does not close where cloth ends, so that no neck or cuff gets a lid. Polygonised by
/// tetrahedra (six to a cell), so that the result is an oriented manifold with a rim where the grid
/// ends. Triangles look along the normals.
///
/// Throws LogicError unless arrays agree and numbers are finite; DataError where the grid would
/// need more than 2^28 cells. Time and memory grow with area over cell squared.
Mesh surface_through_points(const Points& points, const Points& normals,
                            const Eigen::VectorXd& weights,
                            const ThroughPointsOptions& options = {});

}  // namespace atelier
