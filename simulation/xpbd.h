#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/device.h"
#include "core/options.h"
#include "simulation/cloth.h"
#include "simulation/frame_report.h"

namespace atelier {

/// How the cloth is solved: XPBD (Macklin et al. 2016) with small substeps (Macklin et al. 2019).
struct XpbdOptions {
  double time_step = 1.0 / 60;  ///< s, one frame, 1e-5 to 1
  int substeps = 10;   ///< per frame, 1 to 10000; the first thing to raise for stiffer cloth
  int iterations = 1;  ///< per substep, 1 to 100000; substeps are nearly always better
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
  /// Changes the speed alone: who leaves its flight is searched for again at any time.
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
OptionTable describe(XpbdOptions& options);

/// "", or why these options, each in its range, do not work together on that device.
std::string xpbd_conflict(const XpbdOptions& options, Device device);

/// What changes from frame to frame. Rows are the cloth's vertices. Numbers of the float solver are
/// exactly representable here, so a state written and read back continues with the same bits.
struct ClothState {
  Points positions;        ///< [V,3] m
  Points velocities;       ///< [V,3] m/s
  std::int64_t frame = 0;  ///< frames done
};

/// The cloth at rest in its template shape.
ClothState rest_state(const Cloth& cloth);

/// What the world does during one frame.
struct Control {
  Eigen::Vector3d gravity{0, -9.81, 0};  ///< m/s2
  Eigen::Vector3d wind{0, 0, 0};         ///< m/s
  Points wind_field;                     ///< [V,3] m/s at each vertex, added to `wind`, or empty
  Points body_start;   ///< [B,3] body vertices at the start of the frame, or empty: no body
  Points body_end;     ///< [B,3] at its end; the body moves linearly between
  Points pin_targets;  ///< [V,3] where fixed vertices are at the end of the frame (other rows are
                       ///< not read), or empty: they stay, or ride on the body by their attachments
  bool exact_counts = false;  ///< count in this frame, whatever `intersection_interval` says
};

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
  Triangles faces_;
  Triangles body_faces_;
  int intersection_interval_ = 0;
  double thickness_ = 0;
  double self_thickness_ = 0;  ///< 0: no contact of the cloth with itself
  Points rest_positions_;
  std::vector<int> layer_;
};

/// One scene of a sweep: factors on the cloth's material.
struct ClothVariation {
  double stretch = 1;    ///< times the stiffness of every spring and strain, above 0
  double bending = 1;    ///< times the stiffness of every hinge, above 0
  double friction = -1;  ///< against the body; below 0: as in the options
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

/// One frame, once: for more than a few frames use ClothSolver.
ClothState step(const Cloth& cloth, const ClothState& state, const Control& control,
                const XpbdOptions& options = {}, const Triangles& body_faces = {});

}  // namespace atelier
