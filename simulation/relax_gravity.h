#pragma once

#include <functional>
#include <vector>

#include "core/device.h"
#include "core/garment.h"
#include "core/options.h"
#include "simulation/cloth/cloth.h"
#include "simulation/solver.h"

namespace atelier {

/// How a captured garment gives back what its weight has stretched.
struct RelaxGravityOptions {
  int rounds = 12;          ///< of simulating and correcting, 1 to 1000
  double seconds = 2;       ///< simulated in each, 0.05 to 60
  double damping = 4;       ///< 1/s, so that it comes to rest in that time, 0 to 1000
  double step = 0.8;        ///< share of the error that a round takes back, 0.05 to 1
  double tolerance = 5e-4;  ///< m: done where the mean distance to the captured shape is below
};
OptionTable describe(RelaxGravityOptions& options);

/// How clothes are simulated on bodies (`simulate`, `animate`), and so how they are relaxed: with
/// few substeps springs do not come to rest, and cloth gives way by more than its weight stretches.
inline SolverOptions relaxing_solver() {
  SolverOptions solver;
  solver.substeps = 30;
  solver.self_contact = true;
  return solver;
}

/// A garment as it was captured, on a body that stands still. Refers to what others own.
struct HangingGarment {
  const Garment& captured;
  std::vector<int> pins;        ///< vertices that stay where they are
  const Points& body;           ///< [B,3] m; no rows: none
  const Triangles& body_faces;  ///< [F,3]
};

/// A garment that hangs in the captured shape, and how nearly.
struct RelaxedGarment {
  Garment garment;           ///< its mesh is the unloaded template; without a flat rest shape
  double mean_error = 0;     ///< m, of its vertices after `seconds` under gravity
  double largest_error = 0;  ///< m
  double gap = 0;            ///< m kept from the body: it hangs so only if that is kept
  int rounds = 0;
  bool converged = false;
};

/// Inverse statics by fixed points: the template whose simulation under gravity, on the body that
/// stands still, ends in the captured shape. Each round simulates from the captured shape with the
/// template as rest shape and moves the template against where the cloth went; one that makes it
/// worse is taken back and halved. Our choice: it asks nothing of the solver. Rest angles are the
/// template's. The best round is kept.
///
/// A thickness of the solver below 0 is what the garment keeps
/// where it rests on the body (simulation/contact/resting_gap.h), or what its edges need
/// (simulation/contact/contact_distance.h) where it rests nowhere. `told` hears after each round
/// how many there were and the mean error [m] of the best; where it returns false, that was the
/// last. Throws as make_cloth, create_solver and Solver::step; LogicError for options out of range.
RelaxedGarment relax_gravity(const HangingGarment& hanging, const ClothOptions& cloth = {},
                             const SolverOptions& solver = relaxing_solver(),
                             const RelaxGravityOptions& options = {}, Device device = Device::Cpu,
                             const std::function<bool(int rounds, double error)>& told = {});

}  // namespace atelier
