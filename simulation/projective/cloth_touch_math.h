#pragma once

#include "simulation/contact/collision_response_math.h"
#include "simulation/projective/velocity_bound_math.h"

namespace atelier {

/// A particle and a face of the cloth that may touch within a step: a bound on the velocity of
/// their nearest points relative to one another, which is sum weight v.
struct TouchedCloth {
  int particle[4];  ///< the particle, then the face's
  double weight[4];
  Vec3d normal;  ///< from the face to the particle, unit
  double least;  ///< m/s, least relative velocity along the normal: slower is too near
};

/// The vector from the face's to the particle's point of a pair, where its particles are `at`.
ATELIER_HOST_DEVICE inline Vec3d pair_apart(const PairPoints<double>& pair,
                                            const Vec4<double>* at) {
  Vec3d sum{};
  for (int k = 0; k < 4; ++k) {
    sum += pair.weight[k] * xyz(at[k]);
  }
  return sum;
}

/// Sets the points of a pair that comes nearer than `near` and the vector `away` between them, on
/// the side on which it began; false where it does not. `motion`: a ParticleMotion.
template <class Motion>
ATELIER_HOST_DEVICE inline bool touching_points(const SelfView<double>& view,
                                                const SelfPair<double>& candidate, double near,
                                                const Motion& motion, PairPoints<double>& pair,
                                                PairDirection<double>& direction, Vec3d& away) {
  // Where they end, as what slides along comes nearest to other pieces than it began at. Where they
  // would have passed by then, as they began.
  if (vertex_face_points(view, candidate, near, motion_of(motion.now, motion.now), pair,
                         direction)) {
    for (int k = 0; k < 4; ++k) {
      pair.start[k] = motion.before(pair.particle[k]);
    }
    away = pair_apart(pair, pair.x);
    if (dot(away, pair_apart(pair, pair.start)) > 0) {
      return true;
    }
  }
  if (!vertex_face_points(view, candidate, near, motion, pair, direction)) {
    return false;
  }
  away = pair_apart(pair, pair.start);
  return !(dot(away, pair_apart(pair, pair.x)) > 0);
}

/// Whether a pair may touch in a substep of `h` s, and the bound that this means. `motion`: a
/// ParticleMotion, with `now` where the cloth would go without contact.
template <class Motion>
ATELIER_HOST_DEVICE inline bool touch_of_pair(const SelfView<double>& view,
                                              const SelfPair<double>& candidate,
                                              const Motion& motion, double h, TouchedCloth& touch) {
  // Beside crossings the layers' order pulls, and the guard after the iterations pushes.
  if (order_decides(view, candidate, false)) {
    return false;
  }
  constexpr double kTouchMargin =
      5e-4;  // m: tension presses together what would fly past by itself
  const double gap = candidate.gap;
  PairPoints<double> pair;
  PairDirection<double> direction;
  Vec3d away{};
  if (!touching_points(view, candidate, gap + max_of(kTouchMargin, gap), motion, pair, direction,
                       away)) {
    return false;
  }
  const double distance = norm(away);
  const Vec3d n = distance > 1e-7 ? (1 / distance) * away : direction.normal;
  if (!(squared_norm(n) > 0)) {
    return false;
  }
  // What was too near before is moved out by the guard, which makes no velocity of it.
  const double at_start = max_of(0.0, dot(n, pair_apart(pair, pair.start)));
  for (int k = 0; k < 4; ++k) {
    touch.particle[k] = pair.particle[k];
    touch.weight[k] = pair.weight[k];
  }
  touch.normal = n;
  touch.least = (min_of(gap, at_start) - at_start) / h;
  return true;
}

/// Velocity of the particle's point relative to the face's; `velocity(i)` of particles, asked of
/// those alone that have a part in it.
template <class Velocity>
ATELIER_HOST_DEVICE inline Vec3d relative_velocity(const TouchedCloth& touch,
                                                   const Velocity& velocity) {
  Vec3d sum{};
  for (int k = 0; k < 4; ++k) {
    if (touch.weight[k] != 0) {
      sum += touch.weight[k] * velocity(touch.particle[k]);
    }
  }
  return sum;
}

/// The impulse of a touch whose points move with the velocity `relative` with the impulse `before`:
/// the one in the cone of `friction` that comes nearest to holding it. `mass`: kg that resists.
ATELIER_HOST_DEVICE inline Vec3d touch_impulse(const TouchedCloth& touch, Vec3d before, double mass,
                                               Vec3d relative, double friction) {
  return coulomb_impulse(before + mass * lacking_velocity(relative, touch.normal, touch.least),
                         touch.normal, friction);
}

}  // namespace atelier
