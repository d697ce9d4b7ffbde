#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/tree.h"
#include "core/winding_number.h"

namespace atelier::fixtures {

/// What the guard on contact with the body finds.
struct Guard {
  double deepest = 0;  ///< m, of a vertex inside the body, outside zones where it overlaps itself
  int excused = 0;     ///< vertices inside in such zones
};

/// Depth of cloth in a body by its winding number, which the solver does not use. Zones where the
/// body overlaps itself (winding number above 1.5) are left out, grown by `thickness`.
inline Guard contact_guard(const Points& cloth, const Points& body, const Triangles& faces,
                           double thickness) {
  Guard out;
  const WindingTree winding = build_winding_tree(body, faces);
  const std::vector<double> inside = winding_numbers(winding, cloth);
  for (Index v = 0; v < cloth.rows(); ++v) {
    if (inside[v] < 0.5) {
      continue;
    }
    const Eigen::Vector3d p = cloth.row(v).transpose();
    bool overlapped = inside[v] > 1.5;
    for (int k = 0; k < 26 && !overlapped; ++k) {
      const int code = k < 13 ? k : k + 1;
      const Eigen::Vector3d d(code % 3 - 1, code / 3 % 3 - 1, code / 9 - 1);
      // A little further: the way to the zone lies up to 27 degrees off these directions.
      overlapped = winding_number(winding, p + 1.15 * thickness * d.normalized()) > 1.5;
    }
    if (overlapped) {
      ++out.excused;
      continue;
    }
    out.deepest = std::max(out.deepest, std::sqrt(closest_point(winding.tree, p).squared_distance));
  }
  return out;
}

}  // namespace atelier::fixtures
