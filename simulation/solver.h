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

/// What does not change while it is simulated.
struct SimulationModel {
  Cloth cloth;           ///< of several garments one, in layers: join_cloths
  Triangles body_faces;  ///< [F,3] over the body's vertices in Control; none: no body
};

/// A solver of cloth at work on one model: it keeps the state on its device, where `step` moves it
/// on by a frame.
///
/// The state is all that one frame hands to the next. A solver that was given the `state()` of
/// another one of the same model, options and device goes on with the same bits, so that writing it
/// down (cloth_state_archive.h) is a checkpoint. What a solver keeps beside it (trees, candidate
/// pairs, factorisations) may change its speed alone; one whose unknowns are velocities finds them
/// there, and multipliers begin anew in every frame.
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
  /// One frame. Throws DataError when a position is no longer finite (the vertex and frame are
  /// named; `state()` still gives the last good frame) or the body moves too far in a frame;
  /// EnvironmentError where a device's memory runs out; LogicError if sizes do not agree.
  virtual FrameReport step(const Control& control) = 0;

 private:
  std::string name_;
  Device device_;
};

/// Many scenes of one cloth at once, each with its factors on the material: a parameter sweep.
class SolverBatch {
 public:
  SolverBatch() = default;
  virtual ~SolverBatch() = default;
  SolverBatch(const SolverBatch&) = delete;
  SolverBatch& operator=(const SolverBatch&) = delete;

  virtual int scene_count() const = 0;
  virtual void set_state(int scene, const ClothState& state) = 0;
  virtual ClothState state(int scene) const = 0;
  /// One frame of every scene; without `report` in the options only the first has numbers. Throws
  /// as Solver::step.
  virtual std::vector<FrameReport> step(const Control& control) = 0;
};

/// The solvers there are.
std::vector<std::string> solver_names();

/// The solver that `options.name` says, in the model's rest state. It keeps what it needs of the
/// model. Throws DataError, with the names there are, for an unknown one; LogicError for options
/// out of range or in conflict (solver_conflict); EnvironmentError where CUDA was asked for and is
/// missing or its memory runs out.
std::unique_ptr<Solver> create_solver(const SimulationModel& model, const SolverOptions& options,
                                      Device device = Device::Cpu);

/// The same for many scenes; on CUDA they are solved in one launch. Throws LogicError, too, if
/// there is no variation or a factor is not above 0.
std::unique_ptr<SolverBatch> create_solver_batch(const SimulationModel& model,
                                                 const std::vector<ClothVariation>& variations,
                                                 const SolverOptions& options,
                                                 Device device = Device::Cpu);

/// "", or why these options, each in its range, do not work together on that device.
std::string solver_conflict(const SolverOptions& options, Device device);

/// The first of the solver's own fields that was changed and does nothing on that device
/// ("cuda_barrier" on the CPU), or "".
std::string idle_on_device(const SolverOptions& options, Device device);

/// One frame, once: for more than a few frames create a Solver, which prepares the model once.
ClothState step(const SimulationModel& model, const ClothState& state, const Control& control,
                const SolverOptions& options = {}, Device device = Device::Cpu);

}  // namespace atelier
