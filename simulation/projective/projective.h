#pragma once

#include <memory>

#include "simulation/cloth/cloth.h"
#include "simulation/cloth/cloth_state.h"
#include "simulation/cloth/frame_report.h"
#include "simulation/cloth/solver_options.h"

namespace atelier {

/// What the last substep of a frame left.
struct ProjectiveResidual {
  /// Alart and Curnier's function of contacts with the body and the impulses that the momentum of
  /// their particles implies: root mean square, as a share of a particle's mean weight in a
  /// substep.
  double contact = 0;
  double worst_contact = 0;  ///< the same of the single contact that is farthest from it
  /// Momentum that particles without contact lack, in the same measure.
  double momentum = 0;
  int contacts = 0;
  /// The same function of contacts between pieces of cloth.
  double cloth_contact = 0;
  double worst_cloth_contact = 0;
  int cloth_contacts = 0;
};

/// Projective dynamics with dry frictional contact (Ly, Jouve, Boissieux and Bertails-Descoubes
/// 2020, "Projective dynamics with dry frictional contact"), in double precision on the CPU.
///
/// Implicit Euler in velocities: M v = M (v0 + h g) + h F(x0 + h v) + r, with elastic forces F
/// (elastic_rows.h) and impulses r of contact (contact_impulses.h). Each iteration evaluates F
/// where the velocities lead to and solves with the constant matrix P = M + h^2 K, which is
/// factored once: v += P^-1 (M (v0 + h g - v) + h F + r). After a substep nothing has passed
/// through the body (body_contacts.h), and, with self-contact, through other cloth
/// (SelfContactCpu).
class ProjectiveSolver {
 public:
  /// Throws LogicError for options out of range, DataError where stiffness and mass are so far
  /// apart that the matrix is not positive definite.
  ProjectiveSolver(const Cloth& cloth, const Triangles& body_faces, const SolverOptions& options);
  ~ProjectiveSolver();
  ProjectiveSolver(ProjectiveSolver&&) noexcept;
  ProjectiveSolver& operator=(ProjectiveSolver&&) noexcept;

  void set_state(const ClothState& state);
  ClothState state() const;
  /// One frame; throws as Solver::step.
  FrameReport advance(const Control& control);
  /// Of the last substep; costs an evaluation of all forces.
  ProjectiveResidual residual() const;

 private:
  struct Scene;
  std::unique_ptr<Scene> scene_;
};

}  // namespace atelier
