#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "apps/console/arguments.h"
#include "apps/console/interrupt.h"
#include "apps/console/stand_alone.h"
#include "apps/console/standard_streams.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/io/image_file.h"
#include "core/io/json_text.h"
#include "core/printable.h"
#include "core/render/contact_sheet.h"
#include "core/usage_error.h"
#include "pipeline/cloth/scene_check.h"
#include "pipeline/cloth/simulation_garments.h"
#include "pipeline/cloth/simulation_output.h"
#include "simulation/contact/crossings.h"
#include "simulation/files/frame_words.h"
#include "simulation/files/simulation_words.h"
#include "simulation/material/membrane_in_use.h"
#include "simulation/material/resolve_material.h"
#include "simulation/simulation_diagnostics.h"
#include "simulation/simulation_table.h"

namespace atelier {
namespace {

/// Mean of |length / rest - 1| over the mesh edges.
double mean_strain(const Cloth& cloth, const Points& positions) {
  double sum = 0;
  for (int i = 0; i < cloth.fibre_count; ++i) {
    const ClothSpring& s = cloth.springs[static_cast<std::size_t>(i)];
    sum += std::abs((positions.row(s.a) - positions.row(s.b)).norm() / s.rest - 1);
  }
  return sum / std::max(1, cloth.fibre_count);
}

/// The grid of the paper's Fig. 1: stretching stiffness over columns, bending over rows.
int simulate_grid(const OutputPlace& place, const SimulationScene& scene,
                  const SimulationModel& model, const SimulateOptions& options, Device device,
                  bool json) {
  const Cloth& cloth = model.cloth;
  const std::vector<double> factors{0.1, 1, 10};
  std::vector<ClothVariation> variations;
  for (const double bending : factors) {
    for (const double stretch : factors) {
      variations.push_back({stretch, bending, -1});
    }
  }
  SolverOptions solver = scene_solver(scene, options);
  solver.report = false;
  const std::unique_ptr<SolverBatch> batch = create_solver_batch(model, variations, solver, device);
  for (int i = 0; i < batch->scene_count(); ++i) {
    batch->set_state(i, scene_start(scene, cloth));
  }
  catch_interrupts();
  const auto stop_if_asked = [&](Index frames_done) {
    if (interrupted()) {
      (json ? standard_error() : std::cout)
          << "stopped after frame " << frames_done << " of " << scene.frame_count
          << "; a grid is drawn in the end, so nothing was written" << std::endl;
      end_by_signal();
    }
  };
  for (Index frame = 1; frame <= scene.frame_count; ++frame) {
    stop_if_asked(frame - 1);
    batch->step(scene_control(scene, options, frame));
  }
  const Points body = scene.body ? scene.body(scene.frame_count) : Points(0, 3);
  const MembraneInUse membrane = membrane_in_use(scene.garments[0], options.cloth);
  std::vector<CaptionedImage> pictures;
  for (int i = 0; i < batch->scene_count(); ++i) {
    stop_if_asked(scene.frame_count);
    const ClothVariation& v = variations[static_cast<std::size_t>(i)];
    char caption[120];
    std::snprintf(caption, sizeof caption, "%s N/m, %.3g N m, strain %.2g%%",
                  modulus_text(membrane, v.stretch).c_str(), v.bending * membrane.bending,
                  100 * mean_strain(cloth, batch->state(i).positions));
    pictures.push_back(
        {picture_of(dressed(garment_meshes(scene, batch->state(i).positions), scene, body),
                    kThreeQuarter, simulation_picture()),
         caption});
  }
  ContactSheetOptions sheet;
  sheet.columns = static_cast<int>(factors.size());
  sheet.title = "Young's modulus over columns, bending over rows; mean strain of edges";
  if (!place.one_file) {
    make_private_directory(place.path);
  }
  const std::filesystem::path picture = place.beside("grid.png");
  write_image(picture, contact_sheet(pictures, sheet));
  std::ostream& words = json ? standard_error() : std::cout;
  for (const CaptionedImage& one : pictures) {
    words << one.caption << "\n";
  }
  for (int i = 0; i < batch->scene_count(); ++i) {
    const int crossings = count_crossings(batch->state(i).positions, cloth.faces);
    if (crossings > 0) {
      words << "warning: " << pictures[static_cast<std::size_t>(i)].caption
            << ": cloth goes through cloth at " << crossings << " edges in the end\n";
    }
  }
  std::cout << (json ? json_text(nlohmann::json({{"picture", picture.string()}}))
                     : picture.string())
            << "\n";
  return kExitDone;
}

/// Refuses beside --grid what is of frames, and what would make rows of it alike.
void require_grid(const OutputPlace& place, const SimulateOptions& options, bool format) {
  if (format || place.one_file) {
    throw UsageError(
        "--grid makes one image and no frames; leave --format out, and name a "
        "folder");
  }
  if (options.solver.intersection_interval != SimulateOptions{}.solver.intersection_interval) {
    throw UsageError(solver_flag("intersection_interval") +
                     " does nothing with --grid, which counts in the "
                     "end; leave it out");
  }
  if (resolve_material(options.material).bending == 0) {
    throw UsageError("--grid varies the bending stiffness, and --material.bending 0 has none");
  }
}

/// Values of the flags; a text that was not given is none.
struct SimulateFlags {
  std::optional<std::string> garment, body, motion, out, format, material;
  bool grid = false;
  bool no_pictures = false;
};

std::string first_simulate_flag(const SimulateFlags& flags) {
  return flags.body          ? "--body"
         : flags.format      ? "--format"
         : flags.garment     ? "--garment"
         : flags.grid        ? "--grid"
         : flags.material    ? "--material"
         : flags.motion      ? "--motion"
         : flags.no_pictures ? "--no-pictures"
         : flags.out         ? "--out"
                             : "";
}

/// Of texts that cannot be empty. --garment and --out are asked for anyway.
void require_no_empty_text(const SimulateFlags& flags) {
  const std::pair<const char*, const std::optional<std::string>*> texts[] = {
      {"body", &flags.body},
      {"format", &flags.format},
      {"material", &flags.material},
      {"motion", &flags.motion}};
  for (const auto& [name, text] : texts) {
    if (*text && (*text)->empty()) {
      throw UsageError("--" + std::string(name) +
                       " cannot be '': leave it out, or say what it takes");
    }
  }
}

/// The request on the command line.
struct SimulateRequest {
  ScenePaths paths;
  OutputPlace place;
  SimulateOptions options;
  bool grid = false;
  bool pictures = true;
};

/// Throws UsageError for what cannot be asked together.
SimulateRequest simulate_request(const SimulateFlags& flags, const OptionSet& set, Device device) {
  require_no_empty_text(flags);
  const std::string garment = flags.garment.value_or("");
  const std::string out = flags.out.value_or("");
  const std::string material = flags.material.value_or("");
  SimulateRequest request;
  request.options = options_of<SimulateOptions>(set);
  request.paths.garments = garment_paths(garment);
  request.paths.body = flags.body.value_or("");
  request.paths.motion = flags.motion.value_or("");
  request.grid = flags.grid;
  request.pictures = !flags.no_pictures;
  const ScenePaths& paths = request.paths;
  if (garment.empty() || out.empty()) {
    throw UsageError(
        "simulate without a workspace takes --garment and --out: atelier simulate --garment MESH "
        "--out FOLDER (or FILE.h5, FILE.usda)");
  }
  request.place = output_place(out, flags.format.value_or(""));
  if (!material.empty()) {
    SimulateOptions& options = request.options;
    if (options.material.name != "custom" && options.material.name != material) {
      throw UsageError("--material says '" + material + "', --material.name '" +
                       options.material.name + "'; choose one fabric");
    }
    OptionTable table = describe(options);
    const std::string problem = set_option(table, "material.name", material);
    if (!problem.empty()) {
      throw UsageError(problem);
    }
  }
  if (request.grid) {
    require_grid(request.place, request.options, flags.format.has_value());
  }
  if (paths.garments.size() > 1 && request.place.one_file) {
    throw UsageError("--out '" + out.substr(0, 80) +
                     "' is one file of one garment; name a folder for several");
  }
  require_scene_options(paths, request.options, device);
  std::vector<std::filesystem::path> inputs = paths.garments;
  inputs.insert(inputs.end(), {paths.body, paths.motion});
  for (const std::filesystem::path& input : inputs) {
    std::error_code none;  // where one of them is missing they are not the same
    if (std::filesystem::equivalent(input, request.place.path, none)) {
      throw UsageError("--out cannot be '" + out.substr(0, 80) +
                       "': it is an input, which would be lost; name another file");
    }
  }
  require_output_place(request.place);
  return request;
}

/// Simulates and writes every frame, then frames.csv and pictures.
int simulate_frames(const SimulateRequest& request, const SimulationScene& scene,
                    const SimulationModel& model, Device device, bool json) {
  const OutputPlace& place = request.place;
  const SimulateOptions& options = request.options;
  const std::unique_ptr<Solver> solver = create_solver(model, scene_solver(scene, options), device);
  solver->set_state(scene_start(scene, model.cloth));
  catch_interrupts();
  std::vector<FrameWriter> writers;
  for (std::size_t g = 0; g < scene.garments.size(); ++g) {
    writers.emplace_back(place, scene.garments.size() > 1 ? scene.names[g] : "garment", options.fps,
                         scene.frame_count, scene.garments[g].mesh.faces);
  }
  Album album(place, scene.frame_count, options.fps);
  std::vector<FrameReport> reports;
  // Whatever fails, every other file is written, and it is said where the frames are.
  std::exception_ptr failure;
  const auto attempt = [&](const auto& work) {
    try {
      work();
    } catch (const std::runtime_error&) {
      failure = failure ? failure : std::current_exception();
    }
  };
  attempt([&] {
    for (Index frame = 1; frame <= scene.frame_count && !interrupted(); ++frame) {
      const FrameReport report = advance_scene(*solver, scene, options, frame, request.paths);
      const std::vector<Mesh> meshes = garment_meshes(scene, solver->state().positions);
      for (std::size_t g = 0; g < meshes.size(); ++g) {
        writers[g].write(static_cast<int>(frame), meshes[g]);
      }
      reports.push_back(report);
      std::cout << (json ? frame_json(report) : frame_line(report, scene.body_faces.rows() > 0))
                << std::endl;
      if (request.pictures) {
        album.add(frame, meshes, scene);
      }
    }
  });
  const auto done = static_cast<Index>(reports.size());
  if (done > 0) {
    attempt([&] {
      write_file_atomically(place.beside("frames.csv"), frames_csv(reports, options.fps));
    });
  }
  for (FrameWriter& writer : writers) {
    attempt([&] { writer.finish(done); });
  }
  if (request.pictures && done > 0) {
    attempt([&] { album.write_sheet(); });
  }
  if (request.pictures && done == scene.frame_count && !interrupted() && !failure) {
    (json ? standard_error() : std::cout) << "rendering a turntable and a video" << std::endl;
    attempt([&] { album.write_videos([] { return interrupted(); }); });
  }
  if (failure) {
    throw_with(failure, kept_words(done, writers.front().frames_place()));
  }
  std::ostream& words = json ? standard_error() : std::cout;
  for (const std::string& doubt :
       simulation_diagnostics(reports, options.solver.self_contact, {.solver = options.solver})) {
    words << kWarning << doubt << "\n";
  }
  if (interrupted()) {
    words << stopped_words(done, scene.frame_count, place.path) << std::endl;
    end_by_signal();
  }
  if (!json) {
    std::cout << place.path.string() << "\n";
  }
  return kExitDone;
}

int simulate_alone(const SimulateFlags& flags, const OptionSet& set, Device device, bool json) {
  const SimulateRequest request = simulate_request(flags, set, device);
  const SimulationScene scene = read_scene(request.paths, request.options, device);
  for (const std::string& note : scene.notes) {
    (json ? standard_error() : std::cout) << printable(note) << "\n";
  }
  const SimulationModel model = scene_model(scene, request.options);
  const bool several = scene.garments.size() > 1;
  for (std::size_t g = 0; g < scene.garments.size(); ++g) {
    const auto say = json ? garment_json : garment_words;
    std::cout << say(several ? scene.names[g] : "", scene.garments[g], request.options.cloth)
              << "\n";
  }
  if (request.grid) {
    return simulate_grid(request.place, scene, model, request.options, device, json);
  }
  return simulate_frames(request, scene, model, device, json);
}

}  // namespace

StandAloneWork add_simulate_alone(CLI::App& parser) {
  auto flags = std::make_shared<SimulateFlags>();
  const auto text = [&](const char* name, std::optional<std::string> SimulateFlags::*field,
                        const char* type, const char* help) {
    add_option(
        parser, name, [flags, field](const std::string& said) { (*flags).*field = said; }, help)
        .type_name(type);
  };
  text(
      "--garment", &SimulateFlags::garment, "MESH",
      "Without a workspace: garment to simulate, a mesh or garment.h5; several layers joined by +, "
      "innermost first");
  text("--body", &SimulateFlags::body, "FILE",
       "Body: a mesh, a folder of meshes (one for each frame), a sequence, a body model, female or "
       "male");
  text("--motion", &SimulateFlags::motion, "FILE",
       "Motion of a body model: .bvh, .amc, .npz, .trc, .c3d, .glb");
  text("--out", &SimulateFlags::out, "FOLDER|FILE",
       "Folder for frames, images and videos, each frame written once it is done; or one file (.h5 "
       "or .usda) for all frames, with images and videos beside it");
  text("--format", &SimulateFlags::format, "h5|ply|obj|usda",
       "Format of the frames in a folder [h5]");
  text("--material", &SimulateFlags::material, "NAME", "Fabric, the same as --material.name");
  add_flag(parser, "--grid", flags->grid,
           "Grid over bending and stretching stiffness, written as grid.png instead of frames");
  add_flag(parser, "--no-pictures", flags->no_pictures,
           "No sheet.png, turntable.mp4 and motion.mp4");
  return {[flags] { return first_simulate_flag(*flags); },
          [flags](const StandAloneRequest& request) {
            return simulate_alone(*flags, request.options, request.device, request.json);
          }};
}

}  // namespace atelier
