#pragma once

#include <limits>

#include "core/vec.h"

namespace atelier {

/// Queries of points and rays on one triangle: arithmetic for both devices, T float or double.
/// Vertices come with their numbers, because whatever concerns an edge is computed from its smaller
/// vertex to its larger: both faces at the edge then get the same bits, so that ties are ties and
/// no ray slips through between them.

/// A triangle's corners and their vertex numbers.
template <class T>
struct Corners {
  Vec3<T> a, b, c;
  int ia, ib, ic;
};

/// The point of a triangle nearest to something.
template <class T>
struct TrianglePoint {
  Vec3<T> point;
  Vec3<T> barycentric;  ///< weights of a, b, c; sums to 1
  T squared_distance;
};

/// Where a ray meets a triangle.
template <class T>
struct TriangleHit {
  bool hit;
  T t;                  ///< along the ray, in lengths of its direction
  Vec3<T> barycentric;  ///< weights of a, b, c
};

/// Distance from 1 to the next number.
template <class T>
inline constexpr T kEpsilon = std::numeric_limits<T>::epsilon();

template <class T>
ATELIER_HOST_DEVICE inline T larger(T a, T b) {
  return a > b ? a : b;
}
template <class T>
ATELIER_HOST_DEVICE inline T smaller(T a, T b) {
  return a < b ? a : b;
}
template <class T>
ATELIER_HOST_DEVICE inline T magnitude(T a) {
  return a < 0 ? -a : a;
}
template <class T>
ATELIER_HOST_DEVICE inline T largest_magnitude(Vec3<T> v) {
  return larger(magnitude(v.x), larger(magnitude(v.y), magnitude(v.z)));
}

/// Parameter in [0,1] of the point of segment ab nearest to p; 0 where a and b coincide.
template <class T>
ATELIER_HOST_DEVICE inline T nearest_on_segment(Vec3<T> p, Vec3<T> a, Vec3<T> b) {
  const Vec3<T> ab = b - a;
  const T t = dot(p - a, ab) / dot(ab, ab);
  return t > 0 ? (t < 1 ? t : T(1)) : T(0);  // 0/0 is not above 0
}

/// Nearest point of the edge ab; weight[0] of a, weight[1] of b.
template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> nearest_on_edge(Vec3<T> p, Vec3<T> a, int ia, Vec3<T> b, int ib,
                                                   T weight[2]) {
  const bool in_order = ia < ib;
  const Vec3<T> from = in_order ? a : b;
  const Vec3<T> to = in_order ? b : a;
  const T t = nearest_on_segment(p, from, to);
  weight[0] = in_order ? 1 - t : t;
  weight[1] = in_order ? t : 1 - t;
  return t < 1 ? from + t * (to - from) : to;
}

/// Point of a triangle nearest to p: Voronoi regions (Ericson, "Real-Time Collision Detection",
/// 2005, section 5.1.5); a triangle whose corners lie on a line is its three edges.
template <class T>
ATELIER_HOST_DEVICE inline TrianglePoint<T> nearest_on_triangle(Vec3<T> p, const Corners<T>& t) {
  T weight[2];
  const auto vertex = [&](Vec3<T> point, Vec3<T> barycentric) {
    return TrianglePoint<T>{point, barycentric, squared_norm(p - point)};
  };
  const auto edge_ab = [&] {
    const Vec3<T> point = nearest_on_edge(p, t.a, t.ia, t.b, t.ib, weight);
    return TrianglePoint<T>{point, {weight[0], weight[1], 0}, squared_norm(p - point)};
  };
  const auto edge_bc = [&] {
    const Vec3<T> point = nearest_on_edge(p, t.b, t.ib, t.c, t.ic, weight);
    return TrianglePoint<T>{point, {0, weight[0], weight[1]}, squared_norm(p - point)};
  };
  const auto edge_ca = [&] {
    const Vec3<T> point = nearest_on_edge(p, t.c, t.ic, t.a, t.ia, weight);
    return TrianglePoint<T>{point, {weight[1], 0, weight[0]}, squared_norm(p - point)};
  };

  const Vec3<T> ab = t.b - t.a;
  const Vec3<T> ac = t.c - t.a;
  const T flat = 16 * kEpsilon<T>;
  if (!(squared_norm(cross(ab, ac)) > flat * flat * squared_norm(ab) * squared_norm(ac))) {
    TrianglePoint<T> nearest = edge_ab();
    const TrianglePoint<T> bc = edge_bc();
    const TrianglePoint<T> ca = edge_ca();
    nearest = bc.squared_distance < nearest.squared_distance ? bc : nearest;
    return ca.squared_distance < nearest.squared_distance ? ca : nearest;
  }

  const Vec3<T> ap = p - t.a;
  const T d1 = dot(ab, ap);
  const T d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) {
    return vertex(t.a, {1, 0, 0});
  }
  const Vec3<T> bp = p - t.b;
  const T d3 = dot(ab, bp);
  const T d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) {
    return vertex(t.b, {0, 1, 0});
  }
  const T vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    return edge_ab();
  }
  const Vec3<T> cp = p - t.c;
  const T d5 = dot(ab, cp);
  const T d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) {
    return vertex(t.c, {0, 0, 1});
  }
  const T vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    return edge_ca();
  }
  const T va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6) {
    return edge_bc();
  }
  const T scale = 1 / (va + vb + vc);
  const T v = vb * scale;
  const T w = vc * scale;
  const Vec3<T> point = t.a + v * ab + w * ac;
  return {point, {1 - v - w, v, w}, squared_norm(p - point)};
}

