#include "pipeline/garment/simulated_prediction.h"

#include <memory>

#include "core/error.h"
#include "core/garment.h"
#include "simulation/solver.h"

namespace atelier {

Points simulated_prediction(const Triangles& faces, const std::vector<char>& free,
                            const ClothStep& step, const SteppingBody& body, double seconds) {
  constexpr int kParts = 5;  // in each of which the body moves straight on
  constexpr int kSubsteps = 12;
  constexpr double kContact = 0.003;  // m
  ATELIER_CHECK(seconds > 0 && std::ssize(free) == step.vertices.rows(), "a step of this cloth");
  std::vector<int> pins;
  for (std::size_t v = 0; v < free.size(); ++v) {
    if (free[v] == 0) {
      pins.push_back(static_cast<int>(v));
    }
  }
  if (pins.empty() || pins.size() == free.size() || step.before.rows() == 0) {
    return {};
  }
  Garment garment;
  garment.mesh.vertices = step.vertices;
  garment.mesh.faces = faces;
  SolverOptions options;
  options.time_step = seconds / kParts;
  options.substeps = kSubsteps;
  options.thickness = kContact;
  options.report = false;
  try {
    SimulationModel model{make_cloth(garment, pins), body.faces};
    ClothState state = rest_state(model.cloth);
    state.velocities = (step.predicted - step.vertices) / seconds;
    for (Index v = 0; v < state.velocities.rows(); ++v) {
      const Eigen::RowVector3d seen = (step.vertices.row(v) - step.before.row(v)) / seconds;
      state.velocities.row(v) += step.confidence[v] * (seen - state.velocities.row(v));
    }
    const std::unique_ptr<Solver> solver = create_solver(model, options);
    solver->set_state(state);
    for (int part = 0; part < kParts; ++part) {
      const double from = static_cast<double>(part) / kParts;
      const double to = static_cast<double>(part + 1) / kParts;
      Control control;
      control.body_start = body.start + from * (body.end - body.start);
      control.body_end = body.start + to * (body.end - body.start);
      control.pin_targets = step.vertices + to * (step.predicted - step.vertices);
      solver->step(control);
    }
    Points end = solver->state().positions;
    return end.allFinite() ? end : Points();
  } catch (const DataError&) {  // triangles too thin, or it flew apart
    return {};
  }
}

}  // namespace atelier
