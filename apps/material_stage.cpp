#if defined(ATELIER_HAS_CAPTURE) && defined(ATELIER_HAS_REGISTRATION) && \
    defined(ATELIER_HAS_SIMULATION) && defined(ATELIER_HAS_BODYMODEL) && \
    defined(ATELIER_HAS_CORE_RENDER)

#include "apps/material_stage.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "apps/animation_input.h"
#include "apps/worn_cloth.h"
#include "bodymodel/personal_body.h"
#include "bodymodel/tracked_motion.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/image_file.h"
#include "core/io/json.h"
#include "core/io/json_place.h"
#include "core/parallel.h"
#include "core/remesh/even_mesh.h"
#include "core/render/contact_sheet.h"
#include "core/sequence_archive.h"
#include "core/topology.h"
#include "core/tree.h"
#include "simulation/fabric.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr double kRate = 60;     // simulated frames a second
constexpr double kPatch = 0.25;  // m, cloth that is looked at as one
constexpr int kSettling = 2;     // frames that cloth may take to find its lengths
/// m kept to the body. Less than triangles of this size need: they are led along the registered
/// surface, and what is more would lift them off it.
constexpr double kContact = 0.004;

/// Places on a template's triangles, that go with it wherever it is registered.
struct Binding {
  std::vector<ClosestPoint> places;

  Points on(const Points& vertices, const Triangles& faces) const {
    Points points(static_cast<Index>(places.size()), 3);
    for (std::size_t i = 0; i < places.size(); ++i) {
      Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
      for (int k = 0; k < 3; ++k) {
        sum += places[i].barycentric[k] * vertices.row(faces(places[i].face, k));
      }
      points.row(static_cast<Index>(i)) = sum;
    }
    return points;
  }
};

/// A garment coarse enough to be tried many times.
struct TriedGarment {
  std::string name;
  WornGarment worn;
  std::vector<Points> targets;     // [F] of [V,3] m, where it was registered
  std::vector<Points> velocities;  // [F] of [V,3] m/s
  std::vector<int> patches;        // [V] the patch of each vertex
  int patch_count = 0;
};

/// Everything that all trials share.
struct Trials {
  std::vector<TriedGarment> garments;
  Triangles body_faces;
  std::vector<Points> bodies;  // after each simulated frame, the start first
  std::vector<int> steps;      // after which the frames are compared
  double leash = 0;            // 1/s
  WornClothOptions options;
};

Mesh coarse_mesh(const Mesh& mesh, double edge_length) {
  Mesh surface;
  surface.vertices = mesh.vertices;
  surface.faces = mesh.faces;
  return even_mesh(surface, {.edge_length = edge_length, .holes = {}});
}

/// Speeds from five frames, where there are as many: the slope of the polynomial through them. The
/// difference of two neighbours is a tenth of a metre a second off where a skirt turns.
std::vector<Points> smooth_velocities(const std::vector<Points>& at, double fps) {
  std::vector<Points> velocities;
  const auto count = static_cast<int>(at.size());
  for (int i = 0; i < count; ++i) {
    const auto x = [&](int k) -> const Points& { return at[static_cast<std::size_t>(i + k)]; };
    if (i >= 2 && i + 2 < count) {
      velocities.push_back(fps * (8 * (x(1) - x(-1)) - (x(2) - x(-2))) / 12);
    } else if (i >= 1 && i + 1 < count) {
      velocities.push_back(fps * (x(1) - x(-1)) / 2);
    } else {
      velocities.push_back(i == 0 ? Points(fps * (x(1) - x(0))) : Points(fps * (x(0) - x(-1))));
    }
  }
  return velocities;
}

