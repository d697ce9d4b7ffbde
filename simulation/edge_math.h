#pragma once

#include "simulation/prepared_cloth.h"

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
ATELIER_HOST_DEVICE inline void project_edge(int p0, int p1, int p2, int p3,
                                             const EdgeRule<T>& rule, Vec4<T>* x,
                                             const Vec4<T>* start, EdgeMultipliers<T>& lambda,
                                             const SubstepScale<T>& scale) {
  Vec4<T> v0 = x[p0];
  Vec4<T> v1 = x[p1];
  Vec3<T> s0{}, s1{};
  if (scale.gamma > T(0)) {
    s0 = xyz(start[p0]);
    s1 = xyz(start[p1]);
  }
  if (rule.hinge_compliance >= T(0)) {
    Vec4<T> v2 = x[p2];
    Vec4<T> v3 = x[p3];
    Vec3<T> s2{}, s3{};
    if (scale.gamma > T(0)) {
      s2 = xyz(start[p2]);
      s3 = xyz(start[p3]);
    }
    lambda.hinge +=
        project_hinge(v0, v1, v2, v3, rule.rest_angle, rule.hinge_compliance * scale.hinge,
                      lambda.hinge, scale.gamma, s0, s1, s2, s3);
    x[p2] = v2;
    x[p3] = v3;
  }
  // Without a spring its ends count as fixed: no branch.
  const bool springs = rule.spring_compliance >= T(0);
  Vec4<T> end0 = with_w(xyz(v0), springs ? v0.w : T(0));
  Vec4<T> end1 = with_w(xyz(v1), springs ? v1.w : T(0));
  lambda.spring +=
      project_spring(end0, end1, rule.rest_length, rule.spring_compliance * scale.spring,
                     lambda.spring, scale.gamma, s0, s1);
  v0 = with_w(xyz(end0), v0.w);
  v1 = with_w(xyz(end1), v1.w);
  x[p0] = v0;
  x[p1] = v1;
}

/// Projects one strain triangle; `lambda` holds three.
template <class T>
ATELIER_HOST_DEVICE inline void project_triangle(const Places& places, const StrainRest<T>& rest,
                                                 Vec4<T>* x, const Vec4<T>* start, T* lambda,
                                                 const SubstepScale<T>& scale) {
  Vec4<T> v0 = x[places.at[0]];
  Vec4<T> v1 = x[places.at[1]];
  Vec4<T> v2 = x[places.at[2]];
  Vec3<T> s0{}, s1{}, s2{};
  if (scale.gamma > T(0)) {
    s0 = xyz(start[places.at[0]]);
    s1 = xyz(start[places.at[1]]);
    s2 = xyz(start[places.at[2]]);
  }
  project_strain(v0, v1, v2, rest, scale.spring, scale.gamma, s0, s1, s2, lambda);
  x[places.at[0]] = v0;
  x[places.at[1]] = v1;
  x[places.at[2]] = v2;
}

}  // namespace atelier
