#pragma once

#include "simulation/contact/self_contact_math.h"

namespace atelier {

/// Passes of a substep's last step, which keeps back what would pass: XPBD's and four rounds more
/// of its last ones, since longer substeps press more together.
struct ProjectiveKeeps {
  static constexpr int kPasses = SelfKeeps::kPasses + 4 * kSelfStays;

  /// True for passes in which carries begin anew with what the body asks in them. What it asked for
  /// when it kept more of its distance may be further, and the furthest leads a pair: it would stay
  /// where the body does not let it, for any number of passes.
  ATELIER_HOST_DEVICE static bool asks_body_anew(int pass) {
    const int beyond = pass - kSelfSlides - kSelfRides;
    return beyond >= 0 && beyond % kSelfStays == 0;
  }
};

}  // namespace atelier
