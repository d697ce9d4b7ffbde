#pragma once

#include <exception>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/device.h"
#include "core/finding.h"
#include "core/garment.h"
#include "core/sequence.h"
#include "pipeline/outfit/held_cloth.h"
#include "simulation/material/resolve_material.h"
#include "simulation/relax_gravity.h"
#include "simulation/solver.h"

namespace atelier {

/// How clothes are solved unless something else is said: the body and their own contacts count, and
/// exact counts are made of some frames.
inline SolverOptions scene_solver_options() {
  SolverOptions solver;
  solver.substeps = 30;
  solver.self_contact = true;
  solver.intersection_interval = 10;
  return solver;
}

/// Options of `simulate` beside the files; the same for the stage and for the command alone.
struct SimulateOptions {
  double fps = 60;           ///< simulated frames a second, 1 to 10000
  int settle = 60;           ///< frames on the first body before it moves
  int length = 0;            ///< frames in all; 0: as long as the body moves
  double body_fps = 0;       ///< of body meshes, 0: what they say, else `fps`
  double fall_in = 1;        ///< s from the rest pose to a motion's first pose
  std::string holding = "";  ///< what holds the garments: "" as the scene says, none, or a file
  double pin_top = 0;        ///< m below the garment's highest vertex that move with the body
  double scale = 1;          ///< of the garment's file, to metres; of several the same
  double move_x = 0;         ///< m, of the scaled garment; of several all of them
  double move_y = 0;         ///< m
  double move_z = 0;         ///< m
  bool flat_rest = false;    ///< texture coordinates are the flat rest shape, in metres
  bool relax = false;        ///< the garment is captured: its weight has stretched it
  RelaxGravityOptions relaxing;
  bool sewn = true;                            ///< seams of the garment are closed before it moves
  ClothOptions cloth;                          ///< with `relax`, rest angles are the template's
  std::vector<double> wind;                    ///< m/s, three numbers, or none
  Material material = fabrics_own_material();  ///< what is said of it, see resolve_material
  /// Always with a report, so its counts are a part of the result.
  SolverOptions solver = scene_solver_options();
};
OptionTable describe(SimulateOptions& options);

/// Prefix of the notes of a scene that are doubts about it.
inline const std::string kWarning = "warning: ";

/// How near a relaxed garment hangs to the captured one, as a sentence.
std::string relaxed_text(const RelaxedGarment& relaxed, double seconds);

/// Files of a scene. Empty: none.
struct ScenePaths {
  std::vector<std::filesystem::path> garments;  ///< from the inside out
  std::filesystem::path body;    ///< mesh, folder of meshes, sequence, body model, "female", "male"
  std::filesystem::path motion;  ///< of a body model
  std::filesystem::path holding;   ///< what holds the garments (holding.toml)
  std::filesystem::path captured;  ///< where they were captured, a sequence at the body's frames
};

/// The files of a scene in a folder: garment.*, body.* or body/, motion.*, holding.toml, captured/.
/// Throws DataError.
ScenePaths scene_in(const std::filesystem::path& folder);

/// Garments of one material and the body that they hang on.
struct SimulationScene {
  std::vector<Garment> garments;               ///< from the inside out; each named by its file
  std::vector<std::string> names;              ///< of each, short and different: "skirt"
  std::vector<Index> first;                    ///< first vertex of each in the cloth, and the end
  Points start;                                ///< [V,3] m, where they begin
  std::vector<std::vector<HeldRing>> holding;  ///< of each garment, or none at all
  std::vector<RingPlace> places;               ///< of all rings, in the cloth of all
  HeldCloth held;                              ///< of the cloth of all
  Triangles body_faces;                        ///< no rows: no body
  Index frame_count = 0;
  std::function<Points(Index frame)> body;  ///< vertices at the end of a simulated frame; 0: start
  double thickness = -1;                    ///< m kept from the body; below 0: the material's
  std::vector<std::string> notes;           ///< doubts begin with kWarning
};

/// Reads only the wearer: the moving body, and how many frames there are. Throws DataError for
/// files that do not fit each other, UsageError where there is nothing to simulate.
SimulationScene read_scene_body(const ScenePaths& paths, const SimulateOptions& options);

/// Reads a scene; a garment is a mesh or an archive (core/garment_archive.h). With
/// SimulateOptions::relax the garment (one alone) is the unloaded one that hangs as captured, on
/// the body of the first frame, and `start` is the captured shape; that is simulated on `device`,
/// as the scene will be. Throws DataError for files that do not fit each other, UsageError, as
/// early as it is known, for options that contradict each other or would do nothing
/// (scene_check.h), and EnvironmentError for a device that is not there.
SimulationScene read_scene(const ScenePaths& paths, const SimulateOptions& options, Device device);

/// The garments where `positions` [V,3] of the scene's cloth are.
std::vector<Mesh> garment_meshes(const SimulationScene& scene, const Points& positions);

/// The scene's cloth (of several garments one, in layers) and body, the state that it begins in,
/// and the options of its solver.
SimulationModel scene_model(const SimulationScene& scene, const SimulateOptions& options);
ClothState scene_start(const SimulationScene& scene, const Cloth& cloth);
SolverOptions scene_solver(const SimulationScene& scene, const SimulateOptions& options);

/// The phase of simulated frame `frame`, counted from 1.
Control scene_control(const SimulationScene& scene, const SimulateOptions& options, Index frame);

/// Simulates that frame. Errors that end it (a body that teleports, a state that is no number, a
/// device without memory) are thrown with the frame and the file it is about.
FrameReport advance_scene(Solver& solver, const SimulationScene& scene,
                          const SimulateOptions& options, Index frame, const ScenePaths& paths);

/// Throws again what ended a run, with what has become of the frames before behind what it says:
/// "; frames before it are in out".
[[noreturn]] void throw_with(const std::exception_ptr& failure, const std::string& kept);

}  // namespace atelier
