#pragma once

#include "simulation/prepared_cloth.h"

namespace atelier {

/// Numbers of one substep that every constraint needs.
template <class T>
struct SubstepScale {
  T inverse_h2;       ///< 1 / h^2 [1/s2]
  T gamma;            ///< damping time / h
  T spring_softness;  ///< multiplies every spring's compliance (a scene's own material), 1: as
                      ///< built
  T hinge_softness;
};

/// Projects the record at place `i` of kind 0 (hinge) or 1 (spring). `x` and `start` are the
/// patch's particles now and at the start of the substep; `lambda` is the multiplier of the place.
template <class T>
ATELIER_HOST_DEVICE inline T project_hinge_record(const ConstraintRecord<T>& r, Vec4<T>* x,
                                                  const Vec4<T>* start, T lambda,
                                                  const SubstepScale<T>& scale) {
  Vec4<T> v0 = x[r.particle[0]];
  Vec4<T> v1 = x[r.particle[1]];
  Vec4<T> v2 = x[r.particle[2]];
  Vec4<T> v3 = x[r.particle[3]];
  Vec3<T> s0{}, s1{}, s2{}, s3{};
  if (scale.gamma > T(0)) {
    s0 = xyz(start[r.particle[0]]);
    s1 = xyz(start[r.particle[1]]);
    s2 = xyz(start[r.particle[2]]);
    s3 = xyz(start[r.particle[3]]);
  }
  const T compliance = r.compliance * scale.hinge_softness * scale.inverse_h2;
  const T change =
      project_hinge(v0, v1, v2, v3, r.rest, compliance, lambda, scale.gamma, s0, s1, s2, s3);
  x[r.particle[0]] = v0;
  x[r.particle[1]] = v1;
  x[r.particle[2]] = v2;
  x[r.particle[3]] = v3;
  return change;
}

template <class T>
ATELIER_HOST_DEVICE inline T project_spring_record(const ConstraintRecord<T>& r, Vec4<T>* x,
                                                   const Vec4<T>* start, T lambda,
                                                   const SubstepScale<T>& scale) {
  Vec4<T> a = x[r.particle[0]];
  Vec4<T> b = x[r.particle[1]];
  Vec3<T> s0{}, s1{};
  if (scale.gamma > T(0)) {
    s0 = xyz(start[r.particle[0]]);
    s1 = xyz(start[r.particle[1]]);
  }
  const T compliance = r.compliance * scale.spring_softness * scale.inverse_h2;
  const T change = project_spring(a, b, r.rest, compliance, lambda, scale.gamma, s0, s1);
  x[r.particle[0]] = a;
  x[r.particle[1]] = b;
  return change;
}

template <class T>
ATELIER_HOST_DEVICE inline void project_strain_record(const ConstraintRecord<T>& r,
                                                      const StrainRest<T>& rest, Vec4<T>* x,
                                                      const Vec4<T>* start, T* lambda,
                                                      const SubstepScale<T>& scale) {
  Vec4<T> v0 = x[r.particle[0]];
  Vec4<T> v1 = x[r.particle[1]];
  Vec4<T> v2 = x[r.particle[2]];
  Vec3<T> s0{}, s1{}, s2{};
  if (scale.gamma > T(0)) {
    s0 = xyz(start[r.particle[0]]);
    s1 = xyz(start[r.particle[1]]);
    s2 = xyz(start[r.particle[2]]);
  }
  project_strain(v0, v1, v2, rest, scale.spring_softness * scale.inverse_h2, scale.gamma, s0, s1,
                 s2, lambda);
  x[r.particle[0]] = v0;
  x[r.particle[1]] = v1;
  x[r.particle[2]] = v2;
}

/// Start of a substep: free particles fall, fixed ones go an even share of the way to their target.
/// `share` is 1 / (substeps left, this one included).
template <class T>
ATELIER_HOST_DEVICE inline void predict(Vec4<T>& x, Vec4<T>& start, Vec3<T>& velocity,
                                        Vec3<T> acceleration, Vec3<T> target, T share, T h) {
  start = x;
  if (x.w > T(0)) {
    velocity = velocity + h * acceleration;
    x = with_w(xyz(x) + h * velocity, x.w);
  } else {
    const Vec3<T> moved = xyz(x) + share * (target - xyz(x));
    velocity = (T(1) / h) * (moved - xyz(x));
    x = with_w(moved, x.w);
  }
}

/// End of a substep: the velocity takes up what the constraints moved. Differences to the predicted
/// position, not to the start, so that free flight loses nothing to rounding. `start` may have been
/// shifted by contacts that must not turn an old overlap into speed.
template <class T>
ATELIER_HOST_DEVICE inline void update_velocity(const Vec4<T>& x, const Vec4<T>& start,
                                                Vec3<T>& velocity, T h, T keep) {
  if (x.w > T(0)) {
    const Vec3<T> predicted = xyz(start) + h * velocity;
    velocity = keep * (velocity + (T(1) / h) * (xyz(x) - predicted));
  }
}

/// Pulls a particle back to within `length` of its anchor.
template <class T>
ATELIER_HOST_DEVICE inline void project_tether(Vec4<T>& x, Vec3<T> anchor, T length) {
  const Vec3<T> d = xyz(x) - anchor;
  const T distance = norm(d);
  if (x.w > T(0) && distance > length && distance > T(0)) {
    x = with_w(anchor + (length / distance) * d, x.w);
  }
}

}  // namespace atelier
