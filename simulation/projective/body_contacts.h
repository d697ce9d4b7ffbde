#pragma once

#include <vector>

#include "simulation/cloth/solver_options.h"
#include "simulation/contact/body_encounter.h"
#include "simulation/projective/velocity_bound_math.h"

namespace atelier {

/// A particle that may touch the body within a step: a bound on its velocity.
struct TouchedBody {
  int particle;
  VelocityBound bound;
};

/// Contact of a cloth's particles with a moving body: which there are in a step, and, after it,
/// that nothing has passed (body_contact_math.h).
class BodyContacts {
 public:
  BodyContacts(const Triangles& faces, const CommonSolverOptions& options, const Material& material,
               int substeps);

  /// Takes over the body's motion in a frame of `time_step` s and collects what each particle may
  /// meet.
  void begin_frame(const Control& control, double time_step, const std::vector<Vec4<double>>& x,
                   const std::vector<Vec4<double>>& velocity,
                   const std::vector<Vec4<double>>& acceleration);
  bool empty() const { return body_.empty(); }

  /// Contacts of substep `s`, in which particles would move from `x` by `h` times `flight` m/s. A
  /// particle that is too near already is moved out, slowly (`x` changes): that does not become
  /// velocity.
  const std::vector<TouchedBody>& find(int s, double h, std::vector<Vec4<double>>& x,
                                       const std::vector<Vec4<double>>& flight);

  /// Those of the last `find`.
  const std::vector<TouchedBody>& found() const { return contacts_; }
  /// Further contacts of particles in `known`, contacts of substep `s`, which the iterations so far
  /// move from `x` by `h` times `v` m/s: with surfaces that lie across their own contact's and that
  /// they would pass. One contact holds a particle that lies on the body, but not one that parts of
  /// it pinch, where the cloth pulls it off the one and through the other.
  std::vector<TouchedBody> find_across(int s, double h, const std::vector<TouchedBody>& known,
                                       const std::vector<Vec4<double>>& x,
                                       const std::vector<Vec4<double>>& v) const;

  /// Keeps what went from `start` to `x` in substep `s` out of the body: where a step passed
  /// through it or ended in it, `x` is moved out. Returns whether the particle touches.
  bool keep_out(int s, int particle, BodyParticle<double>& p);
  /// The same of a particle that cloth moved, from `origin` at the substep's start.
  bool meet(int s, int particle, BodyParticle<double>& p, const Vec4<double>& origin,
            Meeting meeting);
  /// See end_outside in body_contact_math.h.
  void end_outside(std::vector<Vec4<double>>& x) { body_.end_outside(rules_.kept, substeps_, x); }
  BodyPenetration penetration(const std::vector<Vec4<double>>& x) const {
    return body_.penetration(rules_.kept.reach, x);
  }
  const std::vector<BodyOutlook<double>>& outlook() const { return body_.outlook(); }
  double friction() const { return rules_.kept.friction; }

 private:
  BodySubstep<double> substep(int s, const BodyContactRule<double>& rule) const {
    return {body_.body(), rule, static_cast<double>(s) / substeps_,
            static_cast<double>(s + 1) / substeps_};
  }

  BodyEncounter<double> body_;
  int substeps_;
  BoundRules rules_;
  std::vector<Vec3<double>> velocity_, acceleration_;
  std::vector<TouchedBody> contacts_;
  std::vector<TouchedBody> found_;  ///< [V], particle -1: none
};

}  // namespace atelier
