#include "pipeline/cloth/simulation_scene.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>

#include "core/device.h"
#include "core/error.h"
#include "core/mesh_statistics.h"
#include "core/quantity_text.h"
#include "core/saturating_cast.h"
#include "core/usage_error.h"
#include "pipeline/cloth/captured_scene.h"
#include "pipeline/cloth/scene_check.h"
#include "pipeline/cloth/simulation_body.h"
#include "pipeline/cloth/simulation_garments.h"
#include "simulation/contact/contact_distance.h"
#include "simulation/files/simulation_words.h"
#include "simulation/material/fabric.h"

namespace atelier {

namespace {

constexpr const char* kSceneHoldingHelp =
    "Rings by which the body holds the garments: a file like holding.toml of register, or none; "
    "empty: holding.toml of the scene's folder, if there is one";

}  // namespace

OptionTable describe(SimulateOptions& options) {
  OptionTable table;
  table.add("fps", options.fps, 1, 10000, "1/s", "Simulated frames per second");
  table.add("settle", options.settle, 0, 1000000, "",
            "Number of frames on the first body before it moves");
  table.add("length", options.length, 0, 10000000, "",
            "Total number of frames; 0: as long as the body moves");
  table.add("body_fps", options.body_fps, 0, 10000, "1/s",
            "Frame rate of body meshes; 0: as they say, else the simulated rate");
  table.add(
      "fall_in", options.fall_in, 0, 60, "s",
      "Time from the rest pose, in which the garment is put on, to the first pose of a motion");
  table.add("holding", options.holding, std::vector<std::string>{}, kSceneHoldingHelp);
  table.add("pin_top", options.pin_top, 0, 1, "m",
            "Height below the garment's top within which cloth is attached to the body");
  table.add("scale", options.scale, 1e-6, 1e6, "",
            "Length of the unit of garment files in metres, the same for several garments");
  table.add("move_x", options.move_x, -1000, 1000, "m",
            "Translation of the garments along x after scaling, towards the default human's left");
  table.add("move_y", options.move_y, -1000, 1000, "m",
            "Translation of the garments along y after scaling, upwards; bodies stand on y = 0");
  table.add("move_z", options.move_z, -1000, 1000, "m",
            "Translation of the garments along z after scaling, towards the default human's front");
  table.add("flat_rest", options.flat_rest,
            "Texture coordinates as the flat rest shape in metres, as in garment.obj of flatten");
  table.add("relax", options.relax,
            "Estimation of the unloaded shape of a captured garment, which its weight has "
            "stretched, such that it hangs on the first body as captured");
  table.add("relaxing", describe(options.relaxing));
  table.add("sewn", options.sewn, "Closing of the garment's seams before the body moves");
  table.add(describe(options.cloth));
  table.add("wind", options.wind, -200, 200, "m/s",
            "Velocity of the wind, three numbers; empty: still air");
  table.add("material", describe_material(options.material, fabric_names()));
  OptionTable solver = describe(options.solver, {"time_step", "report"});
  for (OptionField& field : solver.fields) {
    field.keyed = true;  // what is counted is in the result
  }
  return table.add(solver);
}

std::string relaxed_text(const RelaxedGarment& relaxed, double seconds) {
  char text[200];
  std::snprintf(text, sizeof text,
                "unloaded shape: after %s s it hangs %.2f mm (mean; maximum %.2f mm) from the "
                "captured shape, %d rounds%s",
                number_text(seconds).c_str(), 1e3 * relaxed.mean_error, 1e3 * relaxed.largest_error,
                relaxed.rounds, relaxed.converged ? "" : "; above the tolerance");
  return text;
}

ScenePaths scene_in(const std::filesystem::path& folder) {
  if (!std::filesystem::is_directory(folder)) {
    throw DataError(folder.string(), "scene", "no folder",
                    "a folder with garment.obj, and body.obj or body/, and motion.bvh");
  }
  std::vector<std::filesystem::path> entries;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    entries.push_back(entry.path());
  }
  std::sort(entries.begin(), entries.end());
  ScenePaths out;
  std::filesystem::path garment;
  const auto take = [&](std::filesystem::path& to, const std::filesystem::path& from) {
    if (!to.empty()) {
      throw DataError(folder.string(), from.filename().string(),
                      "a second one beside " + to.filename().string(), "one of each");
    }
    to = from;
  };
  for (const std::filesystem::path& entry : entries) {
    std::string small = entry.stem().string();
    std::transform(small.begin(), small.end(), small.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (small != entry.stem() && (small == "garment" || small == "body" || small == "motion")) {
      throw DataError(folder.string(), entry.filename().string(), "a name with capitals",
                      small + entry.extension().string() + ", in small letters");
    }
    if (entry.stem() == "garment") {
      take(garment, entry);
    } else if (entry.stem() == "body") {
      take(out.body, entry);
    } else if (entry.stem() == "motion") {
      take(out.motion, entry);
    } else if (entry.filename() == kHoldingFile) {
      out.holding = entry;
    } else if (entry.filename() == kCapturedFolder) {
      out.captured = entry;
    }
  }
  if (garment.empty()) {
    throw DataError(folder.string(), "garment", "none", "garment.obj, .ply or .glb");
  }
  out.garments.push_back(garment);
  return out;
}

namespace {

ClothOptions cloth_options(const SimulateOptions& options) {
  ClothOptions cloth = options.cloth;
  if (options.relax) {
    cloth.rest_angles = "template";
  }
  return cloth;
}

void relax_scene(SimulationScene& scene, const SimulateOptions& options, Device device) {
  RelaxedGarment relaxed = relax_gravity(
      {scene.garments[0], {}, scene.body ? scene.body(0) : Points(0, 3), scene.body_faces},
      cloth_options(options), scene_solver(scene, options), options.relaxing, device);
  if (scene.body && options.solver.thickness < 0) {
    scene.thickness = relaxed.gap;
    scene.notes.push_back("keeps " + length_text(relaxed.gap) +
                          " from the body, as it was captured where it rests on it "
                          "(" +
                          solver_flag("thickness") + " says otherwise)");
  }
  const std::string hangs = relaxed_text(relaxed, options.relaxing.seconds);
  scene.notes.push_back(relaxed.converged
                            ? hangs
                            : kWarning + hangs +
                                  ": more --relaxing.rounds, or another --material or body");
  scene.garments[0] = std::move(relaxed.garment);
}

/// The beginning of a note about garment `g`: its name, where there are several.
std::string about(const SimulationScene& scene, std::size_t g) {
  return scene.garments.size() > 1 ? scene.names[g] + ": " : "";
}

/// Keeps the cloth off the body by what its edges need, unless an option says otherwise: where the
/// body is smooth it meets the cloth's vertices alone.
void keep_off(SimulationScene& scene, const SimulateOptions& options) {
  std::size_t most = 0;
  for (std::size_t g = 1; g < scene.garments.size(); ++g) {
    if (mean_edge_length(scene.garments[g].mesh) > mean_edge_length(scene.garments[most].mesh)) {
      most = g;
    }
  }
  const Garment& garment = scene.garments[most];
  const double needed = contact_distance(garment);
  if (options.solver.thickness >= 0 || !(needed > garment.material.thickness)) {
    return;
  }
  scene.thickness = needed;
  scene.notes.push_back("keeps " + length_text(needed) + " from the body, as edges of " +
                        length_text(mean_edge_length(garment.mesh)) +
                        (scene.garments.size() > 1 ? " of " + scene.names[most] : "") + " need (" +
                        solver_flag("thickness") + " says otherwise)");
}

double across(const Points& points) {
  return (points.colwise().maxCoeff() - points.colwise().minCoeff()).norm();
}

/// Warnings of settings that run but are hardly meant, of each garment with its name where there
/// are several; those that all of them share, as those of the body, once and without one.
std::vector<std::string> diagnostics_of(const SimulationScene& scene,
                                        const SimulateOptions& options) {
  std::vector<std::vector<std::string>> of_each;
  for (std::size_t g = 0; g < scene.garments.size(); ++g) {
    SimulationScene alone = scene;
    alone.garments = {scene.garments[g]};
    alone.first = {0, scene.first[g + 1] - scene.first[g]};
    alone.start = scene.start.middleRows(scene.first[g], alone.first[1]);
    of_each.push_back(scene_diagnostics(alone, options.solver.contact_reach));
    // Beside a body of the same unit nothing of the garment looks odd.
    const double size = across(alone.start);
    if (scene.body && size > 20 && across(scene.body(0)) > 20) {
      of_each.back().push_back(kWarning + ("the garment is " + length_text(size)) +
                               " across, as large as its body: files in millimetres? --scale is of "
                               "the garment alone, the body's file has to be in metres");
    }
  }
  const auto of_all = [&](const std::string& doubt) {
    return std::all_of(of_each.begin(), of_each.end(), [&](const auto& diagnostics) {
      return std::find(diagnostics.begin(), diagnostics.end(), doubt) != diagnostics.end();
    });
  };
  std::vector<std::string> diagnostics;
  for (std::size_t g = 0; g < of_each.size(); ++g) {
    for (const std::string& doubt : of_each[g]) {
      if (!of_all(doubt)) {
        diagnostics.push_back(kWarning + about(scene, g) + doubt.substr(kWarning.size()));
      } else if (g == 0) {
        diagnostics.push_back(doubt);
      }
    }
  }
  return diagnostics;
}

/// Attaches the garments to the first body by what holds them, and remembers where that is.
void hold_scene(SimulationScene& scene, const ScenePaths& paths, const SimulateOptions& options) {
  if (options.holding.empty() && paths.holding.empty()) {
    return;
  }
  std::vector<HeldGarment> garments;
  for (std::size_t g = 0; g < scene.garments.size(); ++g) {
    garments.push_back({scene.names[g], scene.garments[g].mesh.vertices.rows()});
  }
  const std::vector<HeldRing> rings = chosen_holding(options.holding, paths.holding, garments);
  const Points body = scene.body(0);
  for (std::size_t g = 0; g < scene.garments.size(); ++g) {
    Garment& garment = scene.garments[g];
    scene.holding.push_back(rings_of(rings, scene.names[g]));
    const Points start = scene.start.middleRows(scene.first[g], garment.mesh.vertices.rows());
    attach_bands(scene.holding.back(), start, body, scene.body_faces, garment);
    for (RingPlace& place :
         ring_places(scene.holding.back(), scene.first[g], start, body, scene.body_faces)) {
      scene.places.push_back(std::move(place));
    }
  }
}

/// Warns where the frames in all are fewer than those before the body moves.
void warn_of_length(SimulationScene& scene, const SimulateOptions& options, bool moves) {
  const bool settle_said = options.settle != SimulateOptions{}.settle;
  const bool lost =
      moves ? options.length <= options.settle : settle_said && options.length < options.settle;
  if (options.length == 0 || !lost) {
    return;
  }
  scene.notes.push_back(kWarning + "--length " + short_number(options.length) +
                        " ends before --settle " + short_number(options.settle) + " is over" +
                        (moves ? ", so that the body does not move" : "") +
                        ": a smaller --settle, or a larger --length");
}

}  // namespace

SimulationScene read_scene_body(const ScenePaths& paths, const SimulateOptions& options) {
  SimulationScene scene;
  double seconds = 0;
  if (!paths.body.empty()) {
    const BodyTrack track = read_body_track(paths, options, scene.notes);
    require_surface(track.at(0), track.faces, paths.body);
    scene.body_faces = track.faces;
    seconds = static_cast<double>(track.count - 1) / track.fps;
    scene.body = [track, fps = options.fps, settle = options.settle](Index frame) {
      return body_at(track, static_cast<double>(frame - settle) / fps);
    };
  }
  scene.frame_count =
      options.length > 0
          ? options.length
          : options.settle + saturating_cast<Index>(std::round(seconds * options.fps));
  if (scene.frame_count == 0) {
    throw UsageError("there are no frames to simulate: give --settle or --length");
  }
  warn_of_length(scene, options, seconds > 0);
  return scene;
}

SimulationScene read_scene(const ScenePaths& paths, const SimulateOptions& options, Device device) {
  require_scene_options(paths, options, device);
  check_device(device);
  std::vector<Garment> garments = placed_garments(paths.garments, options);
  SimulationScene scene = read_scene_body(paths, options);
  scene.garments = std::move(garments);
  scene.names = garment_names(paths.garments);
  scene.first.push_back(0);
  for (const Garment& garment : scene.garments) {
    scene.first.push_back(scene.first.back() + garment.mesh.vertices.rows());
  }
  scene.start.resize(scene.first.back(), 3);
  for (std::size_t g = 0; g < scene.garments.size(); ++g) {
    const Points& vertices = scene.garments[g].mesh.vertices;
    scene.start.middleRows(scene.first[g], vertices.rows()) = vertices;
  }
  if (scene.body) {
    if (!options.relax) {
      keep_off(scene, options);
    }
    if (options.pin_top > 0) {
      for (Garment& garment : scene.garments) {
        attach_top(garment, scene.body(0), scene.body_faces, options.pin_top);
      }
    }
    hold_scene(scene, paths, options);
    for (std::size_t g = 0; g < scene.garments.size(); ++g) {
      try {
        require_held(scene.garments[g], scene.body_faces, paths.garments[g]);
      } catch (const UsageError& error) {
        throw UsageError(about(scene, g) + error.what());
      }
    }
  }
  if (options.relax) {
    relax_scene(scene, options, device);
  }
  for (std::size_t g = 0; g < scene.holding.size(); ++g) {
    add_held(scene.holding[g], scene.garments[g], scene.first[g], scene.held);
  }
  for (std::string& doubt : diagnostics_of(scene, options)) {
    scene.notes.push_back(std::move(doubt));
  }
  return scene;
}

SimulationModel scene_model(const SimulationScene& scene, const SimulateOptions& options) {
  std::vector<Cloth> cloths;
  for (const Garment& garment : scene.garments) {
    cloths.push_back(make_cloth(garment, {}, cloth_options(options)));
    if (!scene.held.bands.empty()) {
      cloths.back().attachments.clear();  // their vertices go where scene_control has them
    }
  }
  return {cloths.size() == 1 ? cloths.front() : join_cloths(cloths), scene.body_faces};
}

std::vector<Mesh> garment_meshes(const SimulationScene& scene, const Points& positions) {
  std::vector<Mesh> meshes;
  for (std::size_t g = 0; g < scene.garments.size(); ++g) {
    Mesh mesh;
    mesh.vertices = positions.middleRows(scene.first[g], scene.first[g + 1] - scene.first[g]);
    mesh.faces = scene.garments[g].mesh.faces;
    meshes.push_back(std::move(mesh));
  }
  return meshes;
}

ClothState scene_start(const SimulationScene& scene, const Cloth& cloth) {
  ClothState state = rest_state(cloth);
  state.positions = scene.start;
  return state;
}

SolverOptions scene_solver(const SimulationScene& scene, const SimulateOptions& options) {
  SolverOptions solver = options.solver;
  solver.time_step = 1 / options.fps;
  if (scene.thickness >= 0) {
    solver.thickness = scene.thickness;
  }
  return solver;
}

Control scene_control(const SimulationScene& scene, const SimulateOptions& options, Index frame) {
  Control control;
  if (scene.body) {
    control.body_start = scene.body(frame - 1);
    control.body_end = scene.body(frame);
    control.pin_targets = pin_targets(scene.held, control.body_end, scene.body_faces);
  }
  if (!options.wind.empty()) {
    control.wind = {options.wind[0], options.wind[1], options.wind[2]};
  }
  // However short a run is, how it ends is known.
  control.exact_counts = frame == scene.frame_count && options.solver.intersection_interval > 0;
  return control;
}

FrameReport advance_scene(Solver& solver, const SimulationScene& scene,
                          const SimulateOptions& options, Index frame, const ScenePaths& paths) {
  try {
    return solver.step(scene_control(scene, options, frame));
  } catch (const DataError& error) {
    const bool of_body = error.where.starts_with("body");
    std::string file = of_body ? paths.body.string() : "";
    for (std::size_t g = 0; g < paths.garments.size() && !of_body; ++g) {
      file += (g == 0 ? "" : "+") + paths.garments[g].string();
    }
    throw DataError(error.file.empty() ? file : error.file,
                    of_body ? "frame " + std::to_string(frame) + ", " + error.where : error.where,
                    error.found, error.expected);
  }
}

void throw_with(const std::exception_ptr& failure, const std::string& kept) {
  try {
    std::rethrow_exception(failure);
  } catch (const EnvironmentError& error) {  // a full disk, a device out of memory
    throw EnvironmentError(error.place, error.reason + kept);
  } catch (const DataError& error) {
    throw DataError(error.file, error.where, error.found, error.expected + kept);
  }
}

}  // namespace atelier
