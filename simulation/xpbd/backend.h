#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
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

/// Throws LogicError for a state that is not of `particles`, DataError for one with a position or a
/// velocity that is not finite.
void check_state(const ClothState& state, int particles);

/// Throws DataError: a vertex that is not finite after a frame.
[[noreturn]] void throw_not_finite(std::int64_t frame, int vertex);

/// The same for the first vertex of `positions` that is not finite.
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
  double substep = 1;                                ///< s
};

/// Strain, energy and, where multipliers are known, residuals.
FrameReport report_state(const Cloth& cloth, const ClothVariation& variation,
                         const ClothState& state, const LastMultipliers& last, FrameReport report);

/// A cloth as its exact counts take it.
CountedCloth counted_cloth(const Cloth& cloth, const Triangles& body_faces,
                           const XpbdOptions& options);

/// Whether the frame's crossings and gaps are to be counted, by its control or the options.
inline bool counts_due(const CommonSolverOptions& options, const Control& control,
                       std::int64_t frame) {
  return control.exact_counts ||
         (options.intersection_interval > 0 && frame % options.intersection_interval == 0);
}

/// Of which a frame is reported.
struct ReportedCloth {
  const Cloth& cloth;
  const CountedCloth& counted;
  const CommonSolverOptions& options;
};

/// The report of a frame with what options and control ask for, of a solver without multipliers;
/// `state()` at its end is asked for where that takes it.
template <class StateOf>
FrameReport reported(FrameReport report, const ReportedCloth& of, const Control& control,
                     const StateOf& state) {
  const bool counts = counts_due(of.options, control, report.frame);
  if (!of.options.report && !counts) {
    return report;
  }
  const ClothState& end = state();
  if (of.options.report) {
    report = report_state(of.cloth, {}, end, {}, report);
  }
  return counts ? with_exact_counts(report, of.counted, end.positions, control) : report;
}

/// Counts a vertex that is `depth` m inside the body, if it is.
inline void note_depth(FrameReport& report, double depth) {
  report.penetrating += depth > 0 ? 1 : 0;
  report.penetration_depth = std::max(report.penetration_depth, depth);
}

/// Force in each spring from the multipliers (per constraint of the schedule's order) of a substep.
std::vector<double> spring_forces_of(const Cloth& cloth, const std::vector<double>& lambda,
                                     double substep);

}  // namespace atelier