/// Each face by itself, flat, its edges as long as they were in half of the frames: an edge that
/// spans a fold in one frame is longer in others, and would push or pull the whole time. A triangle
/// that could not be keeps its shape.
void rest_on_median_lengths(Garment& garment, const std::vector<Points>& frames) {
  constexpr double kFlattest = 0.2;  // height over edge, of what is no sliver
  const Triangles& faces = garment.mesh.faces;
  garment.rest.resize(3 * faces.rows(), 2);
  garment.rest_faces.resize(faces.rows(), 3);
  std::vector<double> lengths(frames.size());
  const auto median = [&](int a, int b) {
    for (std::size_t i = 0; i < frames.size(); ++i) {
      lengths[i] = (frames[i].row(a) - frames[i].row(b)).norm();
    }
    const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
    std::nth_element(lengths.begin(), middle, lengths.end());
    return *middle;
  };
  const auto corner = [](double base, double left, double right) -> Eigen::Vector2d {
    const double x = (base * base + left * left - right * right) / (2 * base);
    return {x, std::sqrt(std::max(0.0, left * left - x * x))};
  };
  for (Index f = 0; f < faces.rows(); ++f) {
    const Eigen::RowVector3i v = faces.row(f);
    double base = median(v[0], v[1]);
    Eigen::Vector2d apex = corner(base, median(v[0], v[2]), median(v[1], v[2]));
    if (!(apex.y() > kFlattest * std::max(base, apex.norm()))) {
      const auto length = [&](int a, int b) {
        return (garment.mesh.vertices.row(v[a]) - garment.mesh.vertices.row(v[b])).norm();
      };
      base = length(0, 1);
      apex = corner(base, length(0, 2), length(1, 2));
    }
    const auto first = static_cast<int>(3 * f);
    garment.rest.row(first) << 0, 0;
    garment.rest.row(first + 1) << base, 0;
    garment.rest.row(first + 2) = apex.transpose();
    garment.rest_faces.row(f) << first, first + 1, first + 2;
  }
}

/// Cells of a raster in space.
void cut_patches(TriedGarment& tried) {
  std::map<std::array<int, 3>, int> cells;
  const Points& at = tried.targets.front();
  for (Index v = 0; v < at.rows(); ++v) {
    std::array<int, 3> cell{};
    for (std::size_t c = 0; c < 3; ++c) {
      cell[c] = static_cast<int>(std::floor(at(v, static_cast<Index>(c)) / kPatch));
    }
    tried.patches.push_back(cells.try_emplace(cell, static_cast<int>(cells.size())).first->second);
  }
  tried.patch_count = static_cast<int>(cells.size());
}

TriedGarment tried_garment(const RegisteredGarmentSequence& garment, const MovingBody& moving,
                           const Points& body, const MaterialStageOptions& options) {
  const std::vector<int>& frames = moving.motion.frame_ids;
  const Triangles& body_faces = moving.model.mesh.faces;
  TriedGarment tried;
  tried.name = garment.name;
  const Material base = said_material(options.material);
  const WornGarment fine = worn_in_frame(garment, frames.front(), body, body_faces, base);
  const Triangles& faces = garment.garment.mesh.faces;
  tried.worn.name = garment.name;
  Garment& coarse = tried.worn.garment;
  coarse.name = garment.name;
  coarse.mesh = coarse_mesh(fine.garment.mesh, options.edge_length);
  coarse.material = base;
  const Binding binding{
      closest_points(build_tree(fine.garment.mesh.vertices, faces), coarse.mesh.vertices)};
  for (const int id : frames) {
    tried.targets.push_back(binding.on(registered_mesh(garment, id).vertices, faces));
  }
  tried.velocities = smooth_velocities(tried.targets, moving.motion.fps);
  tried.worn.start = tried.targets.front();
  tried.worn.velocity = tried.velocities.front();
  coarse.attachments = held_by_body(
      garment.label, boundary_loops(topology_of(coarse.mesh.faces, coarse.mesh.vertices.rows())),
      tried.worn.start, body, body_faces);
  rest_on_median_lengths(coarse, tried.targets);
  cut_patches(tried);
  return tried;
}

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

/// How far each garment stays off where it was registered (steady_distance); and where all are at
/// the end.
struct SceneResult {
  std::vector<double> distances;
  Points end;
};

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
  const auto together = [&](const std::vector<Points> TriedGarment::*what, std::size_t frame) {
    Points all(worn.state.positions.rows(), 3);
    for (std::size_t g = 0; g < trials.garments.size(); ++g) {
      const Points& one = (trials.garments[g].*what)[frame];
      all.middleRows(worn.first[g], one.rows()) = one;
    }
    return all;
  };
  SeenCloth seen;
  for (std::size_t frame = 0; frame < trials.steps.size(); ++frame) {
    seen.positions.push_back(together(&TriedGarment::targets, frame));
    seen.velocities.push_back(together(&TriedGarment::velocities, frame));
  }
  seen.seconds = trials.steps[1] / trials.options.rate;
  return seen;
}

