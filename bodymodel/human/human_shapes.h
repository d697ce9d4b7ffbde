#pragma once

#include <algorithm>
#include <cmath>

#include "bodymodel/human/human_anatomy.h"

namespace atelier {

/// Signed distances of the simple shapes that head, hands and feet are made of, negative inside,
/// and how they are joined. Arithmetic only; lengths in metres.

/// Quadratic smooth minimum: rounds the crease where two fields meet over a width k (Quilez).
inline double smooth_min(double a, double b, double k) {
  const double h = std::max(k - std::abs(a - b), 0.0) / k;
  return std::min(a, b) - h * h * k / 4;
}

inline double smooth_max(double a, double b, double k) {
  return -smooth_min(-a, -b, k);
}

inline double cone_distance(const HumanCone& c, Vec3d p) {
  const Vec3d d = c.b - c.a;
  const double t = std::clamp(dot(p - c.a, d) / squared_norm(d), 0.0, 1.0);
  return norm(p - c.a - t * d) - (c.ra + t * (c.rb - c.ra));
}

/// First-order distance: exact at zero and along the axes.
inline double ellipsoid_distance(Vec3d p, Vec3d centre, Vec3d radii) {
  const Vec3d q = {(p.x - centre.x) / radii.x, (p.y - centre.y) / radii.y,
                   (p.z - centre.z) / radii.z};
  const Vec3d g = {q.x / radii.x, q.y / radii.y, q.z / radii.z};
  const double n = norm(q);
  return n < 1e-9 ? -std::min({radii.x, radii.y, radii.z}) : n * (n - 1) / norm(g);
}

}  // namespace atelier
