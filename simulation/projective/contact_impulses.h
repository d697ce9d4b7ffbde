#pragma once

#include <vector>

#include "simulation/projective/body_contacts.h"

namespace atelier {

/// Impulses of contact in the iterations of a step, after Ly et al. 2020: Coulomb's law is solved
/// for each contact by itself, exactly. A particle has the momentum f that it would leave the step
/// with, without impulses and where the rest of the cloth does what it does at the moment; its
/// impulse is the one in the cone that brings its own mass to the body's velocity. Where iterations
/// have converged, velocities and impulses obey Coulomb's law with the whole cloth.
struct ContactImpulse {
  TouchedBody contact;
  double mass;      ///< kg of the particle
  Vec3d impulse{};  ///< N s
};

class ContactImpulses {
 public:
  /// Contacts of a step, `mass` [V] kg of particles.
  void begin_step(const std::vector<TouchedBody>& contacts, double friction,
                  const std::vector<double>& mass);

  /// Impulses from each particle's momentum [V] N s.
  void hold(const std::vector<Vec4<double>>& momentum);

  /// Alart and Curnier's residual, the root of the mean square over contacts, of impulses that the
  /// momentum balance implies (`implied` [V], N s) and the velocities `v`, as a share of `weight`
  /// N s. 0 without contacts.
  double residual(const std::vector<Vec4<double>>& implied, const std::vector<Vec4<double>>& v,
                  double weight) const;

  const std::vector<ContactImpulse>& contacts() const { return contacts_; }

 private:
  std::vector<ContactImpulse> contacts_;
  double friction_ = 0;
};

}  // namespace atelier
