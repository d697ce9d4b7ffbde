#if defined(ATELIER_HAS_CAPTURE) && defined(ATELIER_HAS_REGISTRATION) && \
    defined(ATELIER_HAS_SIMULATION) && defined(ATELIER_HAS_BODYMODEL) && \
    defined(ATELIER_HAS_CORE_RENDER)

#include "apps/material_stage.h"

#include <algorithm>
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

constexpr double kRate = 60;  // simulated frames a second

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
  std::vector<Points> targets;  // [F] of [V,3] m, where it was registered
};

/// Everything that all trials share.
struct Trials {
  std::vector<TriedGarment> garments;
  Triangles body_faces;
  std::vector<Points> bodies;  // after each simulated frame, the start first
  std::vector<int> steps;      // after which the frames are compared
  WornClothOptions options;
};

Mesh coarse_mesh(const Mesh& mesh, double edge_length) {
  Mesh surface;
  surface.vertices = mesh.vertices;
  surface.faces = mesh.faces;
  return even_mesh(surface, {.edge_length = edge_length, .holes = {}});
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
  tried.worn.start = binding.on(fine.start, faces);
  tried.worn.velocity = binding.on(registered_velocity(garment, moving), faces);
  coarse.attachments = held_by_body(
      garment.label, boundary_loops(topology_of(coarse.mesh.faces, coarse.mesh.vertices.rows())),
      tried.worn.start, body, body_faces);
  for (const int id : frames) {
    tried.targets.push_back(binding.on(registered_mesh(garment, id).vertices, faces));
  }
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

/// How far each garment is from where it was registered, mean over frames and vertices; and where
/// all are at the end.
struct SceneResult {
  std::vector<double> distances;
  Points end;
};

SceneResult run_scene(const Trials& trials, const std::vector<Stiffness>& scene,
                      const std::atomic<bool>& stopped) {
  SceneResult result;
  const std::size_t count = trials.garments.size();
  result.distances.assign(count, std::numeric_limits<double>::infinity());
  try {
    const WornCloth worn = worn_cloth(garments_of(trials, scene), trials.options);
    ClothSolver solver(worn.cloth, trials.body_faces, worn.solver);
    solver.set_state(worn.state);
    std::vector<double> sums(count, 0);
    std::size_t compared = 1;  // the first is where all of them begin
    for (std::size_t step = 1; step < trials.bodies.size() && !stopped; ++step) {
      Control control;
      control.body_start = trials.bodies[step - 1];
      control.body_end = trials.bodies[step];
      solver.advance(control);
      if (compared < trials.steps.size() && static_cast<int>(step) == trials.steps[compared]) {
        result.end = solver.state().positions;
        for (std::size_t g = 0; g < count; ++g) {
          const Points& target = trials.garments[g].targets[compared];
          sums[g] += (result.end.middleRows(worn.first[g], target.rows()) - target)
                         .rowwise()
                         .norm()
                         .mean();
        }
        ++compared;
      }
    }
    for (std::size_t g = 0; g < count; ++g) {
      result.distances[g] = sums[g] / static_cast<double>(std::max<std::size_t>(1, compared - 1));
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
  trials.options.rate = 1 / step_seconds;
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

std::string range_text(const StiffnessRange& range) {
  return number(range.low) + (range.open_low ? " or less" : "") + " to " + number(range.high) +
         (range.open_high ? " or more" : "");
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
  run.metric("stretch", first.best.stretch);
  run.metric("bending", first.best.bending);
  run.metric("stretch_low", first.stretch.low);
  run.metric("stretch_high", first.stretch.high);
  run.metric("bending_low", first.bending.low);
  run.metric("bending_high", first.bending.high);
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
  std::vector<StiffnessFit> fits =
      search_stiffness(static_cast<int>(trials.garments.size()), objective, options.search);
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
      material.stretch_warp = material.stretch_weft = fit.best.stretch;
      material.bending = fit.best.bending;
      json["distance"] = fit.distance;
      json["stretch_range"] = json_of(fit.stretch);
      json["bending_range"] = json_of(fit.bending);
      for (const StiffnessTrial& trial : fit.trials) {
        json["trials"].push_back(
            {{"stretch", trial.stiffness.stretch},
             {"bending", trial.stiffness.bending},
             {"distance", std::isfinite(trial.distance) ? nlohmann::ordered_json(trial.distance)
                                                        : nlohmann::ordered_json(nullptr)}});
      }
      run.say(outfit[g].name + ": stretching " + number(fit.best.stretch) + " N/m (" +
              range_text(fit.stretch) + " does as well), bending " + number(fit.best.bending) +
              " N m (" + range_text(fit.bending) + "); " + number(1e3 * fit.distance) +
              " mm from as registered");
    }
    json["material"] = json_of(material);
  }
  run.output_text("material.json", all.dump(1));
  run.metric("garments", static_cast<double>(outfit.size()));
  run.metric("fitted", fitted ? 1 : 0);
}

Material trusted_material(const FoundMaterial& found) {
  Material material = found.material;
  const Material custom;
  if (found.stretch_at_edge) {
    material.stretch_warp = custom.stretch_warp;
    material.stretch_weft = custom.stretch_weft;
    material.shear = custom.shear;
  }
  if (found.bending_at_edge) {
    material.bending = custom.bending;
  }
  return material;
}

namespace {

/// Whether a value is the least or the largest that trials had.
bool is_at_edge(const std::vector<JsonPlace>& trials, const std::string& field, double value) {
  if (trials.empty()) {
    return false;  // given, not found
  }
  double low = std::numeric_limits<double>::infinity();
  double high = 0;
  for (const JsonPlace& trial : trials) {
    const double tried = trial.at(field).number();
    low = std::min(low, tried);
    high = std::max(high, tried);
  }
  constexpr double kSame = 1 + 1e-6;
  return value <= low * kSame || value >= high / kSame;
}

}  // namespace

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
    const std::vector<JsonPlace> trials = all.at(name).items("trials");
    materials[name] = {material, is_at_edge(trials, "stretch", material.stretch_warp),
                       is_at_edge(trials, "bending", material.bending)};
  }
  return materials;
}

}  // namespace atelier

#endif
