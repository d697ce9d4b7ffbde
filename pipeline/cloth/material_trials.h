#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "capture/layouts/open_dataset.h"
#include "core/store/stage.h"
#include "pipeline/cloth/trial_garment.h"
#include "simulation/material/resolve_material.h"
#include "simulation/material/stiffness_search.h"

namespace atelier {

/// How trials are solved unless something else is said.
inline SolverOptions trial_solver_options() {
  SolverOptions solver;
  solver.substeps = solver.projective.substeps = 20;
  solver.report = false;
  return solver;
}

struct MaterialStageOptions {
  DatasetOptions capture;  ///< whose picture is beside the grid
  /// "fitted", or a fabric, whose values are then taken as they are.
  Material material = fabrics_own_material("fitted");
  StiffnessSearchOptions search = {.likelihood_width = 0.2, .prior = {}};
  bool use_prior = true;       ///< published fabrics decide what the capture leaves open
  double tracking_rate = 20;   ///< 1/s, how quickly cloth is led back to where it was seen, 1 to 60
  std::string sequence = "";   ///< of the capture; "": the first clothed one
  std::string holding = "";    ///< what holds the garments: "" as registered, none, or a file
  int frames = 12;             ///< of it that are simulated, 2 to 10000
  double edge_length = 0.035;  ///< m of the garments as they are tried, 0.005 to 0.2
  SolverOptions solver = trial_solver_options();  ///< self-contact is slow
};
OptionTable describe(MaterialStageOptions& options);

/// Everything that all trials share.
struct Trials {
  std::vector<TrialGarment> garments;
  Triangles body_faces;
  std::vector<Points> bodies;  ///< after each simulated frame, the start first
  std::vector<int> steps;      ///< after which the frames are compared
  std::vector<int> frame_ids;  ///< of these frames
  double tracking_rate = 0;    ///< 1/s
  WornClothOptions options;
};

/// Reads the body and the garments as all trials have them: one stretch of frames that follow each
/// other. Throws DataError where there are fewer than two.
Trials read_trials(StageRun& run, const std::vector<RegisteredGarmentSequence>& outfit);

/// How far each garment stays off where it was registered, m, steadily: its offset averaged over
/// patches and frames; infinite where the simulation broke. And where all are at the end.
struct SceneResult {
  std::vector<double> distances;
  Points end;  ///< [V,3] m; no rows where it broke
};

/// Simulates all garments, each with its stiffness, led along where they were registered.
SceneResult run_scene(const Trials& trials, const std::vector<Stiffness>& scene,
                      const std::atomic<bool>& stopped);

}  // namespace atelier
