#include "simulation/solver.h"

#include <array>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/nearest_name.h"
#include "simulation/projective/projective.h"
#include "simulation/projective/projective_cuda.h"
#include "simulation/xpbd/xpbd.h"

namespace atelier {
namespace {

class XpbdSolver final : public Solver {
 public:
  XpbdSolver(const SimulationModel& model, const SolverOptions& options, Device device)
      : Solver(options.name, device),
        solver_(model.cloth, model.body_faces, xpbd_options(options), device) {}

  void set_state(const ClothState& state) override { solver_.set_state(state); }
  ClothState state() const override { return solver_.state(); }
  FrameReport step(const Control& control) override { return solver_.advance(control); }

 private:
  ClothSolver solver_;
};

class XpbdBatch final : public SolverBatch {
 public:
  XpbdBatch(const SimulationModel& model, const std::vector<ClothVariation>& variations,
            const SolverOptions& options, Device device)
      : sweep_(model.cloth, variations, model.body_faces, xpbd_options(options), device) {}

  int scene_count() const override { return sweep_.scene_count(); }
  void set_state(int scene, const ClothState& state) override { sweep_.set_state(scene, state); }
  ClothState state(int scene) const override { return sweep_.state(scene); }
  std::vector<FrameReport> step(const Control& control) override { return sweep_.advance(control); }

 private:
  ClothSweep sweep_;
};

/// `Implementation`: ProjectiveSolver or ProjectiveCudaSolver.
template <class Implementation>
class ProjectiveFrictionSolver final : public Solver {
 public:
  ProjectiveFrictionSolver(const SimulationModel& model, const SolverOptions& options,
                           Device device)
      : Solver(options.name, device), solver_(model.cloth, model.body_faces, options) {}

  void set_state(const ClothState& state) override { solver_.set_state(state); }
  ClothState state() const override { return solver_.state(); }
  FrameReport step(const Control& control) override { return solver_.advance(control); }

 private:
  Implementation solver_;
};

std::unique_ptr<Solver> projective_friction(const SimulationModel& model,
                                            const SolverOptions& options, Device device) {
  const std::string conflict = solver_conflict(options, device);
  ATELIER_CHECK(conflict.empty(), conflict);
  if (device == Device::Cuda) {
    ATELIER_CHECK(model.cloth.curvatures.empty(),
                  "curvatures of vertices are solved on the CPU alone");
    return std::make_unique<ProjectiveFrictionSolver<ProjectiveCudaSolver>>(model, options, device);
  }
  return std::make_unique<ProjectiveFrictionSolver<ProjectiveSolver>>(model, options, device);
}

/// The cloth with a variation's factors on its stiffness.
Cloth varied(Cloth cloth, const ClothVariation& variation) {
  ATELIER_CHECK(std::isfinite(variation.stretch) && variation.stretch > 0 &&
                    std::isfinite(variation.bending) && variation.bending > 0,
                "factors of a variation are above 0");
  for (ClothSpring& s : cloth.springs) {
    s.stiffness *= variation.stretch;
  }
  for (ClothHinge& h : cloth.hinges) {
    h.stiffness *= variation.bending;
  }
  for (ClothStrain& s : cloth.strains) {
    s.warp *= variation.stretch;
    s.weft *= variation.stretch;
    s.shear *= variation.stretch;
  }
  return cloth;
}

class ProjectiveFrictionBatch final : public SolverBatch {
 public:
  ProjectiveFrictionBatch(const SimulationModel& model,
                          const std::vector<ClothVariation>& variations,
                          const SolverOptions& options, Device device) {
    ATELIER_CHECK(!variations.empty(), "a sweep of no scenes");
    for (const ClothVariation& variation : variations) {
      SolverOptions own = options;
      own.friction = variation.friction >= 0 ? variation.friction : options.friction;
      const SimulationModel scene{varied(model.cloth, variation), model.body_faces};
      scenes_.push_back(projective_friction(scene, own, device));
    }
  }

