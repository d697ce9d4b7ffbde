#include "pipeline/cloth/material_trials.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "bodymodel/formats/personal_body.h"
#include "bodymodel/formats/tracked_motion.h"
#include "core/error.h"
#include "core/saturating_cast.h"
#include "core/sequence_archive.h"
#include "pipeline/outfit/held_cloth.h"
#include "pipeline/person/tracked_take.h"
#include "simulation/cloth/solver_sections.h"

namespace atelier {
namespace {

constexpr double kRate = 60;  // simulated frames a second
constexpr int kSettling = 2;  // frames that cloth may take to find its lengths
/// m kept to the body. Less than triangles of this size need: they are led along the registered
/// surface, and what is more would lift them off it.
constexpr double kContact = 0.004;

/// The garments of one scene, at its stiffness.
std::vector<WornGarment> garments_of(const Trials& trials, const std::vector<Stiffness>& scene) {
  std::vector<WornGarment> garments;
  for (std::size_t g = 0; g < trials.garments.size(); ++g) {
    WornGarment worn = trials.garments[g].worn;
    Material& material = worn.garment.material;
    material.stretch_warp = material.stretch_weft = scene[g].stretch;
    material.bending = scene[g].bending;
    garments.push_back(std::move(worn));
  }
  return garments;
}

/// Where all garments were seen and how quick they were, frame by frame and between.
struct SeenCloth {
  std::vector<Points> positions;   // [F] of [V,3] m
  std::vector<Points> velocities;  // [F] of [V,3] m/s
  double seconds = 0;              // from frame to frame

