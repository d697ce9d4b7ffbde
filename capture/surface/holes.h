#pragma once

#include <vector>

#include "core/mesh.h"
#include "core/types.h"

namespace atelier {

/// A boundary loop of a surface: a hole that nothing supported, or a rim.
struct Hole {
  std::vector<int> loop;  ///< vertices, in the order of their faces' edges
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< m, of the loop's length
  double length = 0;                                 ///< m, of the loop
  double area = 0;  ///< m2, of triangles from the loop to its centre
};

/// The hole map of a surface: its boundary loops, the largest first. O(F).
std::vector<Hole> find_holes(const Mesh& mesh);

}  // namespace atelier
