#pragma once

#include <cmath>

#include "core/host_device.h"

namespace atelier {

/// Three numbers for `*_math.h`: what Eigen is elsewhere, but small enough for every kernel and
/// with one order of operations on both devices, so that twins can agree bit for bit.
template <class T>
struct Vec3 {
  T x, y, z;
};

using Vec3f = Vec3<float>;
using Vec3d = Vec3<double>;

template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> operator+(Vec3<T> a, Vec3<T> b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> operator-(Vec3<T> a, Vec3<T> b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> operator-(Vec3<T> a) {
  return {-a.x, -a.y, -a.z};
}
template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> operator*(T s, Vec3<T> a) {
  return {s * a.x, s * a.y, s * a.z};
}
template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> operator*(Vec3<T> a, T s) {
  return s * a;
}
template <class T>
ATELIER_HOST_DEVICE inline Vec3<T>& operator+=(Vec3<T>& a, Vec3<T> b) {
  a = a + b;
  return a;
}
template <class T>
ATELIER_HOST_DEVICE inline Vec3<T>& operator-=(Vec3<T>& a, Vec3<T> b) {
  a = a - b;
  return a;
}
template <class T>
ATELIER_HOST_DEVICE inline T dot(Vec3<T> a, Vec3<T> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> cross(Vec3<T> a, Vec3<T> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class T>
ATELIER_HOST_DEVICE inline T squared_norm(Vec3<T> a) {
  return dot(a, a);
}
template <class T>
ATELIER_HOST_DEVICE inline T norm(Vec3<T> a) {
  return std::sqrt(dot(a, a));
}

}  // namespace atelier
