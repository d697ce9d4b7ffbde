#include "simulation/relax_gravity.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "core/error.h"
#include "core/saturating_cast.h"
#include "simulation/contact/contact_distance.h"
#include "simulation/contact/resting_gap.h"

namespace atelier {
namespace {

/// Where the vertices are after some time, from the captured shape on.
Points hung(const HangingGarment& hanging, const SimulationModel& model,
            const SolverOptions& options, double seconds, Device device) {
  const Points& from = hanging.captured.mesh.vertices;
  const std::unique_ptr<Solver> solver = create_solver(model, options, device);
  ClothState state = rest_state(model.cloth);
  state.positions = from;
  solver->set_state(state);
  Control control;
  control.body_start = control.body_end = hanging.body;
  control.pin_targets = from;
  const auto frames = saturating_cast<int>(std::round(seconds / options.time_step));
  for (int frame = 0; frame < std::max(1, frames); ++frame) {
    solver->step(control);
  }
  return solver->state().positions;
}

}  // namespace

OptionTable describe(RelaxGravityOptions& options) {
  OptionTable table;
  table.add("rounds", options.rounds, 1, 1000, "",
            "Maximum number of rounds of simulation and correction");
  table.add("seconds", options.seconds, 0.05, 60, "s", "Simulated time of each round");
  table.add("damping", options.damping, 0, 1000, "1/s",
            "Velocity damping, such that cloth comes to rest within a round");
  table.add("step", options.step, 0.05, 1, "", "Fraction of the error that a round corrects");
  table.add("tolerance", options.tolerance, 0, 1, "m",
            "Mean distance to the captured shape below which the relaxation has converged");
  return table;
}

RelaxedGarment relax_gravity(const HangingGarment& hanging, const ClothOptions& cloth_options,
                             const SolverOptions& solver_options,
                             const RelaxGravityOptions& options, Device device,
                             const std::function<bool(int rounds, double error)>& told) {
  const Garment& captured = hanging.captured;
  ATELIER_CHECK(options.rounds >= 1 && options.seconds > 0 && options.step > 0 &&
                    options.step <= 1 && options.damping >= 0,
                "relax_gravity options out of range");
  ClothOptions how = cloth_options;
  how.rest_angles = "template";
  SolverOptions solver = solver_options;
  solver.velocity_damping = options.damping;
  solver.report = false;
  solver.intersection_interval = 0;
  if (solver.thickness < 0 && hanging.body.rows() > 0) {
    // Kept nearer than where it was seen to rest, it would begin in the air and fall; no template
    // takes a fall back.
    constexpr double kMost = 0.02;  // m
    solver.thickness = std::clamp(resting_gap(captured.mesh.vertices, hanging.body,
                                              hanging.body_faces, contact_distance(captured)),
                                  std::min(captured.material.thickness, kMost), kMost);
  }
  const Points target = captured.mesh.vertices;
  Garment rest = captured;
  rest.rest.resize(0, 2);
  rest.rest_faces.resize(0, 3);
  RelaxedGarment best;
  best.mean_error = std::numeric_limits<double>::infinity();
  best.gap = solver.thickness >= 0 ? solver.thickness : captured.material.thickness;
  double step = options.step;
  Points best_moved;
  for (int round = 0; round < options.rounds && !best.converged; ++round) {
    const SimulationModel model{make_cloth(rest, hanging.pins, how), hanging.body_faces};
    const Points moved = hung(hanging, model, solver, options.seconds, device) - target;
    const Eigen::VectorXd errors = moved.rowwise().norm();
    if (errors.mean() < best.mean_error) {
      best.garment = rest;
      best.mean_error = errors.mean();
      best.largest_error = errors.maxCoeff();
      best_moved = moved;
    } else {
      step = std::max(step / 2, 0.02);  // it went too far: less, from the best so far
    }
    best.rounds = round + 1;
    best.converged = best.mean_error <= options.tolerance;
    if (told && !told(best.rounds, best.mean_error)) {
      break;
    }
    rest.mesh.vertices = best.garment.mesh.vertices - step * best_moved;
  }
  return best;
}

}  // namespace atelier
