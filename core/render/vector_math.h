#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "core/vec.h"

namespace atelier {

/// The few operations on directions and colours that core/vec.h leaves out.

inline Vec3f vec3f(const Eigen::Vector3d& a) {
  return {static_cast<float>(a.x()), static_cast<float>(a.y()), static_cast<float>(a.z())};
}
inline Vec3f vec3f(const Eigen::Vector3f& a) {
  return {a.x(), a.y(), a.z()};
}

/// Channel by channel.
inline Vec3f product(Vec3f a, Vec3f b) {
  return {a.x * b.x, a.y * b.y, a.z * b.z};
}

inline Vec3f mix(Vec3f a, Vec3f b, float t) {
  return (1 - t) * a + t * b;
}

/// Zero stays zero.
inline Vec3f normalized(Vec3f a) {
  const float length = norm(a);
  return length > 0 ? (1 / length) * a : a;
}

/// Rec. 709 luminance.
inline float luminance(Vec3f a) {
  return 0.2126f * a.x + 0.7152f * a.y + 0.0722f * a.z;
}

/// Two unit vectors that complete the unit normal to a right-handed frame (Duff et al., "Building
/// an orthonormal basis, revisited", JCGT 2017).
struct Frame {
  Vec3f s, t, n;

  explicit Frame(Vec3f normal) : n(normal) {
    const float sign = std::copysign(1.0f, n.z);
    const float a = -1.0f / (sign + n.z);
    const float b = n.x * n.y * a;
    s = {1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x};
    t = {b, sign + n.y * n.y * a, -n.y};
  }
  Vec3f world(Vec3f local) const { return local.x * s + local.y * t + local.z * n; }
};

}  // namespace atelier
