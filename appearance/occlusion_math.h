#pragma once

#include <cmath>

#include "core/random.h"
#include "core/tree_math.h"

namespace atelier {

/// How rays of ambient visibility are laid; as OcclusionOptions.
struct AmbientRays {
  int strata;
  double reach;
  double offset;
};

/// How many rays of a row of strata meet nothing of the tree, 0 to `strata`: cells (0..strata-1,
/// row) of the square that is mapped to the cosine-weighted disc over `normal` (unit).
ATELIER_HOST_DEVICE inline int open_rays(const TreeView<double>& tree, Vec3d position, Vec3d normal,
                                         std::uint64_t vertex, int row, const AmbientRays& rays) {
  constexpr std::uint64_t kSeed = 0x0cc1;
  constexpr double kUnit = 1.0 / 4294967296.0;
  constexpr double kTurn = 6.283185307179586;
  // Duff et al., "Building an orthonormal basis, revisited" (JCGT 2017).
  const double sign = normal.z < 0 ? -1.0 : 1.0;
  const double a = -1.0 / (sign + normal.z);
  const double b = normal.x * normal.y * a;
  const Vec3d tangent = {1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x};
  const Vec3d across = {b, sign + normal.y * normal.y * a, -normal.y};
  const Vec3d origin = position + rays.offset * normal;
  int open = 0;
  for (int column = 0; column < rays.strata; ++column) {
    const RandomWords words = random_words(kSeed, vertex, row * rays.strata + column);
    const double share = (column + words.word[0] * kUnit) / rays.strata;
    const double angle = kTurn * (row + words.word[1] * kUnit) / rays.strata;
    const double radius = sqrt(share);
    const Vec3d direction =
        radius * cos(angle) * tangent + radius * sin(angle) * across + sqrt(1 - share) * normal;
    open += hit_in_tree(tree, origin, direction, 0.0, rays.reach, true).face < 0 ? 1 : 0;
  }
  return open;
}

}  // namespace atelier