/// Rms over vertices of how far their patch is off, its offset averaged over patch and frames: what
/// registration, folds and the interpolated motion are off by changes its side from frame to frame
/// and from fold to fold, what a wrong stiffness is off by does not.
/// @param sum  [V,3] m, offsets of the vertices summed over `frames` frames
double steady_distance(const TriedGarment& garment, const Points& sum, int frames) {
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

SceneResult run_scene(const Trials& trials, const std::vector<Stiffness>& scene,
                      const std::atomic<bool>& stopped) {
  SceneResult result;
  const std::size_t count = trials.garments.size();
  result.distances.assign(count, std::numeric_limits<double>::infinity());
  try {
    WornCloth worn = worn_cloth(garments_of(trials, scene), trials.options);
    worn.cloth.attachments.clear();  // what the body holds goes where it was seen
    const SeenCloth seen = seen_cloth(trials, worn);
    ClothSolver solver(worn.cloth, trials.body_faces, worn.solver);
    solver.set_state(worn.state);
    const std::size_t frames = trials.steps.size();
    const std::size_t settled = std::min<std::size_t>(kSettling, (frames - 1) / 3);
    const double step_seconds = worn.solver.time_step;
    const int per_frame = trials.steps[1];
    Points sum = Points::Zero(worn.state.positions.rows(), 3);
    ClothState state = worn.state;
    for (std::size_t frame = 0; frame + 1 < frames && !stopped; ++frame) {
      for (int step = 1; step <= per_frame; ++step) {
        const auto at = static_cast<std::size_t>(trials.steps[frame] + step);
        const double share = static_cast<double>(step) / per_frame;
        const Points there = seen.position(frame, share);
        Control control;
        control.body_start = trials.bodies[at - 1];
        control.body_end = trials.bodies[at];
        control.pin_targets = there;
        solver.advance(control);
        state = solver.state();
        // A damped spring that neither swings nor lags: what it has to pull is what the stiffness
        // is wrong by, and no error of the start or of a frame grows.
        state.velocities +=
            step_seconds * (trials.leash * trials.leash * (there - state.positions) +
                            2 * trials.leash * (seen.velocity(frame, share) - state.velocities));
        solver.set_state(state);
      }
      if (frame >= settled) {
        sum += state.positions - seen.positions[frame + 1];
      }
    }
    result.end = state.positions;
    for (std::size_t g = 0; g < count; ++g) {
      const TriedGarment& garment = trials.garments[g];
      result.distances[g] =
          steady_distance(garment, sum.middleRows(worn.first[g], garment.targets.front().rows()),
                          static_cast<int>(frames - 1 - settled));
    }
  } catch (const DataError&) {
    result.end.resize(0, 3);  // it tore or flew apart: as far off as can be
  }
  return result;
}

/// The body and the garments as all trials have them.
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
  const int per_frame = static_cast<int>(std::ceil(kRate / body.motion.fps - 1e-9));
  const double step_seconds = 1 / (body.motion.fps * per_frame);
  const int steps = per_frame * static_cast<int>(body.motion.poses.size() - 1);
  for (int step = 0; step <= steps; ++step) {
    trials.bodies.push_back(surface_at(body, step * step_seconds));
    if (step % per_frame == 0) {
      trials.steps.push_back(step);
    }
  }
  trials.leash = options.leash;
  trials.options.rate = 1 / step_seconds;
  trials.options.contact = kContact;
  trials.options.xpbd.substeps = options.substeps;
  trials.options.xpbd.self_contact = options.self_contact;
  trials.options.xpbd.self_interval = options.substeps;
  trials.options.xpbd.report = false;
  for (const RegisteredGarmentSequence& garment : outfit) {
    trials.garments.push_back(tried_garment(garment, body, trials.bodies.front(), options));
  }
  return trials;
}

nlohmann::ordered_json json_of(const StiffnessRange& range) {
  return {{"low", range.low},
          {"high", range.high},
          {"open_low", range.open_low},
          {"open_high", range.open_high}};
}

nlohmann::ordered_json json_of(const Stiffness& stiffness) {
  return {{"stretch", stiffness.stretch}, {"bending", stiffness.bending}};
}

