#pragma once

#include "core/tree_math.h"

namespace atelier {

/// Far-field approximation of a cluster of oriented surface: the moments of its area-weighted
/// normals about its centre, symmetric parts only, because the kernel's derivatives are symmetric.
/// Order 2 of Barill et al., "Fast winding numbers for soups and clouds", SIGGRAPH 2018.
template <class T>
struct WindingMoments {
  Vec3<T> center;  ///< area-weighted, metres
  T radius;        ///< no part of the cluster is farther from the centre
  T area;          ///< square metres
  Vec3<T> normal;  ///< integral of n
  T first[6];      ///< of x n: xx xy xz yy yz zz
  T second[10];    ///< of x x n: xxx xxy xxz xyy xyz xzz yyy yyz yzz zzz
};

inline constexpr double kInverseFourPi = 0.079577471545947667884;

/// Adds the moments of one part, given about its own centre, to a cluster whose centre is set.
template <class T>
ATELIER_HOST_DEVICE inline void add_moments(WindingMoments<T>& sum, const WindingMoments<T>& part) {
  const Vec3<T> shift = part.center - sum.center;
  const T d[3] = {shift.x, shift.y, shift.z};
  const T n[3] = {part.normal.x, part.normal.y, part.normal.z};
  const T* s = part.first;
  const T first[3][3] = {{s[0], s[1], s[2]}, {s[1], s[3], s[4]}, {s[2], s[4], s[5]}};
  sum.area += part.area;
  sum.normal += part.normal;
  int at1 = 0;
  int at2 = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) {
      sum.first[at1] += s[at1] + (d[i] * n[j] + d[j] * n[i]) / 2;
      ++at1;
      for (int k = j; k < 3; ++k) {
        sum.second[at2] +=
            part.second[at2] + (2 * (d[i] * first[j][k] + d[j] * first[i][k] + d[k] * first[i][j]) +
                                d[i] * d[j] * n[k] + d[i] * n[j] * d[k] + n[i] * d[j] * d[k]) /
                                   3;
        ++at2;
      }
    }
  }
}

/// Moments of a triangle about its centroid, exact.
template <class T>
ATELIER_HOST_DEVICE inline WindingMoments<T> triangle_moments(Vec3<T> a, Vec3<T> b, Vec3<T> c) {
  WindingMoments<T> moments{};
  moments.center = T(1) / 3 * (a + b + c);
  moments.normal = T(0.5) * cross(b - a, c - a);
  moments.area = norm(moments.normal);
  const Vec3<T> corners[3] = {a - moments.center, b - moments.center, c - moments.center};
  // The integral of x x over a triangle about its centroid is area / 12 times the sum over corners.
  T xx[3][3] = {};
  for (const Vec3<T>& corner : corners) {
    const T p[3] = {corner.x, corner.y, corner.z};
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        xx[i][j] += p[i] * p[j] / 12;
      }
    }
  }
  const T n[3] = {moments.normal.x, moments.normal.y, moments.normal.z};
  int at = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) {
      for (int k = j; k < 3; ++k) {
        moments.second[at++] = (xx[i][j] * n[k] + xx[i][k] * n[j] + xx[j][k] * n[i]) / 3;
      }
    }
  }
  return moments;
}

/// 4 pi times the winding number of a far cluster: the kernel r / |r|^3 and its first two
/// derivatives against the moments.
template <class T>
ATELIER_HOST_DEVICE inline T far_solid_angle(const WindingMoments<T>& m, Vec3<T> query) {
  const Vec3<T> r = m.center - query;
  const T inverse2 = 1 / squared_norm(r);
  const T inverse3 = inverse2 * std::sqrt(inverse2);
  const T* s = m.first;
  const T* t = m.second;
  const T linear = dot(m.normal, r) + s[0] + s[3] + s[5];
  const T quadratic = s[0] * r.x * r.x + s[3] * r.y * r.y + s[5] * r.z * r.z +
                      2 * (s[1] * r.x * r.y + s[2] * r.x * r.z + s[4] * r.y * r.z);
  const T contraction =
      (t[0] + t[3] + t[5]) * r.x + (t[1] + t[6] + t[8]) * r.y + (t[2] + t[7] + t[9]) * r.z;
  const T cubic = r.x * r.x * (t[0] * r.x + 3 * (t[1] * r.y + t[2] * r.z)) +
                  r.y * r.y * (t[6] * r.y + 3 * (t[3] * r.x + t[7] * r.z)) +
                  r.z * r.z * (t[9] * r.z + 3 * (t[5] * r.x + t[8] * r.y)) +
                  6 * t[4] * r.x * r.y * r.z;
  return inverse3 *
         (linear + inverse2 * (-3 * quadratic - T(4.5) * contraction + T(7.5) * inverse2 * cubic));
}

/// Signed solid angle of a triangle (van Oosterom and Strackee, "The solid angle of a plane
/// triangle", IEEE TBME 1983): positive seen from behind. 0 seen from a corner.
template <class T>
ATELIER_HOST_DEVICE inline T solid_angle(Vec3<T> query, Vec3<T> a_, Vec3<T> b_, Vec3<T> c_) {
  const Vec3<T> a = a_ - query;
  const Vec3<T> b = b_ - query;
  const Vec3<T> c = c_ - query;
  const T na = norm(a);
  const T nb = norm(b);
  const T nc = norm(c);
  const T numerator = dot(a, cross(b, c));
  const T denominator = na * nb * nc + dot(a, b) * nc + dot(b, c) * na + dot(c, a) * nb;
  return 2 * std::atan2(numerator, denominator);
}

/// 4 pi times the winding number of one oriented point; 0 at the point itself.
template <class T>
ATELIER_HOST_DEVICE inline T dipole_angle(Vec3<T> query, Vec3<T> point, Vec3<T> area_normal) {
  const Vec3<T> r = point - query;
  const T d2 = squared_norm(r);
  return d2 > 0 ? dot(area_normal, r) / (d2 * std::sqrt(d2)) : T(0);
}

/// A tree with its moments as kernels see it.
template <class T>
struct WindingView {
  TreeView<T> tree;
  const WindingMoments<T>* moments;  // of each node
  const Vec3<T>* area_normals;       // of each point; null: triangles
};

/// Winding number of everything around a query. Clusters farther than `accuracy` times their radius
/// are taken as a whole.
template <class T>
ATELIER_HOST_DEVICE inline T winding_in_tree(const WindingView<T>& view, Vec3<T> query,
                                             T accuracy) {
  if (view.tree.node_count == 0) {
    return 0;
  }
  T sum = 0;
  int stack[kTreeDepth];
  int top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const int i = stack[--top];
    const WindingMoments<T>& moments = view.moments[i];
    const T reach = accuracy * moments.radius;
    if (squared_norm(moments.center - query) > reach * reach) {
      sum += far_solid_angle(moments, query);
      continue;
    }
    const TreeNode<T>& node = view.tree.nodes[i];
    if (node.count == 0) {
      stack[top++] = node.first + 1;
      stack[top++] = node.first;
      continue;
    }
    for (int slot = node.first; slot < node.first + node.count; ++slot) {
      const TreeFace& face = view.tree.faces[slot];
      const Vec3<T>* v = view.tree.vertices;
      sum += view.area_normals == nullptr
                 ? solid_angle(query, v[face.vertex[0]], v[face.vertex[1]], v[face.vertex[2]])
                 : dipole_angle(query, v[face.face], view.area_normals[face.face]);
    }
  }
  return T(kInverseFourPi) * sum;
}

}  // namespace atelier
