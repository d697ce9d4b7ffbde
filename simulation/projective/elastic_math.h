#pragma once

#include <cmath>

#include "simulation/projective/elastic_rows.h"

namespace atelier {

/// What a row is where particles are at `x`.
ATELIER_HOST_DEVICE inline Vec3d row_value(const ElasticRow& row, const Vec4<double>* x) {
  Vec3d sum = row.weight[0] * xyz(x[row.particle[0]]) + row.weight[1] * xyz(x[row.particle[1]]);
  for (int k = 2; k < 4; ++k) {
    if (row.particle[k] >= 0) {
      sum += row.weight[k] * xyz(x[row.particle[k]]);
    }
  }
  return sum;
}

/// What damping of `damping` s takes off the pull of a row that is `value`: its length is damped,
/// not its direction.
ATELIER_HOST_DEVICE inline Vec3d damped_pull(const ElasticRow& row, Vec3d value, Vec3d pull,
                                             double damping, const Vec4<double>* v) {
  if (!(damping > 0)) {
    return pull;
  }
  const double squared = squared_norm(value);
  const double rate = squared > 0 ? dot(row_value(row, v), value) / squared : 0;
  return pull - damping * ((row.stiffness * rate) * value);
}

/// What a limit of stretch adds to the pull of a row of that length.
ATELIER_HOST_DEVICE inline double pull_of_limit(double limit, double length, double longest) {
  return length > longest ? limit * (length - longest) : 0;
}

/// Of a spring of `rest` m; `longest`: share of it from which the row's limit adds.
ATELIER_HOST_DEVICE inline Vec3d spring_force(const ElasticRow& row, double rest, double longest,
                                              double damping, const Vec4<double>* x,
                                              const Vec4<double>* v) {
  const Vec3d d = xyz(x[row.particle[0]]) - xyz(x[row.particle[1]]);
  const double length = norm(d);
  if (!(length > 1e-12)) {
    return damped_pull(row, d, {}, damping, v);
  }
  const double pull =
      row.stiffness * (length - rest) + pull_of_limit(row.limit, length, longest * rest);
  return damped_pull(row, d, (-pull / length) * d, damping, v);
}

/// What the angle of a hinge pulls more than its row, which is t = 2 sin(angle / 2) long: the angle
/// is t + t^3 / 24 + 3 t^5 / 640 + ..., so that angle^2 / 2 has the gradient
/// t (1 + t^2 / 6 + t^4 / 30 + ...). As far as that it is finite however cloth is stretched.
ATELIER_HOST_DEVICE inline double bend_hardening(double squared) {
  return squared * (1.0 / 6 + squared * (1.0 / 30));
}

/// Pull of a hinge whose row is `d` with a rest angle, which makes it `bend` long along the mean
/// normal of its triangles.
ATELIER_HOST_DEVICE inline Vec3d bent_pull(const ElasticRow& row, double bend, Vec3d d,
                                           const Vec4<double>* x) {
  const Vec3d p0 = xyz(x[row.particle[0]]);
  const Vec3d edge = xyz(x[row.particle[1]]) - p0;
  const Vec3d left = cross(edge, xyz(x[row.particle[2]]) - p0);
  const Vec3d right = cross(xyz(x[row.particle[3]]) - p0, edge);
  const double size_left = norm(left);
  const double size_right = norm(right);
  Vec3d normal{};
  if (size_left > 0 && size_right > 0) {
    normal = (1 / size_left) * left + (1 / size_right) * right;
  }
  const double size = norm(normal);
  if (!(size > 1e-12)) {
    return -row.stiffness * d;
  }
  const Vec3d along = (-1 / size) * normal;
  const auto angle = [](double t) { return t * (1 + t * t * (1.0 / 24 + t * t * (3.0 / 640))); };
  const double t = dot(d, along);
  const double slope = 1 + t * t * (1.0 / 8 + t * t * (3.0 / 128));
  const double hardening = (angle(t) - angle(bend)) * slope - (t - bend);
  return row.stiffness * ((bend - hardening) * along - d);
}

/// Of a hinge whose row is `bend` long at rest. The damping of a flat one is linear.
ATELIER_HOST_DEVICE inline Vec3d bend_force(const ElasticRow& row, double bend, double damping,
                                            const Vec4<double>* x, const Vec4<double>* v) {
  const Vec3d d = row_value(row, x);
  if (bend != 0) {
    return damped_pull(row, d, bent_pull(row, bend, d, x), damping, v);
  }
  const Vec3d pull = (-row.stiffness * (1 + bend_hardening(squared_norm(d)))) * d;
  return damping > 0 ? pull - (damping * row.stiffness) * row_value(row, v) : pull;
}

/// The two rows of a triangle, warp and weft: what they are, or how fast they change, or the forces
/// on them.
struct Yarns {
  Vec3d u, v;
};

/// Forces of the two rows of a triangle: warp and weft as springs of rest length 1, and shear of
/// energy 1/2 shear cos^2 of the angle between the yarns. Both lengths and the cosine are damped,
/// each by its own modulus times `damping` s, so that turning is not; `rates` are not read without.
/// `longest`: where limits begin.
ATELIER_HOST_DEVICE inline Yarns yarn_forces(const std::array<double, 3>& moduli, double longest,
                                             const Yarns& rows, double damping,
                                             const Yarns& rates) {
  const double lu = norm(rows.u);
  const double lv = norm(rows.v);
  if (!(lu > 1e-12) || !(lv > 1e-12)) {
    return {};
  }
  const Vec3d u = (1 / lu) * rows.u;
  const Vec3d v = (1 / lv) * rows.v;
  const double cosine = dot(u, v);
  // Gradients of the cosine.
  const Vec3d of_u = (1 / lu) * (v - cosine * u);
  const Vec3d of_v = (1 / lv) * (u - cosine * v);
  const auto pull = [&](double modulus, double length) {
    return modulus * (length - 1) + pull_of_limit(kLimitStiffness * modulus, length, longest);
  };
  double along_u = pull(moduli[0], lu);
  double along_v = pull(moduli[1], lv);
  double shear = moduli[2] * cosine;
  if (damping > 0) {
    along_u += damping * moduli[0] * dot(u, rates.u);
    along_v += damping * moduli[1] * dot(v, rates.v);
    shear += damping * moduli[2] * (dot(of_u, rates.u) + dot(of_v, rates.v));
  }
  return {-along_u * u - shear * of_u, -along_v * v - shear * of_v};
}

}  // namespace atelier
