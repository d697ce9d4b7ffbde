#pragma once

#include <memory>

#include "simulation/cloth/cloth.h"
#include "simulation/cloth/cloth_state.h"
#include "simulation/cloth/frame_report.h"
#include "simulation/cloth/solver_options.h"

namespace atelier {

/// Projective dynamics with dry frictional contact (projective.h) on a CUDA device, the twin of
/// ProjectiveSolver: in double precision, but for the solution of an iteration, by the inverse of
/// the factor (inverse_factor.h), in half precision where that serves, else in float; the next
/// iteration mends what it rounds. Repeats give the same bits.
class ProjectiveCudaSolver {
 public:
  /// Throws as ProjectiveSolver; EnvironmentError where there is no CUDA or its memory runs out.
  ProjectiveCudaSolver(const Cloth& cloth, const Triangles& body_faces,
                       const SolverOptions& options);
  ~ProjectiveCudaSolver();
  ProjectiveCudaSolver(ProjectiveCudaSolver&&) noexcept;
  ProjectiveCudaSolver& operator=(ProjectiveCudaSolver&&) noexcept;

  void set_state(const ClothState& state);
  ClothState state() const;
  /// One frame; throws as Solver::step.
  FrameReport advance(const Control& control);

 private:
  struct Scene;
  std::unique_ptr<Scene> scene_;
};

}  // namespace atelier