nlohmann::ordered_json json_of(const Material& material) {
  Material copy = material;
  nlohmann::ordered_json json = {{"name", copy.name}};
  for (const OptionField& field : describe(copy).fields) {
    json[field.name] = *std::get<double*>(field.target);
  }
  return json;
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

/// What is likely, and what of it the capture says.
std::string range_text(double low, double high, const StiffnessRange& range) {
  return number(low) + " to " + number(high) + " likely; " + number(range.low) +
         (range.open_low ? " or less" : "") + " to " + number(range.high) +
         (range.open_high ? " or more" : "") + " do as well";
}

/// The last frame of the coarse grid's scenes, stretching over columns, bending over rows.
Image grid_picture(const Trials& trials, const std::vector<std::vector<Stiffness>>& scenes,
                   const std::vector<SceneResult>& results, int columns) {
  Mesh body;
  body.vertices = trials.bodies[static_cast<std::size_t>(trials.steps.back())];
  body.faces = trials.body_faces;
  PictureOptions picture{.width = 200, .height = 300, .samples = 4, .framing = {}};
  std::vector<CaptionedImage> pictures;
  for (std::size_t n = 0; n < scenes.size(); ++n) {
    std::vector<RenderMesh> meshes = {{body, skin_look()}};
    Index first = 0;
    double distance = 0;
    for (std::size_t g = 0; g < trials.garments.size() && results[n].end.rows() > 0; ++g) {
      Mesh mesh = trials.garments[g].worn.garment.mesh;
      mesh.vertices = results[n].end.middleRows(first, mesh.vertices.rows());
      mesh.normals.resize(0, 3);
      first += mesh.vertices.rows();
      distance += results[n].distances[g] / static_cast<double>(trials.garments.size());
      meshes.push_back({std::move(mesh), cloth_look(g)});
    }
    pictures.push_back({picture_of(meshes, kThreeQuarter, picture),
                        number(scenes[n][0].stretch) + " N/m, " + number(scenes[n][0].bending) +
                            " N m: " + number(1e3 * distance) + " mm"});
  }
  ContactSheetOptions sheet;
  sheet.columns = columns;
  sheet.text_height = 8;
  sheet.title = "Stretching over columns, bending over rows";
  return contact_sheet(pictures, sheet);
}

void give_fit_metrics(StageRun& run, const std::vector<StiffnessFit>& fits) {
  const StiffnessFit& first = fits.front();
  double distance = 0;
  double trials = 0;
  for (const StiffnessFit& fit : fits) {
    distance += fit.distance / static_cast<double>(fits.size());
    trials = std::max(trials, static_cast<double>(fit.trials.size()));
  }
  run.metric("trials", trials);
  run.metric("distance", distance);
  run.metric("stretch", first.expected.stretch);
  run.metric("bending", first.expected.bending);
  run.metric("stretch_low", first.likely_low.stretch);
  run.metric("stretch_high", first.likely_high.stretch);
  run.metric("bending_low", first.likely_low.bending);
  run.metric("bending_high", first.likely_high.bending);
}

/// Fits every garment; empty if the run was told to stop.
std::vector<StiffnessFit> fit_garments(StageRun& run, const Trials& trials) {
  const auto& options = run.options<MaterialStageOptions>();
  const auto coarse = static_cast<std::size_t>(options.search.coarse);
  const auto expected = static_cast<std::int64_t>(coarse * coarse) +
                        static_cast<std::int64_t>(options.search.fine) * options.search.fine;
  std::atomic<bool> stopped = false;
  std::atomic<std::int64_t> done = 0;
  Image grid;
  const auto start = std::chrono::steady_clock::now();
  const StiffnessObjective objective = [&](const std::vector<std::vector<Stiffness>>& scenes) {
    std::vector<SceneResult> results(scenes.size());
    parallel_for(static_cast<Index>(scenes.size()), 1, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) {
        stopped = stopped || run.stop_requested();
        const auto n = static_cast<std::size_t>(i);
        results[n] = run_scene(trials, scenes[n], stopped);
        run.progress(++done, expected, "simulations");
      }
    });
    if (grid.data.empty() && !stopped) {
      grid = grid_picture(trials, scenes, results, options.search.coarse);
    }
    std::vector<std::vector<double>> distances;
    distances.reserve(results.size());
    for (SceneResult& result : results) {
      distances.push_back(stopped ? std::vector<double>(trials.garments.size(), 0.0)
                                  : std::move(result.distances));
    }
    return distances;
  };
  StiffnessSearchOptions search = options.search;
  search.usual = options.usual ? usual_stiffness() : UsualStiffness{};
  std::vector<StiffnessFit> fits =
      search_stiffness(static_cast<int>(trials.garments.size()), objective, search);
  if (stopped) {
    return {};
  }
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  run.metric("seconds_a_trial", seconds / static_cast<double>(std::max<std::int64_t>(1, done)));
  run.output_text("grid.png", image_bytes(grid, ImageFormat::Png));
  return fits;
}

}  // namespace

