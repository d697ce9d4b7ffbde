#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/device.h"
#include "core/options.h"
#include "simulation/cloth/cloth.h"
#include "simulation/cloth/cloth_state.h"
#include "simulation/cloth/cloth_variation.h"
#include "simulation/cloth/frame_report.h"
#include "simulation/cloth/solver_options.h"
#include "simulation/contact/exact_counts.h"

namespace atelier {

/// How the cloth is solved: XPBD (Macklin et al. 2016) with small substeps (Macklin et al. 2019).
struct XpbdOptions : CommonSolverOptions, XpbdMethodOptions {};
OptionTable describe(XpbdOptions& options);

/// Parameters of XPBD from `options`.
XpbdOptions xpbd_options(const SolverOptions& options);

/// "", or why these options, each in its range, do not work together on that device.
std::string xpbd_conflict(const XpbdOptions& options, Device device);

/// Steps a cloth through time and keeps it on its device between frames.
///
/// Throws DataError when a position is no longer finite (the vertex and frame are named; `state()`
/// still gives the last good frame) or a body vertex moves further in a frame than `body_jump`
/// allows; EnvironmentError where CUDA was asked for and is missing or its memory runs out;
/// LogicError if sizes do not agree.
class ClothSolver {
 public:
  /// `body_faces`: the body that Control moves, or no rows.
  ClothSolver(const Cloth& cloth, const Triangles& body_faces, const XpbdOptions& options,
              Device device = Device::Cpu);
  ~ClothSolver();
  ClothSolver(ClothSolver&&) noexcept;
  ClothSolver& operator=(ClothSolver&&) noexcept;

  void set_state(const ClothState& state);
  ClothState state() const;
  /// One frame.
  FrameReport advance(const Control& control);
  /// Force in each spring [N], positive in tension, of the last substep.
  std::vector<double> spring_forces() const;

  struct Backend;

 private:
  std::unique_ptr<Backend> backend_;
  CountedCloth counted_;
  CommonSolverOptions options_;
};

/// Many scenes of one cloth at once, on CUDA in one launch: a parameter sweep.
class ClothSweep {
 public:
  /// Throws LogicError if there is no variation or a factor is not above 0.
  ClothSweep(const Cloth& cloth, const std::vector<ClothVariation>& variations,
             const Triangles& body_faces, const XpbdOptions& options, Device device = Device::Cpu);
  ~ClothSweep();
  ClothSweep(ClothSweep&&) noexcept;
  ClothSweep& operator=(ClothSweep&&) noexcept;

  int scene_count() const;
  void set_state(int scene, const ClothState& state);
  ClothState state(int scene) const;
  /// One frame of every scene; without `report` in the options only the first has numbers.
  std::vector<FrameReport> advance(const Control& control);

 private:
  std::vector<std::unique_ptr<ClothSolver::Backend>> backends_;
};

}  // namespace atelier
