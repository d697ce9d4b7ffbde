#pragma once

#include <vector>

#include "simulation/xpbd/edge_math.h"

namespace atelier {

/// One sweep in which every constraint starts from the same positions (Jacobi), for comparison with
/// Gauss-Seidel. Each constraint takes a share of its own step, 1 / (most constraints at one of its
/// particles), so that all together do not overshoot; positions and multipliers take the same
/// share, so they converge to the same solution. Chebyshev acceleration: Wang 2015, "A Chebyshev
/// semi-iterative approach for accelerating projective and position-based dynamics", equation 10.
/// The relaxation by shares is our choice.
template <class T>
struct JacobiEdge {
  int particle[4];  ///< ends, then corners; the corners of an edge without hinge are its ends
  T share;
};
template <class T>
struct JacobiTriangle {
  int particle[3];
  T share;
};

/// Constraints by particle: which pushes each particle gathers. Pushes of edge e are at 4 e to
/// 4 e + 3, those of triangle t at 4 edges + 3 t.
template <class T>
struct JacobiPlan {
  std::vector<JacobiEdge<T>> edges;
  std::vector<JacobiTriangle<T>> triangles;
  std::vector<int> begin;  ///< [V + 1] into `push`
  std::vector<int> push;
};
template <class T>
JacobiPlan<T> prepare_jacobi(const PreparedCloth<T>& cloth);

extern template JacobiPlan<float> prepare_jacobi(const PreparedCloth<float>&);
extern template JacobiPlan<double> prepare_jacobi(const PreparedCloth<double>&);

/// Weight of the Chebyshev step of iteration `k` (0 upwards) after that of the one before, for an
/// estimate of the spectral radius of the plain iteration.
template <class T>
ATELIER_HOST_DEVICE inline T chebyshev_weight(int k, T before, T radius) {
  return k == 0   ? T(1)
         : k == 1 ? T(2) / (T(2) - radius * radius)
                  : T(4) / (T(4) - radius * radius * before);
}

/// Where every constraint of a sweep starts from.
template <class T>
struct JacobiStart {
  const Vec4<T>* x;
  const Vec4<T>* start;  ///< of the substep
  SubstepScale<T> scale;
};

/// The pushes that an edge gives its particles, and the change of its multipliers.
template <class T>
ATELIER_HOST_DEVICE inline EdgeMultipliers<T> jacobi_edge(const JacobiEdge<T>& edge,
                                                          const EdgeRule<T>& rule,
                                                          const JacobiStart<T>& from,
                                                          const EdgeMultipliers<T>& lambda,
                                                          Vec4<T>* push) {
  const SubstepScale<T>& scale = from.scale;
  const Vec4<T> v0 = from.x[edge.particle[0]];
  const Vec4<T> v1 = from.x[edge.particle[1]];
  const Vec3<T> s0 = xyz(from.start[edge.particle[0]]);
  const Vec3<T> s1 = xyz(from.start[edge.particle[1]]);
  EdgeMultipliers<T> change{T(0), T(0)};
  Vec3<T> push0{}, push1{}, push2{}, push3{};
  if (rule.hinge_compliance >= T(0)) {
    Vec4<T> v[4] = {v0, v1, from.x[edge.particle[2]], from.x[edge.particle[3]]};
    const Vec3<T> s[4] = {s0, s1, xyz(from.start[edge.particle[2]]),
                          xyz(from.start[edge.particle[3]])};
    const Vec3<T> c0 = xyz(v[2]);
    const Vec3<T> d0 = xyz(v[3]);
    change.hinge = project_hinge(
        v, rule.rest_angle,
        Softness<T>{rule.hinge_compliance * scale.hinge, lambda.hinge, scale.gamma}, s);
    push0 = xyz(v[0]) - xyz(v0);
    push1 = xyz(v[1]) - xyz(v1);
    push2 = xyz(v[2]) - c0;
    push3 = xyz(v[3]) - d0;
  }
  if (rule.spring_compliance >= T(0)) {
    Vec4<T> a = v0;
    Vec4<T> b = v1;
    change.spring = project_spring(
        a, b, rule.rest_length,
        Softness<T>{rule.spring_compliance * scale.spring, lambda.spring, scale.gamma}, s0, s1);
    push0 += xyz(a) - xyz(v0);
    push1 += xyz(b) - xyz(v1);
  }
  push[0] = with_w(edge.share * push0, T(0));
  push[1] = with_w(edge.share * push1, T(0));
  push[2] = with_w(edge.share * push2, T(0));
  push[3] = with_w(edge.share * push3, T(0));
  return {edge.share * change.hinge, edge.share * change.spring};
}

/// Likewise of a strain triangle; `change` gets three.
template <class T>
ATELIER_HOST_DEVICE inline void jacobi_triangle(const JacobiTriangle<T>& triangle,
                                                const StrainRest<T>& rest,
                                                const JacobiStart<T>& from, const T* lambda,
                                                T* change, Vec4<T>* push) {
  Vec4<T> v[3];
  Vec3<T> s[3];
  T after[3];
  for (int c = 0; c < 3; ++c) {
    v[c] = from.x[triangle.particle[c]];
    s[c] = xyz(from.start[triangle.particle[c]]);
    after[c] = lambda[c];
  }
  project_strain(v, s, rest, from.scale.spring, from.scale.gamma, after);
  for (int c = 0; c < 3; ++c) {
    change[c] = triangle.share * (after[c] - lambda[c]);
    push[c] = with_w(triangle.share * (xyz(v[c]) - xyz(from.x[triangle.particle[c]])), T(0));
  }
}

/// A multiplier of the next iteration from that of this and the one before.
template <class T>
ATELIER_HOST_DEVICE inline T accelerated(T now, T change, T before, T weight) {
  return before + weight * (now + change - before);
}

/// Position of a particle after an iteration: the sum of what pushes it, in the order of `push`.
template <class T>
ATELIER_HOST_DEVICE inline Vec4<T> jacobi_particle(const Vec4<T>& x, const Vec4<T>& before,
                                                   const Vec4<T>* pushes, const int* push,
                                                   int count, T weight) {
  Vec3<T> plain = xyz(x);
  for (int k = 0; k < count; ++k) {
    plain += xyz(pushes[push[k]]);
  }
  return with_w(xyz(before) + weight * (plain - xyz(before)), x.w);
}

}  // namespace atelier
