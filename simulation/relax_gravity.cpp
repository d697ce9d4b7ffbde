#include "simulation/relax_gravity.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "simulation/contact_distance.h"
#include "simulation/resting_gap.h"

namespace atelier {
namespace {

/// Where the vertices are after some time, from the captured shape on.
Points hung(const Cloth& cloth, const Points& from, const Points& body, const Triangles& body_faces,
            const XpbdOptions& solver, double seconds, Device device) {
  ClothSolver simulation(cloth, body_faces, solver, device);
  ClothState state = rest_state(cloth);
  state.positions = from;
  simulation.set_state(state);
  Control control;
  control.body_start = control.body_end = body;
  control.pin_targets = from;
  const auto frames = static_cast<int>(std::lround(seconds / solver.time_step));
  for (int frame = 0; frame < std::max(1, frames); ++frame) {
    simulation.advance(control);
  }
  return simulation.state().positions;
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

RelaxedGarment relax_gravity(const Garment& captured, const std::vector<int>& pins,
                             const Points& body, const Triangles& body_faces,
                             const ClothOptions& cloth_options, const XpbdOptions& solver_options,
                             const RelaxGravityOptions& options, Device device,
                             const std::function<bool(int rounds, double error)>& told) {
  ATELIER_CHECK(options.rounds >= 1 && options.seconds > 0 && options.step > 0 &&
                    options.step <= 1 && options.damping >= 0,
                "relax_gravity options out of range");
  ClothOptions how = cloth_options;
  how.rest_angles = "template";
  XpbdOptions solver = solver_options;
  solver.velocity_damping = options.damping;
  solver.report = false;
  solver.intersection_interval = 0;
  if (solver.thickness < 0 && body.rows() > 0) {
    // Kept nearer than where it was seen to rest, it would begin in the air and fall; no template
    // takes a fall back.
    constexpr double kMost = 0.02;  // m
    solver.thickness = std::clamp(
        resting_gap(captured.mesh.vertices, body, body_faces, contact_distance(captured)),
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
    const Cloth cloth = make_cloth(rest, pins, how);
    const Points moved =
        hung(cloth, target, body, body_faces, solver, options.seconds, device) - target;
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