OptionTable describe(MaterialStageOptions& options) {
  OptionTable table;
  std::vector<std::string> names = fabric_names();
  names.insert(names.begin(), "fitted");
  table.add("material", describe_said(options.material, std::move(names)));
  table.add("search", describe(options.search));
  table.add("usual", options.usual,
            "Published fabrics decide what the capture leaves open, not the range alone");
  table.add("leash", options.leash, 1, 60, "1/s",
            "How quickly cloth is led back to where it was seen");
  table.add("sequence", options.sequence, std::vector<std::string>{},
            "Of the capture; empty: the first clothed one");
  table.add("frames", options.frames, 2, 10000, "", "Simulated in each trial, from the first on");
  table.add("edge_length", options.edge_length, 0.005, 0.2, "m",
            "Of the garments as they are tried: stiffness does not depend on it");
  table.add("substeps", options.substeps, 1, 1000, "", "Of a simulated frame in a trial");
  table.add("self_contact", options.self_contact,
            "Cloth against cloth in a trial: several times slower");
  return table;
}

void run_material(StageRun& run) {
  const auto& options = run.options<MaterialStageOptions>();
  const std::vector<RegisteredGarmentSequence> outfit =
      read_registered_outfit(run.input("template"), run.input("registered"));
  const bool fitted = options.material.name == "fitted";
  std::vector<StiffnessFit> fits;
  if (fitted) {
    const Trials trials = read_trials(run, outfit);
    fits = fit_garments(run, trials);
    if (fits.empty()) {
      return;
    }
    run.metric("frames", static_cast<double>(trials.steps.size()));
    give_fit_metrics(run, fits);
  }
  nlohmann::ordered_json all = nlohmann::ordered_json::object();
  for (std::size_t g = 0; g < outfit.size(); ++g) {
    Material material = said_material(options.material);
    nlohmann::ordered_json& json = all["garments"][outfit[g].name];
    if (fitted) {
      const StiffnessFit& fit = fits[g];
      material.stretch_warp = material.stretch_weft = fit.expected.stretch;
      material.bending = fit.expected.bending;
      json["distance"] = fit.distance;
      json["nearest"] = json_of(fit.best);
      json["likely_low"] = json_of(fit.likely_low);
      json["likely_high"] = json_of(fit.likely_high);
      json["stretch_range"] = json_of(fit.stretch);
      json["bending_range"] = json_of(fit.bending);
      for (const StiffnessTrial& trial : fit.trials) {
        json["trials"].push_back(
            {{"stretch", trial.stiffness.stretch},
             {"bending", trial.stiffness.bending},
             {"distance", std::isfinite(trial.distance) ? nlohmann::ordered_json(trial.distance)
                                                        : nlohmann::ordered_json(nullptr)}});
      }
      run.say(outfit[g].name + ": stretching " + number(fit.expected.stretch) + " N/m (" +
              range_text(fit.likely_low.stretch, fit.likely_high.stretch, fit.stretch) +
              "), bending " + number(fit.expected.bending) + " N m (" +
              range_text(fit.likely_low.bending, fit.likely_high.bending, fit.bending) + "); " +
              number(1e3 * fit.distance) + " mm from as registered");
    }
    json["material"] = json_of(material);
  }
  run.output_text("material.json", all.dump(1));
  run.metric("garments", static_cast<double>(outfit.size()));
  run.metric("fitted", fitted ? 1 : 0);
}

std::map<std::string, FoundMaterial> read_materials(const fs::path& result) {
  const fs::path file = result / "material.json";
  const nlohmann::json parsed =
      parse_json(read_file_text(file, Limits().text_file_bytes), file.string());
  const JsonPlace all = JsonPlace(parsed, file.string()).at("garments");
  std::map<std::string, FoundMaterial> materials;
  for (const auto& [name, json] : parsed.at("garments").items()) {
    const JsonPlace place = all.at(name).at("material");
    Material material;
    material.name = place.at("name").text();
    OptionTable table = describe(material);
    for (const OptionField& field : table.fields) {
      *std::get<double*>(field.target) = place.at(field.name).number();
    }
    const std::vector<std::string> problems = check_options(table);
    if (!problems.empty()) {
      throw DataError(file.string(), name, problems.front(), "a material in its ranges");
    }
    FoundMaterial& found = materials[name];
    found.material = material;
    for (const auto& [which, stiffness] :
         {std::pair{"likely_low", &found.likely_low}, {"likely_high", &found.likely_high}}) {
      if (json.contains(which)) {  // not where it was given
        stiffness->stretch = all.at(name).at(which).at("stretch").number();
        stiffness->bending = all.at(name).at(which).at("bending").number();
      }
    }
  }
  return materials;
}

}  // namespace atelier

#endif
