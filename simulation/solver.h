#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/device.h"
#include "core/types.h"
#include "simulation/cloth/cloth.h"
#include "simulation/cloth/cloth_state.h"
#include "simulation/cloth/cloth_variation.h"
#include "simulation/cloth/frame_report.h"
#include "simulation/cloth/solver_options.h"

namespace atelier {

/// The part of a scene that does not change during a simulation.
struct SimulationModel {
  Cloth cloth;           ///< several garments are joined into one cloth, in layers: join_cloths
  Triangles body_faces;  ///< [F,3] over the body's vertices in Control; empty: no body
};

/// A cloth solver for one model. It keeps the state on its device; `step` advances it by one frame.
///
/// The state is everything that one frame passes to the next: positions and velocities. Given the
/// `state()` of another solver of the same model, options and device, a solver continues with
/// bitwise equal results, so that a saved state (cloth_state_archive.h) is a checkpoint. Other data
/// of a solver (trees, candidate pairs, factorisations) may affect its speed alone; multipliers are
/// reset in every frame.
class Solver {
 public:
  Solver(std::string name, Device device) : name_(std::move(name)), device_(device) {}
  virtual ~Solver() = default;
  Solver(const Solver&) = delete;
  Solver& operator=(const Solver&) = delete;

  const std::string& name() const { return name_; }
  Device device() const { return device_; }

  virtual void set_state(const ClothState& state) = 0;
  virtual ClothState state() const = 0;
  /// Advances by one frame. Throws DataError when a position is no longer finite (the message names
  /// vertex and frame; `state()` still returns the last good frame) or the body moves too far in a
  /// frame; EnvironmentError where a device's memory runs out; LogicError if sizes do not agree.
  virtual FrameReport step(const Control& control) = 0;

 private:
  std::string name_;
  Device device_;
};

/// A parameter sweep: many scenes of one cloth, solved at once, each with its own factors on the
/// material's values.
class SolverBatch {
 public:
  SolverBatch() = default;
  virtual ~SolverBatch() = default;
  SolverBatch(const SolverBatch&) = delete;
  SolverBatch& operator=(const SolverBatch&) = delete;

  virtual int scene_count() const = 0;
  virtual void set_state(int scene, const ClothState& state) = 0;
  virtual ClothState state(int scene) const = 0;
  /// Advances every scene by one frame. Without `report` in the options only the first scene has
  /// its numbers filled in. Throws as Solver::step.
  virtual std::vector<FrameReport> step(const Control& control) = 0;
};

/// Names of the available solvers.
std::vector<std::string> solver_names();

/// Creates the solver named `options.name`, in the model's rest state. It copies what it needs of
/// the model. Throws DataError for an unknown name (the message lists the available ones);
/// LogicError for options out of range or in conflict (solver_conflict); EnvironmentError where
/// CUDA was requested and is missing or its memory runs out.
std::unique_ptr<Solver> create_solver(const SimulationModel& model, const SolverOptions& options,
                                      Device device = Device::Cpu);

/// The same for many scenes; on CUDA they are solved in one launch. Also throws LogicError if there
/// is no variation or a factor is not above 0.
std::unique_ptr<SolverBatch> create_solver_batch(const SimulationModel& model,
                                                 const std::vector<ClothVariation>& variations,
                                                 const SolverOptions& options,
                                                 Device device = Device::Cpu);

/// Why these options, each in its range, conflict on that device; "" if they do not.
std::string solver_conflict(const SolverOptions& options, Device device);

/// The first of the solver's own options that was changed and has no effect on that device
/// ("cuda_barrier" on the CPU), or "".
std::string option_without_effect(const SolverOptions& options, Device device);

/// The state after one frame. It prepares the model in every call: for more than a few frames
/// create a Solver.
ClothState step(const SimulationModel& model, const ClothState& state, const Control& control,
                const SolverOptions& options = {}, Device device = Device::Cpu);

}  // namespace atelier