  /// Cubic from frame `from` to the next, `share` of the way.
  Points position(std::size_t from, double t) const {
    return (1 + 2 * t) * (1 - t) * (1 - t) * positions[from] +
           t * t * (3 - 2 * t) * positions[from + 1] +
           seconds * t * (1 - t) * ((1 - t) * velocities[from] - t * velocities[from + 1]);
  }
  Points velocity(std::size_t from, double t) const {
    return 6 * t * (1 - t) / seconds * (positions[from + 1] - positions[from]) +
           (1 - t) * (1 - 3 * t) * velocities[from] + t * (3 * t - 2) * velocities[from + 1];
  }
};

SeenCloth seen_cloth(const Trials& trials, const WornCloth& worn) {
  const auto together = [&](const std::vector<Points> TrialGarment::*what, std::size_t frame) {
    Points all(worn.state.positions.rows(), 3);
    for (std::size_t g = 0; g < trials.garments.size(); ++g) {
      const Points& one = (trials.garments[g].*what)[frame];
      all.middleRows(worn.first[g], one.rows()) = one;
    }
    return all;
  };
  SeenCloth seen;
  for (std::size_t frame = 0; frame < trials.steps.size(); ++frame) {
    seen.positions.push_back(together(&TrialGarment::targets, frame));
    seen.velocities.push_back(together(&TrialGarment::velocities, frame));
  }
  seen.seconds = trials.steps[1] / trials.options.rate;
  return seen;
}

/// Rms over vertices of how far their patch is off, its offset averaged over patch and frames: what
/// registration, folds and the interpolated motion are off by changes its side from frame to frame
/// and from fold to fold, what a wrong stiffness is off by does not.
/// @param sum  [V,3] m, offsets of the vertices summed over `frames` frames
double steady_distance(const TrialGarment& garment, const Points& sum, int frames) {
  Points offset = Points::Zero(garment.patch_count, 3);
  Eigen::VectorXd count = Eigen::VectorXd::Zero(garment.patch_count);
  for (Index v = 0; v < sum.rows(); ++v) {
    const int patch = garment.patches[static_cast<std::size_t>(v)];
    offset.row(patch) += sum.row(v);
    count[patch] += 1;
  }
  // Of n vertices each with the patch's mean s/n: n |s/n|^2.
  const double squares = (offset.rowwise().squaredNorm().array() / count.array()).sum();
  return std::sqrt(squares / static_cast<double>(sum.rows())) / frames;
}

}  // namespace

OptionTable describe(MaterialStageOptions& options) {
  OptionTable table;
  std::vector<std::string> names = fabric_names();
  names.insert(names.begin(), "fitted");
  table.add("material", describe_material(options.material, std::move(names)));
  table.add("search", describe(options.search));
  table.add("capture", describe(options.capture));
  table.add("use_prior", options.use_prior,
            "Prior from published fabrics for what the capture does not determine; off: a uniform "
            "prior over the range");
  table.add("tracking_rate", options.tracking_rate, 1, 60, "1/s",
            "Rate at which cloth is pulled towards where it was seen (tracking constraint); higher "
            "follows the capture more closely and tells less of the material");
  table.add("sequence", options.sequence, std::vector<std::string>{},
            "Name of the sequence of the capture; empty: the first clothed one");
  table.add("holding", options.holding, std::vector<std::string>{}, kHoldingHelp);
  table.add("frames", options.frames, 2, 10000, "",
            "Number of frames simulated in each trial, from the first on");
  table.add("edge_length", options.edge_length, 0.005, 0.2, "m",
            "Edge length of the garments in a trial; the stiffness found does not depend on it");
  table.add("solver", options.solver.name, solver_names(), "Simulator of the trials");
  table.add("self_contact", options.solver.self_contact,
            "Self-contact of cloth in a trial, which takes several times as long");
  return table.add(describe_sections(options.solver, {"projective_friction.half_precision"}));
}

Trials read_trials(StageRun& run, const std::vector<RegisteredGarmentSequence>& outfit) {
  const auto& options = run.options<MaterialStageOptions>();
  const PersonalBody person = read_personal_body(run.input("person") / "person.npz");
  const TrackedMotion tracked = read_tracked_motion(
      tracked_take(run.input("tracked"), run.input("capture"), options.sequence));
  const Sequence bodies = open_sequence(run.input("bodies"));
  MovingBody body;
  body.model = person.model;
  body.shaped = shape_body(body.model);
  body.motion.fps = tracked.motion.fps;
  const std::vector<int> common = common_frames(outfit);
  for (std::size_t i = 0; i < tracked.motion.frame_ids.size(); ++i) {
    const int id = tracked.motion.frame_ids[i];
    const auto at = std::lower_bound(bodies.frame_ids.begin(), bodies.frame_ids.end(), id);
    const bool there = std::binary_search(common.begin(), common.end(), id) &&
                       at != bodies.frame_ids.end() && *at == id;
    if (static_cast<int>(body.motion.poses.size()) == options.frames ||
        (!there && !body.motion.poses.empty())) {
      break;  // one stretch of frames: cloth goes on from each to the next
    }
    if (there) {
      body.motion.frame_ids.push_back(id);
      body.motion.poses.push_back(tracked.motion.poses[i]);
      body.offsets.push_back(frame(bodies, at - bodies.frame_ids.begin()).vertices -
                             skin_vertices(body.model, body.shaped, tracked.motion.poses[i]));
    }
  }
  if (body.motion.poses.size() < 2) {
    throw DataError(run.input("registered").string(), "frames",
                    "fewer than two in a row with garments, body and pose",
                    "a longer clothed sequence; or --material.name with a fabric");
  }
  Trials trials;
  trials.body_faces = body.model.mesh.faces;
  trials.frame_ids = body.motion.frame_ids;
  const int per_frame = saturating_cast<int>(std::ceil(kRate / body.motion.fps - 1e-9));
  const double step_seconds = 1 / (body.motion.fps * per_frame);
  const int steps = per_frame * static_cast<int>(body.motion.poses.size() - 1);
  for (int step = 0; step <= steps; ++step) {
    trials.bodies.push_back(surface_at(body, step * step_seconds));
    if (step % per_frame == 0) {
      trials.steps.push_back(step);
    }
  }
  trials.tracking_rate = options.tracking_rate;
  trials.options.rate = 1 / step_seconds;
  trials.options.contact = kContact;
  trials.options.solver = options.solver;
  trials.options.solver.self_interval = options.solver.substeps;
  for (const RegisteredGarmentSequence& garment : outfit) {
    trials.garments.push_back(trial_garment(garment, body, trials.bodies.front(),
                                            resolve_material(options.material),
                                            options.edge_length));
  }
  return trials;
}

SceneResult run_scene(const Trials& trials, const std::vector<Stiffness>& scene,
                      const std::atomic<bool>& stopped) {
  SceneResult result;
  const std::size_t count = trials.garments.size();
  result.distances.assign(count, std::numeric_limits<double>::infinity());
  try {
    WornCloth worn = worn_cloth(garments_of(trials, scene), trials.options);
    worn.cloth.attachments.clear();  // what the body holds goes where it was seen
    const SeenCloth seen = seen_cloth(trials, worn);
    const std::unique_ptr<Solver> solver =
        create_solver({worn.cloth, trials.body_faces}, worn.solver);
    solver->set_state(worn.state);
    const std::size_t frames = trials.steps.size();
    const std::size_t settled = std::min<std::size_t>(kSettling, (frames - 1) / 3);
    const double step_seconds = worn.solver.time_step;
    const int per_frame = trials.steps[1];
    Points sum = Points::Zero(worn.state.positions.rows(), 3);
    ClothState state = worn.state;
    for (std::size_t frame = 0; frame + 1 < frames && !stopped; ++frame) {
      for (int step = 1; step <= per_frame; ++step) {
        const auto at =
            static_cast<std::size_t>(trials.steps[frame]) + static_cast<std::size_t>(step);
        const double share = static_cast<double>(step) / per_frame;
        const Points there = seen.position(frame, share);
        Control control;
        control.body_start = trials.bodies[at - 1];
        control.body_end = trials.bodies[at];
        control.pin_targets = there;
        solver->step(control);
        state = solver->state();
        // A damped spring that neither swings nor lags: what it has to pull is what the stiffness
        // is wrong by, and no error of the start or of a frame grows.
        state.velocities +=
            step_seconds *
            (trials.tracking_rate * trials.tracking_rate * (there - state.positions) +
             2 * trials.tracking_rate * (seen.velocity(frame, share) - state.velocities));
        solver->set_state(state);
      }
      if (frame >= settled) {
        sum += state.positions - seen.positions[frame + 1];
      }
    }
    result.end = state.positions;
    for (std::size_t g = 0; g < count; ++g) {
      const TrialGarment& garment = trials.garments[g];
      result.distances[g] =
          steady_distance(garment, sum.middleRows(worn.first[g], garment.targets.front().rows()),
                          static_cast<int>(frames - 1 - settled));
    }
  } catch (const DataError&) {
    result.end.resize(0, 3);  // it tore or flew apart: as far off as can be
  }
  return result;
}

}  // namespace atelier
