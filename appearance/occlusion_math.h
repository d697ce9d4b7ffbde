#pragma once

#include <cmath>
#include <cstdint>

#include "appearance/transfer_terms.h"
#include "core/random.h"
#include "core/tree_math.h"

namespace atelier {

/// How rays of the light transfer are laid; as OcclusionOptions.
struct AmbientRays {
  int strata;
  double reach;
  double offset;
};

/// Spherical harmonics of rays that meet nothing, summed in steps of 2^-20: whole numbers, so that
/// their order does not matter.
struct OpenRays {
  std::int64_t terms[kTransferTerms];
};
constexpr double kTransferSteps = 1048576;

/// Real spherical harmonics of degree 0 to 2 of a unit direction, in the usual order (m from -l to
/// l), each over that of degree 0, so that the first is 1.
ATELIER_HOST_DEVICE inline void spherical_harmonics(Vec3d d, double* terms) {
  constexpr double kRoot3 = 1.7320508075688772;
  constexpr double kRoot5 = 2.23606797749979;
  constexpr double kRoot15 = 3.872983346207417;
  terms[0] = 1;
  terms[1] = kRoot3 * d.y;
  terms[2] = kRoot3 * d.z;
  terms[3] = kRoot3 * d.x;
  terms[4] = kRoot15 * d.x * d.y;
  terms[5] = kRoot15 * d.y * d.z;
  terms[6] = kRoot5 / 2 * (3 * d.z * d.z - 1);
  terms[7] = kRoot15 * d.x * d.z;
  terms[8] = kRoot15 / 2 * (d.x * d.x - d.y * d.y);
}

/// The share of a sum of `rays` rays.
ATELIER_HOST_DEVICE inline float transfer_of(std::int64_t sum, int rays) {
  return static_cast<float>(static_cast<double>(sum) / kTransferSteps) / static_cast<float>(rays);
}

/// Rays of a row of strata that meet nothing of the tree: cells (0..strata-1, row) of the square
/// that is mapped to the cosine-weighted disk over `normal` (unit).
ATELIER_HOST_DEVICE inline OpenRays open_rays(const TreeView<double>& tree, Vec3d position,
                                              Vec3d normal, std::uint64_t vertex, int row,
                                              const AmbientRays& rays) {
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
  OpenRays open = {};
  for (int column = 0; column < rays.strata; ++column) {
    const RandomWords words = random_words(kSeed, vertex, row * rays.strata + column);
    const double share = (column + words.word[0] * kUnit) / rays.strata;
    const double angle = kTurn * (row + words.word[1] * kUnit) / rays.strata;
    const double radius = sqrt(share);
    const Vec3d direction =
        radius * cos(angle) * tangent + radius * sin(angle) * across + sqrt(1 - share) * normal;
    if (hit_in_tree(tree, origin, direction, 0.0, rays.reach, true).face < 0) {
      double terms[kTransferTerms];
      spherical_harmonics(direction, terms);
      for (int i = 0; i < kTransferTerms; ++i) {
        open.terms[i] += llround(terms[i] * kTransferSteps);
      }
    }
  }
  return open;
}

}  // namespace atelier
