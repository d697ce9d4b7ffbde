#pragma once

#include <utility>
#include <vector>

#include "simulation/projective/body_contacts.h"
#include "simulation/projective/self_touches.h"

namespace atelier {

/// Impulses of contact in the iterations of a step, after Ly et al. 2020: Coulomb's law is solved
/// for one contact after the other, exactly. Particles have the velocities that they would leave
/// the step with where the rest of the cloth does what it does at the moment; the impulse of a
/// contact is the one in the cone that brings its own masses to the relative velocity that it may
/// have. Where iterations have converged, velocities and impulses obey Coulomb's law with the whole
/// cloth.
///
/// Contacts between pieces of cloth are in levels, as in the paper: those of cloth on the body, or
/// held, come first, then those of cloth on that, and so on; in a level, contacts of one colour
/// share no particle. Impulses of the iteration before are where the next one begins (projected
/// Gauss-Seidel). So the bits do not depend on the number of threads.
///
/// Light particles of stiff cloth are held gently: where the cloth pulls with thirty thousand
/// times what their mass resists, an impulse that cancels all of the pull would throw the rest of
/// the cloth about long before iterations take it back. Their impulses only grow by what their own
/// mass lacks of the bound in each iteration (Uzawa's method), and end at the same Coulomb's law.
class ContactImpulses {
 public:
  struct BodyImpulse {
    TouchedBody contact;
    double mass;      ///< kg of the particle
    Vec3d impulse{};  ///< N s
    bool gentle = false;
  };
  struct ClothImpulse {
    TouchedCloth contact;
    double mass;      ///< kg that resists along a direction, 1 / sum weight^2 / mass
    Vec3d impulse{};  ///< N s, along `weight` on each particle
  };
  /// Coefficients of friction against the body and between pieces of cloth.
  struct Frictions {
    double body, cloth;
  };

  /// From now on the particles [V] that are 1 are held gently by the body.
  void hold_gently(std::vector<char> particles) { gentle_ = std::move(particles); }

  /// Contacts of a step; `inverse_mass` [V] 1/kg, 0 of particles that are held.
  void begin_step(const std::vector<TouchedBody>& body, const std::vector<TouchedCloth>& cloth,
                  const Frictions& friction, const std::vector<double>& inverse_mass);

  /// Adds contacts with the body across others of the same particles (BodyContacts::find_across),
  /// of particles that have none yet. Returns how many.
  int add_across(const std::vector<TouchedBody>& body);

  /// Sets impulses and adds what they do to the velocities [V] that particles have without; `now`
  /// [V]: those of the iteration, which gentle contacts look at.
  void hold(std::vector<Vec4<double>>& velocity, const std::vector<Vec4<double>>& now);

  /// Of contacts, as a share of a weight; 0 without any.
  struct Residual {
    double root_mean_square = 0;
    double most = 0;  ///< of a single contact
  };
  /// Alart and Curnier's residual of contacts with the body, of impulses that the momentum balance
  /// implies (`implied` [V], N s) and the velocities `v`, as a share of `weight` N s.
  Residual body_residual(const std::vector<Vec4<double>>& implied,
                         const std::vector<Vec4<double>>& v, double weight) const;
  /// The same of contacts between pieces of cloth, with the impulses of the last iteration.
  Residual cloth_residual(const std::vector<Vec4<double>>& v, double weight) const;

  const std::vector<BodyImpulse>& with_body() const { return body_; }
  const std::vector<BodyImpulse>& across() const { return across_; }
  const std::vector<ClothImpulse>& with_cloth() const { return cloth_; }

 private:
  void sort_into_batches(const std::vector<TouchedCloth>& cloth);
  void begin_gently(const std::vector<Vec4<double>>& now);
  void hold_body(std::vector<Vec4<double>>& velocity);
  void hold_each(std::vector<BodyImpulse>& contacts, std::vector<Vec4<double>>& velocity) const;
  void hold_batch(std::size_t batch, std::vector<Vec4<double>>& velocity);

  std::vector<BodyImpulse> body_;
  std::vector<BodyImpulse> across_;
  std::vector<ClothImpulse> cloth_;  ///< batch after batch
  std::vector<int> batch_begin_;     ///< [batches + 1] in `cloth_`
  std::vector<char> shares_;         ///< [batches] 1: its contacts share particles
  std::vector<char> gentle_;         ///< [V], or empty: none
  Frictions friction_{};
  std::vector<double> inverse_mass_;
};

}  // namespace atelier
