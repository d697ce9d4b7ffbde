#include "simulation/projective/contact_impulses.h"

#include <cmath>

#include "core/parallel.h"
#include "simulation/projective/coulomb.h"

namespace atelier {
namespace {

/// What a particle's velocity lacks: across the surface up to the bound, and along it.
Vec3d lacking_velocity(const TouchedBody& contact, Vec3d v) {
  const Vec3d n = contact.normal;
  const Vec3d against = contact.moves - v;
  return against + (contact.least - dot(n, contact.moves)) * n;
}

}  // namespace

void ContactImpulses::begin_step(const std::vector<TouchedBody>& contacts, double friction,
                                 const std::vector<double>& mass) {
  contacts_.clear();
  friction_ = friction;
  for (const TouchedBody& contact : contacts) {
    contacts_.push_back({contact, mass[contact.particle]});
  }
}

void ContactImpulses::hold(const std::vector<Vec4<double>>& momentum) {
  parallel_for(static_cast<Index>(contacts_.size()), 1024, [&](Index begin, Index end) {
    for (Index k = begin; k < end; ++k) {
      ContactImpulse& c = contacts_[k];
      const Vec3d reached = (1 / c.mass) * xyz(momentum[c.contact.particle]);
      c.impulse = coulomb_impulse(c.mass * lacking_velocity(c.contact, reached), c.contact.normal,
                                  friction_);
    }
  });
}

double ContactImpulses::residual(const std::vector<Vec4<double>>& implied,
                                 const std::vector<Vec4<double>>& v, double weight) const {
  double sum = 0;
  for (const ContactImpulse& c : contacts_) {
    const Vec3d relative = -lacking_velocity(c.contact, xyz(v[c.contact.particle]));
    const double one = coulomb_residual(xyz(implied[c.contact.particle]), relative,
                                        c.contact.normal, friction_, c.mass);
    sum += one * one;
  }
  return contacts_.empty() ? 0 : std::sqrt(sum / static_cast<double>(contacts_.size())) / weight;
}

}  // namespace atelier
