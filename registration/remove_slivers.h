#pragma once

#include "core/mesh.h"

namespace atelier {

/// How slivers are taken out of a surface.
struct RemoveSliversOptions {
  double least = 10;   ///< deg: smaller corners are widened, 0 to 30
  double off = 0.001;  ///< m: how far a flipped edge may be from the one before, and a rim from
                       ///< itself in each step; 0 or more
  bool flips = true;   ///< edges may be flipped; else triangles keep their corners
};

/// The smallest corner of a triangle, deg; 0 where it has no area.
double min_corner(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c);

/// The same of each triangle, [F].
Eigen::VectorXd min_corners(const Points& vertices, const Triangles& faces);
Eigen::VectorXd min_corners(const Points2& vertices, const Triangles& faces);

/// The same surface with corners of `least` and more wherever that can be: a needle or a flat
/// triangle is no cloth, and a simulation refuses it.
///
/// Around triangles with a smaller corner, in rounds: edges are flipped where that widens the
/// smallest corner of the two triangles and the two diagonals are within `off` of each other; then
/// vertices slide along the surface, those of rims along their rim, to where the smallest corner
/// around them is widest (of places in eight directions, at halved steps; Freitag and
/// Ollivier-Gooch, "Tetrahedral mesh improvement using swapping and smoothing", 1997, for
/// triangles). Neither is done where it would turn a triangle by more than 60 degrees. No step
/// makes the smallest corner of what it changes smaller, and a surface without slivers is returned
/// as it is. Vertices keep their numbers and the surface its pieces and loops; texture coordinates
/// are dropped where an edge was flipped, normals where anything moved.
///
/// Throws LogicError for options that are out of their range. Edges of three triangles and more
/// stay as they are. About O(F), and a nearest point for each place that is tried.
Mesh remove_slivers(const Mesh& mesh, const RemoveSliversOptions& options = {});

}  // namespace atelier
