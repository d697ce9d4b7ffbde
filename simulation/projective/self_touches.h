#pragma once

#include <vector>

#include "simulation/projective/cloth_touch_math.h"
#include "simulation/xpbd/self_contact_cpu.h"

namespace atelier {

/// The pairs that may touch in a substep of `h` seconds, in an order that only depends on where the
/// cloth is: `motion.origin` at its start, `motion.x` where it would go without contact.
std::vector<TouchedCloth> touching_pairs(SelfContactCpu<double>& self,
                                         const SelfMotion<double>& motion, double h);

}  // namespace atelier
