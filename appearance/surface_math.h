#pragma once

#include <cmath>

#include "core/vec.h"

namespace atelier {

/// Contributions of a face's corners to the normals and tangents of its points: the arithmetic of
/// surface_frame, for kernels too.

/// The unit normal of face abc times its angle at a, 0 where it has no area: what vertex normals
/// are sums of (core/normals.h). The normal is the same bits from each corner if `a` is its first
/// vertex, so the corner is said apart: `u` and `v` go from it to the next two.
ATELIER_HOST_DEVICE inline Vec3d angle_weighted_normal(Vec3d a, Vec3d b, Vec3d c, Vec3d u,
                                                       Vec3d v) {
  Vec3d normal = cross(b - a, c - a);
  const auto size = [](double x) { return x < 0 ? -x : x; };
  double largest = size(normal.x);
  largest = size(normal.y) > largest ? size(normal.y) : largest;
  largest = size(normal.z) > largest ? size(normal.z) : largest;
  if (!(largest > 0)) {
    return {0, 0, 0};
  }
  // Scaled first: the squares of a very small face's vector would underflow.
  normal = 1 / largest * normal;
  return std::atan2(norm(cross(u, v)), dot(u, v)) / norm(normal) * normal;
}

/// Twice the area of a face along the world's direction of growing u, 0 where its texture has no
/// area. Corners are at `p`, their texture coordinates [3] pairs.
ATELIER_HOST_DEVICE inline Vec3d area_along_u(Vec3d p0, Vec3d p1, Vec3d p2, const double* t0,
                                              const double* t1, const double* t2) {
  const Vec3d along = p1 - p0;
  const Vec3d across = p2 - p0;
  const double u1 = t1[0] - t0[0];
  const double v1 = t1[1] - t0[1];
  const double u2 = t2[0] - t0[0];
  const double v2 = t2[1] - t0[1];
  const double turn = u1 * v2 - v1 * u2;
  const double sign = turn < 0 ? -1.0 : 1.0;
  const Vec3d direction = sign * (v2 * along - v1 * across);  // dP/du times the flat area
  const double length = norm(direction);
  return length > 0 ? norm(cross(along, across)) / length * direction : Vec3d{0, 0, 0};
}

}  // namespace atelier