  int scene_count() const override { return static_cast<int>(scenes_.size()); }
  void set_state(int scene, const ClothState& state) override { at(scene).set_state(state); }
  ClothState state(int scene) const override { return at(scene).state(); }
  std::vector<FrameReport> step(const Control& control) override {
    std::vector<FrameReport> reports;
    for (const std::unique_ptr<Solver>& scene : scenes_) {
      reports.push_back(scene->step(control));
    }
    return reports;
  }

 private:
  Solver& at(int scene) const {
    ATELIER_CHECK(scene >= 0 && scene < scene_count(),
                  "scene " + std::to_string(scene) + " of the sweep");
    return *scenes_[static_cast<std::size_t>(scene)];
  }

  std::vector<std::unique_ptr<Solver>> scenes_;
};

/// How one solver is created.
struct SolverRow {
  const char* name;
  std::unique_ptr<Solver> (*solver)(const SimulationModel& model, const SolverOptions& options,
                                    Device device);
  std::unique_ptr<SolverBatch> (*batch)(const SimulationModel& model,
                                        const std::vector<ClothVariation>& variations,
                                        const SolverOptions& options, Device device);
};

constexpr std::array kSolverRows = {
    SolverRow{"xpbd",
              [](const SimulationModel& model, const SolverOptions& options,
                 Device device) -> std::unique_ptr<Solver> {
                return std::make_unique<XpbdSolver>(model, options, device);
              },
              [](const SimulationModel& model, const std::vector<ClothVariation>& variations,
                 const SolverOptions& options, Device device) -> std::unique_ptr<SolverBatch> {
                return std::make_unique<XpbdBatch>(model, variations, options, device);
              }},
    SolverRow{"projective-friction", projective_friction,
              [](const SimulationModel& model, const std::vector<ClothVariation>& variations,
                 const SolverOptions& options, Device device) -> std::unique_ptr<SolverBatch> {
                return std::make_unique<ProjectiveFrictionBatch>(model, variations, options,
                                                                 device);
              }}};

const SolverRow& solver_row(const std::string& name) {
  for (const SolverRow& row : kSolverRows) {
    if (row.name == name) {
      return row;
    }
  }
  std::string known;
  for (const std::string& one : solver_names()) {
    known += (known.empty() ? "" : ", ") + one;
  }
  throw DataError("", "solver", "'" + name + "'", known + did_you_mean(name, solver_names()));
}

}  // namespace

std::vector<std::string> solver_names() {
  std::vector<std::string> names;
  for (const SolverRow& row : kSolverRows) {
    names.emplace_back(row.name);
  }
  return names;
}

std::unique_ptr<Solver> create_solver(const SimulationModel& model, const SolverOptions& options,
                                      Device device) {
  return solver_row(options.name).solver(model, options, device);
}

std::unique_ptr<SolverBatch> create_solver_batch(const SimulationModel& model,
                                                 const std::vector<ClothVariation>& variations,
                                                 const SolverOptions& options, Device device) {
  return solver_row(options.name).batch(model, variations, options, device);
}

ClothState step(const SimulationModel& model, const ClothState& state, const Control& control,
                const SolverOptions& options, Device device) {
  const std::unique_ptr<Solver> solver = create_solver(model, options, device);
  solver->set_state(state);
  solver->step(control);
  return solver->state();
}

std::string solver_conflict(const SolverOptions& options, Device device) {
  return options.name == "xpbd" ? xpbd_conflict(xpbd_options(options), device) : "";
}

std::string option_without_effect(const SolverOptions& options, Device device) {
  if (options.name != "xpbd") {
    return options.projective.half_precision && device == Device::Cpu ? "half_precision" : "";
  }
  const XpbdMethodOptions usual;
  if (device != Device::Cpu) {
    return options.xpbd.vectors != usual.vectors ? "vectors" : "";
  }
  return options.xpbd.cuda_barrier != usual.cuda_barrier ? "cuda_barrier"
         : options.xpbd.cuda_blocks > usual.cuda_blocks  ? "cuda_blocks"
                                                         : "";
}

}  // namespace atelier