/// A ray prepared for many triangles: sheared so that it runs along +z.
template <class T>
struct PreparedRay {
  Vec3<T> origin;
  Vec3<T> direction;
  int kx, ky, kz;  // axes; kz is the direction's largest
  T sx, sy, sz;
};

template <class T>
ATELIER_HOST_DEVICE inline T component(Vec3<T> v, int k) {
  return k == 0 ? v.x : (k == 1 ? v.y : v.z);
}

template <class T>
ATELIER_HOST_DEVICE inline PreparedRay<T> prepare_ray(Vec3<T> origin, Vec3<T> direction) {
  const T x = magnitude(direction.x);
  const T y = magnitude(direction.y);
  const T z = magnitude(direction.z);
  PreparedRay<T> ray{origin, direction, 0, 0, 0, 0, 0, 0};
  ray.kz = x > y ? (x > z ? 0 : 2) : (y > z ? 1 : 2);
  ray.kx = (ray.kz + 1) % 3;
  ray.ky = (ray.kx + 1) % 3;
  if (component(direction, ray.kz) < 0) {
    const int swap = ray.kx;
    ray.kx = ray.ky;
    ray.ky = swap;
  }
  ray.sz = 1 / component(direction, ray.kz);
  ray.sx = component(direction, ray.kx) * ray.sz;
  ray.sy = component(direction, ray.ky) * ray.sz;
  return ray;
}

/// Edge function of a sheared edge from p to q, the same bits but for the sign in both directions.
template <class T>
ATELIER_HOST_DEVICE inline T edge_function(T px, T py, int ip, T qx, T qy, int iq) {
  return ip < iq ? qx * py - qy * px : -(px * qy - py * qx);
}

/// Where the line of the ray meets a triangle, from either side; edges and corners belong to it.
/// Watertight (Woop, Benthin, Wald, "Watertight ray/triangle intersection", JCGT 2013), with the
/// edge functions in one order per edge in place of the paper's fallback. A triangle seen from its
/// edge is not hit.
template <class T>
ATELIER_HOST_DEVICE inline TriangleHit<T> intersect(const PreparedRay<T>& ray,
                                                    const Corners<T>& t) {
  const Vec3<T> a = t.a - ray.origin;
  const Vec3<T> b = t.b - ray.origin;
  const Vec3<T> c = t.c - ray.origin;
  const T az = component(a, ray.kz);
  const T bz = component(b, ray.kz);
  const T cz = component(c, ray.kz);
  const T ax = component(a, ray.kx) - ray.sx * az;
  const T ay = component(a, ray.ky) - ray.sy * az;
  const T bx = component(b, ray.kx) - ray.sx * bz;
  const T by = component(b, ray.ky) - ray.sy * bz;
  const T cx = component(c, ray.kx) - ray.sx * cz;
  const T cy = component(c, ray.ky) - ray.sy * cz;
  const T u = edge_function(bx, by, t.ib, cx, cy, t.ic);
  const T v = edge_function(cx, cy, t.ic, ax, ay, t.ia);
  const T w = edge_function(ax, ay, t.ia, bx, by, t.ib);
  const T determinant = u + v + w;
  const bool outside = (u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0);
  if (outside || determinant == 0) {
    return {false, 0, {0, 0, 0}};
  }
  const Vec3<T> barycentric = {u / determinant, v / determinant, w / determinant};
  const T depth = barycentric.x * az + barycentric.y * bz + barycentric.z * cz;
  return {true, depth * ray.sz, barycentric};
}

}  // namespace atelier
