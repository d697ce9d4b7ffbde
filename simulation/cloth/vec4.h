#pragma once

#include "core/vec.h"

namespace atelier {

/// Position and inverse mass of a particle in one aligned load. An inverse mass of 0 does not move.
template <class T>
struct alignas(4 * sizeof(T)) Vec4 {
  T x, y, z, w;
};

template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> xyz(const Vec4<T>& a) {
  return {a.x, a.y, a.z};
}
template <class T>
ATELIER_HOST_DEVICE inline Vec4<T> with_w(Vec3<T> a, T w) {
  return {a.x, a.y, a.z, w};
}

}  // namespace atelier
