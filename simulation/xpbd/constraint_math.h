#pragma once

#include <cmath>

#include "simulation/cloth/fast_math.h"
#include "simulation/cloth/vec4.h"

namespace atelier {

/// The arithmetic of one XPBD constraint (Macklin et al. 2016, "XPBD"), shared by CPU and CUDA.
///
/// A constraint C(x) with compliance a (inverse stiffness) is, over a substep of h seconds,
///   dlambda = (-C - a' lambda - g (dC/dx . (x - x0))) / ((1 + g) sum w |dC/dx|^2 + a'),
///   dx_i = w_i dC/dx_i dlambda,    a' = a / h^2,    g = (damping time) / h,
/// where x0 is the position at the start of the substep (equations 18 and 26 there; for damping
/// proportional to stiffness, b = t k, their gamma is t / h for every constraint).
template <class T>
struct Softness {
  T compliance;  ///< a'
  T lambda;      ///< so far in the substep
  T gamma;       ///< g
};

/// dlambda for a C of value `c`: `weight` is the sum over w |dC/dx|^2, `c_change` dC/dx . (x - x0).
template <class T>
ATELIER_HOST_DEVICE inline T multiplier_change(T c, T weight, const Softness<T>& soft, T c_change) {
  return quotient(-c - soft.compliance * soft.lambda - soft.gamma * c_change,
                  (T(1) + soft.gamma) * weight + soft.compliance);
}

/// atan2 for the dihedral angle: one polynomial on both devices in float (error below 3e-7 rad),
/// the library's in double.
ATELIER_HOST_DEVICE inline float angle_of(float sine, float cosine) {
  const float as = std::fabs(sine);
  const float ac = std::fabs(cosine);
  const float big = as > ac ? as : ac;
  const float small = as > ac ? ac : as;
  // arctan on [0, 1], odd minimax polynomial.
  const float z = big > 0.0f ? quotient(small, big) : 0.0f;
  const float s = z * z;
  float p = -0.0040540580f;
  p = p * s + 0.0218612288f;
  p = p * s - 0.0559098861f;
  p = p * s + 0.0964200441f;
  p = p * s - 0.1390853351f;
  p = p * s + 0.1994653599f;
  p = p * s - 0.3332985605f;
  p = p * s + 0.9999993329f;
  float angle = z * p;
  angle = as > ac ? 1.57079632679f - angle : angle;
  angle = cosine < 0.0f ? 3.14159265359f - angle : angle;
  return sine < 0.0f ? -angle : angle;
}
ATELIER_HOST_DEVICE inline double angle_of(double sine, double cosine) {
  return std::atan2(sine, cosine);
}

/// Length of a spring minus `rest` [m], and its gradient with respect to `a` (that of `b` is the
/// negative). A spring of no length has no direction: gradient 0.
template <class T>
struct SpringValue {
  T c;
  Vec3<T> gradient;
};

template <class T>
ATELIER_HOST_DEVICE inline SpringValue<T> spring_value(Vec3<T> a, Vec3<T> b, T rest) {
  const Vec3<T> d = a - b;
  const T squared = squared_norm(d);
  const T inverse = squared > T(1e-24) ? inverse_root(squared) : T(0);
  const T length = squared * inverse;
  return {length - rest, inverse * d};
}

/// Projects one spring, of compliance in 1/kg. Returns the change of the multiplier.
template <class T>
ATELIER_HOST_DEVICE inline T project_spring(Vec4<T>& a, Vec4<T>& b, T rest, const Softness<T>& soft,
                                            Vec3<T> a_start, Vec3<T> b_start) {
  const Vec3<T> pa = xyz(a);
  const Vec3<T> pb = xyz(b);
  const SpringValue<T> s = spring_value(pa, pb, rest);
  const T weight = (a.w + b.w) * squared_norm(s.gradient);
  T c_change = T(0);
  if (soft.gamma > T(0)) {
    c_change = dot(s.gradient, (pa - a_start) - (pb - b_start));
  }
  const bool moves = weight > T(0);
  const T wanted = multiplier_change(s.c, moves ? weight : T(1), soft, c_change);
  const T change = moves ? wanted : T(0);
  a = with_w(pa + (a.w * change) * s.gradient, a.w);
  b = with_w(pb - (b.w * change) * s.gradient, b.w);
  return change;
}

/// Dihedral angle [rad] at the edge p0 p1 between the triangles (p0, p1, p2) and (p1, p0, p3):
/// 0 when flat, in (-pi, pi], positive when the triangles fold away from their normals. The
/// gradients are those of Bridson et al. 2003, "Simulation of clothing with folds and wrinkles",
/// in radians per metre: each carries 1/|n|.
template <class T>
struct HingeValue {
  T angle;
  Vec3<T> gradient[4];
  bool valid;  ///< false where a triangle has no area: the angle and gradients mean nothing
};

template <class T>
ATELIER_HOST_DEVICE inline HingeValue<T> hinge_value(Vec3<T> p0, Vec3<T> p1, Vec3<T> p2,
                                                     Vec3<T> p3) {
  HingeValue<T> out;
  const Vec3<T> e = p1 - p0;
  const Vec3<T> a = p2 - p0;
  const Vec3<T> b = p3 - p0;
  const Vec3<T> n1 = cross(e, a);  // of (p0, p1, p2)
  const Vec3<T> n2 = cross(b, e);  // of (p1, p0, p3)
  const T ee = squared_norm(e);
  const T nn1 = squared_norm(n1);
  const T nn2 = squared_norm(n2);
  // Relative to the edge: slivers thinner than a millionth of their edge have no usable normal.
  const T tiny = T(1e-12) * ee * ee;
  out.valid = nn1 > tiny && nn2 > tiny;
  // No branch: an edge of no use gets finite numbers, and its angle is not used.
  const T inverse_length = inverse_root(out.valid ? ee : T(1));
  const T length = ee * inverse_length;
  out.angle = angle_of(dot(cross(n1, n2), e) * inverse_length, dot(n1, n2));
  const Vec3<T> u1 = quotient(T(1), out.valid ? nn1 : T(1)) * n1;
  const Vec3<T> u2 = quotient(T(1), out.valid ? nn2 : T(1)) * n2;
  // Height of the opposite vertices along the edge, from p0, as a share of the edge times length.
  const T s2 = dot(a, e) * inverse_length;
  const T s3 = dot(b, e) * inverse_length;
  out.gradient[2] = (-length) * u1;
  out.gradient[3] = (-length) * u2;
  out.gradient[0] = (length - s2) * u1 + (length - s3) * u2;
  out.gradient[1] = s2 * u1 + s3 * u2;
  return out;
}

/// Difference of two angles, in [-pi, pi].
template <class T>
ATELIER_HOST_DEVICE inline T angle_difference(T angle, T rest) {
  T d = angle - rest;
  if (d > T(3.14159265358979323846)) {
    d -= T(6.28318530717958647692);
  }
  if (d < T(-3.14159265358979323846)) {
    d += T(6.28318530717958647692);
  }
  return d;
}

/// Projects one hinge, of compliance in 1/(kg m2). Returns the change of the multiplier.
template <class T>
ATELIER_HOST_DEVICE inline T project_hinge(Vec4<T> (&v)[4], T rest, const Softness<T>& soft,
                                           const Vec3<T> (&start)[4]) {
  const Vec3<T> p0 = xyz(v[0]);
  const Vec3<T> p1 = xyz(v[1]);
  const Vec3<T> p2 = xyz(v[2]);
  const Vec3<T> p3 = xyz(v[3]);
  const HingeValue<T> hinge = hinge_value(p0, p1, p2, p3);
  const Vec3<T>* g = hinge.gradient;
  const T weight = v[0].w * squared_norm(g[0]) + v[1].w * squared_norm(g[1]) +
                   v[2].w * squared_norm(g[2]) + v[3].w * squared_norm(g[3]);
  const bool moves = hinge.valid && weight > T(0);
  T c_change = T(0);
  if (soft.gamma > T(0)) {
    c_change = dot(g[0], p0 - start[0]) + dot(g[1], p1 - start[1]) + dot(g[2], p2 - start[2]) +
               dot(g[3], p3 - start[3]);
  }
  const T c = angle_difference(hinge.angle, rest);
  const T wanted = multiplier_change(c, moves ? weight : T(1), soft, c_change);
  const T change = moves ? wanted : T(0);
  v[0] = with_w(p0 + (v[0].w * change) * g[0], v[0].w);
  v[1] = with_w(p1 + (v[1].w * change) * g[1], v[1].w);
  v[2] = with_w(p2 + (v[2].w * change) * g[2], v[2].w);
  v[3] = with_w(p3 + (v[3].w * change) * g[3], v[3].w);
  return change;
}

/// Rest shape and stiffness of one orthotropic triangle: `inverse_rest` maps the edges (p1 - p0,
/// p2 - p0) to the deformation of the warp (u) and weft (v) directions.
template <class T>
struct StrainRest {
  T u1, u2, v1, v2;     ///< F_u = u1 e1 + u2 e2, F_v = v1 e1 + v2 e2 [1/m]
  T warp, weft, shear;  ///< compliance of each, already divided by the area [1/(N m)]
};

/// A scalar constraint of three particles: its value, its gradients (that of the first particle is
/// minus the sum of the others) and its compliance a'.
template <class T>
struct TriangleConstraint {
  T c;
  Vec3<T> g1, g2;
  T compliance;
};

template <class T>
ATELIER_HOST_DEVICE inline void project_three(Vec4<T> (&v)[3], const Vec3<T> (&start)[3],
                                              const TriangleConstraint<T>& constraint, T gamma,
                                              T& lambda) {
  const Vec3<T> g1 = constraint.g1;
  const Vec3<T> g2 = constraint.g2;
  const Vec3<T> g0 = -(g1 + g2);
  const T weight =
      v[0].w * squared_norm(g0) + v[1].w * squared_norm(g1) + v[2].w * squared_norm(g2);
  if (!(weight > T(0))) {
    return;
  }
  T c_change = T(0);
  if (gamma > T(0)) {
    c_change = dot(g0, xyz(v[0]) - start[0]) + dot(g1, xyz(v[1]) - start[1]) +
               dot(g2, xyz(v[2]) - start[2]);
  }
  const Softness<T> soft{constraint.compliance, lambda, gamma};
  const T change = multiplier_change(constraint.c, weight, soft, c_change);
  lambda += change;
  v[0] = with_w(xyz(v[0]) + (v[0].w * change) * g0, v[0].w);
  v[1] = with_w(xyz(v[1]) + (v[1].w * change) * g1, v[1].w);
  v[2] = with_w(xyz(v[2]) + (v[2].w * change) * g2, v[2].w);
}

/// Warp stretch |F_u| - 1, weft stretch |F_v| - 1 and the cosine of the angle between the yarns
/// (its change is the shear angle), one after the other. Our form of the triangle strain of
/// Mueller et al. 2014, "Strain based dynamics". `scale` is 1/h^2; `lambda` holds three.
template <class T>
ATELIER_HOST_DEVICE inline void project_strain(Vec4<T> (&v)[3], const Vec3<T> (&start)[3],
                                               const StrainRest<T>& rest, T scale, T gamma,
                                               T* lambda) {
  for (int k = 0; k < 3; ++k) {
    const Vec3<T> e1 = xyz(v[1]) - xyz(v[0]);
    const Vec3<T> e2 = xyz(v[2]) - xyz(v[0]);
    const Vec3<T> fu = rest.u1 * e1 + rest.u2 * e2;
    const Vec3<T> fv = rest.v1 * e1 + rest.v2 * e2;
    const T lu = norm(fu);
    const T lv = norm(fv);
    if (!(lu > T(1e-9)) || !(lv > T(1e-9))) {
      continue;
    }
    const Vec3<T> nu = (T(1) / lu) * fu;
    const Vec3<T> nv = (T(1) / lv) * fv;
    if (k == 0) {
      project_three(v, start, {lu - T(1), rest.u1 * nu, rest.u2 * nu, rest.warp * scale}, gamma,
                    lambda[0]);
    } else if (k == 1) {
      project_three(v, start, {lv - T(1), rest.v1 * nv, rest.v2 * nv, rest.weft * scale}, gamma,
                    lambda[1]);
    } else {
      const T c = dot(nu, nv);
      const Vec3<T> du = (T(1) / lu) * (nv - c * nu);
      const Vec3<T> dv = (T(1) / lv) * (nu - c * nv);
      project_three(
          v, start,
          {c, rest.u1 * du + rest.v1 * dv, rest.u2 * du + rest.v2 * dv, rest.shear * scale}, gamma,
          lambda[2]);
    }
  }
}

}  // namespace atelier
