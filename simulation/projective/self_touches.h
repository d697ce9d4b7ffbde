#pragma once

#include <vector>

#include "simulation/xpbd/self_contact_cpu.h"

namespace atelier {

/// A particle and a face of the cloth that may touch within a step: a bound on the velocity of
/// their nearest points relative to one another, which is sum weight v.
struct TouchedCloth {
  int particle[4];  ///< the particle, then the face's
  double weight[4];
  Vec3d normal;  ///< from the face to the particle, unit
  double least;  ///< m/s, least relative velocity along the normal: slower is too near
};

/// The pairs that may touch in a substep of `h` seconds, in an order that only depends on where the
/// cloth is: `motion.origin` at its start, `motion.x` where it would go without contact.
std::vector<TouchedCloth> touching_pairs(SelfContactCpu<double>& self,
                                         const SelfMotion<double>& motion, double h);

}  // namespace atelier
