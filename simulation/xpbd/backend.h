#pragma once

#include <array>
#include <memory>
#include <vector>

#include "simulation/xpbd/xpbd.h"

namespace atelier {

/// The interface of ClothSolver and ClothSweep to a device: one scene on the CPU, many on CUDA.
struct ClothSolver::Backend {
  virtual ~Backend() = default;
  virtual int scene_count() const = 0;
  virtual void set_state(int scene, const ClothState& state) = 0;
  virtual ClothState state(int scene) const = 0;
  virtual std::vector<FrameReport> advance(const Control& control) = 0;
  virtual std::vector<double> spring_forces(int scene) const = 0;
};

std::unique_ptr<ClothSolver::Backend> make_cpu_backend(const Cloth& cloth,
                                                       const ClothVariation& variation,
                                                       const Triangles& body_faces,
                                                       const XpbdOptions& options);
/// Throws EnvironmentError where there is no CUDA.
std::unique_ptr<ClothSolver::Backend> make_cuda_backend(
    const Cloth& cloth, const std::vector<ClothVariation>& variations, const Triangles& body_faces,
    const XpbdOptions& options);

/// Checks shared by the backends: sizes of control against cloth and body, finite numbers, and a
/// body that does not teleport in `time_step` [s].
void check_control(const Control& control, const Cloth& cloth, Index body_vertices,
                   double time_step);

/// Throws DataError naming the first vertex of `positions` that is not finite.
void check_finite(const Points& positions, std::int64_t frame);

/// Pin targets of the frame for every vertex: from `pin_targets`, else from attachments and the
/// body at the end of the frame, else where the vertex is.
Points pin_targets_of(const Cloth& cloth, const Control& control, const Triangles& body_faces,
                      const Points& positions);

/// Accelerations of air on every vertex [m/s2] at the start of a frame: drag and lift per triangle
/// (force 1/2 rho A |u|^2 (drag, lift) as in Wejchert and Haumann 1991), limited so that a frame
/// never turns the relative motion round.
Points air_accelerations(const Cloth& cloth, const ClothState& state, const Control& control,
                         const XpbdOptions& options);

/// Multipliers of the last substep of a frame; none: not known.
struct LastMultipliers {
  std::vector<double> lambda;                        ///< of each constraint of the schedule's order
  std::vector<std::array<double, 3>> strain_lambda;  ///< of each strain (warp, weft, shear)
  double substep;                                    ///< s
};

/// Strain, energy and, where multipliers are known, residuals.
FrameReport report_state(const Cloth& cloth, const ClothVariation& variation,
                         const ClothState& state, const LastMultipliers& last, FrameReport report);

/// Force in each spring from the multipliers (per constraint of the schedule's order) of a substep.
std::vector<double> spring_forces_of(const Cloth& cloth, const std::vector<double>& lambda,
                                     double substep);

}  // namespace atelier
