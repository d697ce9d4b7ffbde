#pragma once

#include <cmath>

#include "core/vec.h"

namespace atelier {

/// The impulse that Coulomb's law allows of the one that would hold a contact: none that pulls, and
/// along the surface at most `friction` times the one across it. So a contact whose impulse is
/// within the cone sticks, exactly; one on its border slips.
ATELIER_HOST_DEVICE inline Vec3d coulomb_impulse(Vec3d holding, Vec3d normal, double friction) {
  const double across = dot(holding, normal);
  if (!(across > 0)) {
    return {};
  }
  Vec3d along = holding - across * normal;
  const double size = norm(along);
  const double most = friction * across;
  if (size > most) {
    along = (most / size) * along;
  }
  return across * normal + along;
}

/// How far an impulse and the relative velocity that it leaves are from Coulomb's law [N s]: the
/// function of Alart and Curnier 1991, 0 where both agree. `rho` [kg] weighs velocities.
inline double coulomb_residual(Vec3d impulse, Vec3d relative, Vec3d normal, double friction,
                               double rho) {
  const double across = dot(impulse, normal);
  const Vec3d wanted = impulse - rho * relative;
  const double wanted_across = dot(wanted, normal);
  Vec3d along = wanted - wanted_across * normal;
  const double size = norm(along);
  const double most = friction * (across > 0 ? across : 0);
  if (size > most) {
    along = (size > 0 ? most / size : 0) * along;
  }
  const Vec3d allowed = (wanted_across > 0 ? wanted_across : 0) * normal + along;
  return norm(impulse - allowed);
}

}  // namespace atelier
