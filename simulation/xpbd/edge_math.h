#pragma once

#include "simulation/xpbd/prepared_cloth.h"

namespace atelier {

/// Numbers of one substep that every constraint needs.
template <class T>
struct SubstepScale {
  T spring;  ///< times a spring's or strain's compliance: softness of the scene's material / h^2
  T hinge;   ///< times a hinge's compliance
  T gamma;   ///< damping time / h
};

/// `softness` multiplies compliances: a scene's own material, 1 as built.
template <class T>
ATELIER_HOST_DEVICE inline SubstepScale<T> substep_scale(T h, T damping, T spring_softness,
                                                         T hinge_softness) {
  const T inverse_h2 = T(1) / (h * h);
  return {spring_softness * inverse_h2, hinge_softness * inverse_h2, damping / h};
}

/// Projects what acts along one edge: its hinge, then its spring, with their particles fetched
/// once. `x` and `start` are the patch's particles now and at the start of the substep.
template <class T>
ATELIER_HOST_DEVICE inline void project_edge(const Places& places, const EdgeRule<T>& rule,
                                             Vec4<T>* x, const Vec4<T>* start,
                                             EdgeMultipliers<T>& lambda,
                                             const SubstepScale<T>& scale) {
  const int p0 = places.at[0];
  const int p1 = places.at[1];
  Vec4<T> v[4];
  Vec3<T> s[4]{};
  v[0] = x[p0];
  v[1] = x[p1];
  if (scale.gamma > T(0)) {
    s[0] = xyz(start[p0]);
    s[1] = xyz(start[p1]);
  }
  if (rule.hinge_compliance >= T(0)) {
    const int p2 = places.at[2];
    const int p3 = places.at[3];
    v[2] = x[p2];
    v[3] = x[p3];
    if (scale.gamma > T(0)) {
      s[2] = xyz(start[p2]);
      s[3] = xyz(start[p3]);
    }
    lambda.hinge += project_hinge(
        v, rule.rest_angle,
        Softness<T>{rule.hinge_compliance * scale.hinge, lambda.hinge, scale.gamma}, s);
    x[p2] = v[2];
    x[p3] = v[3];
  }
  // Without a spring its ends count as fixed: no branch.
  const bool springs = rule.spring_compliance >= T(0);
  Vec4<T> end0 = with_w(xyz(v[0]), springs ? v[0].w : T(0));
  Vec4<T> end1 = with_w(xyz(v[1]), springs ? v[1].w : T(0));
  lambda.spring += project_spring(
      end0, end1, rule.rest_length,
      Softness<T>{rule.spring_compliance * scale.spring, lambda.spring, scale.gamma}, s[0], s[1]);
  x[p0] = with_w(xyz(end0), v[0].w);
  x[p1] = with_w(xyz(end1), v[1].w);
}

/// Projects one strain triangle; `lambda` holds three.
template <class T>
ATELIER_HOST_DEVICE inline void project_triangle(const Places& places, const StrainRest<T>& rest,
                                                 Vec4<T>* x, const Vec4<T>* start, T* lambda,
                                                 const SubstepScale<T>& scale) {
  Vec4<T> v[3];
  Vec3<T> s[3]{};
  for (int c = 0; c < 3; ++c) {
    v[c] = x[places.at[c]];
  }
  if (scale.gamma > T(0)) {
    for (int c = 0; c < 3; ++c) {
      s[c] = xyz(start[places.at[c]]);
    }
  }
  project_strain(v, s, rest, scale.spring, scale.gamma, lambda);
  for (int c = 0; c < 3; ++c) {
    x[places.at[c]] = v[c];
  }
}

}  // namespace atelier
