#pragma once

#include <string>
#include <vector>

#include "core/device.h"
#include "core/options.h"

namespace atelier {

/// Options that mean the same to every solver of cloth; where it says XPBD, others do without.
struct CommonSolverOptions {
  double time_step = 1.0 / 60;  ///< s, one frame, 1e-5 to 1
  int substeps = 10;      ///< XPBD: per frame, 1 to 10000; the first to raise for stiffer cloth
  double friction = -1;   ///< Coulomb coefficient against the body; below 0: the material's
  double thickness = -1;  ///< m kept between cloth and body; below 0: the material's
  double contact_reach =
      0.02;  ///< m, least distance at which a frame looks for contacts, 0.001 to 0.5
  double depenetration_speed =
      1;  ///< m/s at most, out of an overlap that was there before, 0.01 to 100
  /// The body's sharp edges and corners meet the cloth's edges and triangles too, at half of the
  /// thickness (body_feature_math.h): fingers do not come through between vertices, and a frame
  /// costs a fifth more on the CPU, several times as much on a GPU. Off: its faces meet vertices.
  bool body_edges = false;
  bool self_contact = false;   ///< cloth against itself and other layers (`simulate` has it on)
  double self_thickness = -1;  ///< m kept between two sheets; below 0: the material's
  double self_friction = -1;   ///< below 0: the material's

  /// Substeps that a search for pairs of cloth looks ahead, at most 10000; 0: as suits the device.
  /// Changes the speed alone: a vertex that leaves its swept bound is searched for again at any
  /// time.
  int self_interval = 0;

  double air_density = 1.2;     ///< kg/m3, 0 to 10
  double drag = 0;              ///< coefficient normal to the cloth, 0 to 10; 1 for a plate
  double lift = 0;              ///< coefficient across the wind, 0 to 10
  double velocity_damping = 0;  ///< 1/s, slows every motion: only to reach rest sooner, 0 to 1000
  bool report = true;  ///< strain, residual and energy after every frame; costs a download on CUDA
  /// Exact counts, on the CPU, every n frames: crossings of the cloth with itself and with the
  /// body, vertices inside the body; 0: never.
  int intersection_interval = 0;
};

/// Options of XPBD alone (Macklin et al. 2016, with the small substeps of Macklin et al. 2019).
struct XpbdMethodOptions {
  int iterations = 1;               ///< per substep, 1 to 100000; substeps are nearly always better
  std::string precision = "float";  ///< "float", or "double" (for reference)
  /// "gauss-seidel" (in the order of the schedule) or "jacobi" (all constraints at once, with
  /// Chebyshev acceleration: for comparison; takes several times the iterations).
  std::string sweep = "gauss-seidel";
  /// Estimated spectral radius of a Jacobi iteration, 0 (no acceleration) to 0.9999; raise it with
  /// the iterations, lower it where the solution swings.
  double jacobi_radius = 0.9;
  /// CPU vector code, in float: "auto" (AVX2 where the processor has it), "scalar" or "avx2" (an
  /// error where it has none). They differ by rounding.
  std::string vectors = "auto";

  /// How the blocks of a GPU wait for each other: "auto", "block" (one block a scene), "cluster",
  /// "grid", or "graph" (a launch per phase, replayed). For measuring; auto takes the fastest.
  /// Clusters where the device and the build have them (compute capability 9.0), else
  /// EnvironmentError.
  std::string cuda_barrier = "auto";
  int cuda_blocks = 0;  ///< blocks of a scene, 0: as the barrier allows, up to 1024
};

/// Options of projective dynamics with dry friction alone (Ly et al. 2020).
struct ProjectiveMethodOptions {
  int substeps = 5;     ///< per frame, 1 to 10000
  int iterations = 20;  ///< local and global steps of a substep, 1 to 100000
  /// Iterations that Anderson's acceleration combines, 0 to 20; 0: none, as published.
  int acceleration = 5;
  double strain_limit = 0;  ///< of springs and yarns, 0 to 10; 0: no limit
  /// On a GPU, numbers of the inverse factor where half_precision_serves (inverse_factor.h).
  bool half_precision = false;
};

/// The table of what every solver understands, without a prefix.
OptionTable describe_common(CommonSolverOptions& common);
/// The same of XPBD's own: those of `method`, and common ones that no other solver understands.
OptionTable describe_xpbd(CommonSolverOptions& common, XpbdMethodOptions& method);
/// The same of projective dynamics.
OptionTable describe_projective(ProjectiveMethodOptions& method);

/// How cloth is solved: by which solver, what is common to all, and a struct for each solver.
struct SolverOptions : CommonSolverOptions {
  std::string name = "xpbd";  ///< one of solver_names()
  XpbdMethodOptions xpbd;
  ProjectiveMethodOptions projective;
};

/// The solver's name as "solver"; what is common to all, without a prefix: "friction"; the own
/// options of each with its name before theirs: "xpbd.substeps", "projective_friction.substeps".
/// `without`: common fields that the caller sets itself ("time_step"), which are left out.
OptionTable describe(SolverOptions& options, const std::vector<std::string>& without = {});

/// The flag of one field for the solver of `options`: "--self-contact" of "self_contact",
/// "--xpbd.substeps" of "substeps"; with `section` "cloth" they are "--cloth.self-contact" and
/// "--cloth.xpbd.substeps". "" of a field that this solver does not have.
std::string solver_flag(const std::string& field, const std::string& section = "",
                        const SolverOptions& options = {});

}  // namespace atelier
