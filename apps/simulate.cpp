#if defined(ATELIER_HAS_CORE_RENDER) && defined(ATELIER_HAS_SIMULATION)

#include "apps/simulate.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "apps/exit_code.h"
#include "apps/interrupt.h"
#include "apps/json_text.h"
#include "apps/membrane_in_use.h"
#include "apps/said_material.h"
#include "apps/scene_check.h"
#include "apps/simulation_doubts.h"
#include "apps/simulation_garments.h"
#include "apps/simulation_output.h"
#include "apps/simulation_table.h"
#include "apps/simulation_words.h"
#include "apps/standard_streams.h"
#include "apps/usage_error.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/image_file.h"
#include "core/printable.h"
#include "core/render/contact_sheet.h"
#include "simulation/bending_rigidity.h"
#include "simulation/crossings.h"

namespace atelier {
namespace {

using Json = nlohmann::json;

Json json_of(const FrameReport& r) {
  Json json = {{"frame", r.frame},
               {"strain", {{"p50", r.strain_p50}, {"p95", r.strain_p95}, {"max", r.strain_max}}},
               {"residual", {{"spring_m", r.spring_residual}, {"hinge_rad", r.hinge_residual}}},
               {"energy_j", {{"kinetic", r.kinetic_energy}, {"elastic", r.elastic_energy}}},
               {"body",
                {{"contacts", r.body_contacts},
                 {"inside", r.penetrating},
                 {"depth_m", r.penetration_depth}}},
               {"self",
                {{"contacts", r.self_contacts},
                 {"candidates", r.self_candidates},
                 {"self_searches", r.self_searches},
                 {"self_renewals", r.self_renewals}}}};
  const auto counted = [](auto value) { return value >= 0 ? Json(value) : Json(nullptr); };
  json["residual"]["strain"] = counted(r.strain_residual);
  json["self"]["crossings"] = counted(r.crossings);
  json["body"]["crossings"] = counted(r.body_crossings);
  json["body"]["all_inside"] = counted(r.inside);
  json["body"]["all_depth_m"] = counted(r.inside_depth);
  json["body"]["gap"] = counted(r.body_gap);
  json["self"]["gap"] = counted(r.self_gap);
  return json;
}

Json json_of(const MembraneInUse& membrane) {
  const auto known = [](const std::optional<double>& value) {
    return value ? Json(*value) : Json(nullptr);
  };
  return {{"young_warp", membrane.warp},
          {"young_weft", membrane.weft},
          {"poisson", known(membrane.poisson)},
          {"shear", known(membrane.shear)},
          {"bending", membrane.bending}};
}

/// What of a frame is counted within the contact reach ("inside") is told again however deep it is
/// in the frames that count it.
std::string line_of(const FrameReport& r, bool with_body) {
  char text[320];
  std::snprintf(text, sizeof text, "frame %lld: strain p50 %.2f%% p95 %.2f%% max %.2f%%; ",
                static_cast<long long>(r.frame), 100 * r.strain_p50, 100 * r.strain_p95,
                100 * r.strain_max);
  std::string line = text;
  if (with_body) {
    std::snprintf(text, sizeof text, "%d touch the body, %d just inside it (%.2f mm), ",
                  r.body_contacts, r.penetrating, 1e3 * r.penetration_depth);
    line += text;
  }
  std::snprintf(text, sizeof text, "%d touch cloth; energy %s J; residual %s, %.2g rad",
                r.self_contacts, number_text(r.kinetic_energy + r.elastic_energy).c_str(),
                length_text(r.spring_residual).c_str(), r.hinge_residual);
  line += text;
  if (r.strain_residual >= 0) {
    std::snprintf(text, sizeof text, ", %.2g%% of strain", 100 * r.strain_residual);
    line += text;
  }
  if (r.crossings >= 0) {
    line += "; " + std::to_string(r.crossings) + " crossings with itself";
  }
  if (r.body_crossings >= 0) {
    std::snprintf(text, sizeof text, ", %d with the body; %d inside it, however deep (%.2f mm)",
                  r.body_crossings, r.inside, 1e3 * r.inside_depth);
    line += text;
  }
  const auto gap = [&](double share, const char* of) {
    if (share >= 0) {
      std::snprintf(text, sizeof text, "; least gap %.0f%% of the thickness kept from %s",
                    100 * share, of);
      line += text;
    }
  };
  gap(r.body_gap, "the body");
  gap(r.self_gap, "cloth");
  return line;
}

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
int simulate_grid(const OutputPlace& place, const SimulationScene& scene, const Cloth& cloth,
                  const SimulateOptions& options, Device device, bool json) {
  const std::vector<double> factors{0.1, 1, 10};
  std::vector<ClothVariation> variations;
  for (const double bending : factors) {
    for (const double stretch : factors) {
      variations.push_back({stretch, bending, -1});
    }
  }
  XpbdOptions solver = scene_solver(scene, options);
  solver.report = false;
  ClothSweep sweep(cloth, variations, scene.body_faces, solver, device);
  for (int i = 0; i < sweep.scene_count(); ++i) {
    sweep.set_state(i, scene_start(scene, cloth));
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
    sweep.advance(scene_control(scene, options, frame));
  }
  const Points body = scene.body ? scene.body(scene.frame_count) : Points(0, 3);
  const MembraneInUse membrane = membrane_in_use(scene.garments[0], options.cloth);
  std::vector<CaptionedImage> pictures;
  for (int i = 0; i < sweep.scene_count(); ++i) {
    stop_if_asked(scene.frame_count);
    const ClothVariation& v = variations[static_cast<std::size_t>(i)];
    char caption[120];
    std::snprintf(caption, sizeof caption, "%s N/m, %.3g N m, strain %.2g%%",
                  modulus_text(membrane, v.stretch).c_str(), v.bending * membrane.bending,
                  100 * mean_strain(cloth, sweep.state(i).positions));
    pictures.push_back(
        {picture_of(dressed(garment_meshes(scene, sweep.state(i).positions), scene, body),
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
  for (int i = 0; i < sweep.scene_count(); ++i) {
    const int crossings = count_crossings(sweep.state(i).positions, cloth.faces);
    if (crossings > 0) {
      words << "warning: " << pictures[static_cast<std::size_t>(i)].caption
            << ": cloth goes through cloth at " << crossings << " edges in the end\n";
    }
  }
  std::cout << (json ? json_text(Json({{"picture", picture.string()}})) : picture.string()) << "\n";
  return kExitDone;
}

/// `name`: where there are several.
void say_garment(const std::string& name, const Garment& garment, const ClothOptions& options,
                 bool json) {
  const MembraneInUse membrane = membrane_in_use(garment, options);
  const BendingRigidity rigidity = bending_rigidity(garment);
  if (json) {
    Material material = garment.material;
    Json said = {{"name", material.name}};
    for (const OptionField& field : describe(material).fields) {
      said[field.name] = *std::get<double*>(field.target);
    }
    Json of_garment = {{"vertices", garment.mesh.vertices.rows()},
                       {"faces", garment.mesh.faces.rows()},
                       {"material", said},
                       {"in_use", json_of(membrane)},
                       {"bending_by_direction", rigidity.by_direction}};
    if (!name.empty()) {
      of_garment["garment"] = name;
    }
    std::cout << json_text(of_garment) << "\n";
    return;
  }
  char text[240];
  std::snprintf(text, sizeof text,
                "%lld vertices, %lld triangles; by direction their hinges are %.2f to %.2f of the "
                "fabric's bending stiffness (mean %.2f)",
                static_cast<long long>(garment.mesh.vertices.rows()),
                static_cast<long long>(garment.mesh.faces.rows()), rigidity.lowest,
                rigidity.highest, rigidity.mean);
  std::cout << (name.empty() ? "" : printable(name) + ": ") << text_of(membrane) << "\n"
            << text << "\n";
}

std::string stopped_text(Index done, Index count, const std::filesystem::path& out) {
  if (done == 0) {
    return "stopped before its first frame; nothing was written";
  }
  return "stopped after frame " + std::to_string(done) + " of " + std::to_string(count) + "; " +
         (done < count ? "it and the frames before it are in " : "all are in ") + out.string();
}

/// What is behind the words of a failure.
std::string kept_text(Index done, const std::filesystem::path& place) {
  return done == 0 ? ""
         : done == 1
             ? "; the frame before it is in " + place.string()
             : "; the " + std::to_string(done) + " frames before it are in " + place.string();
}

/// Refuses beside --grid what is of frames, and what would make rows of it alike.
void require_grid(const OutputPlace& place, const SimulateOptions& options, bool format) {
  if (format || place.one_file) {
    throw UsageError(
        "--grid makes one picture and no frames; leave --format out, and name a "
        "folder");
  }
  if (options.xpbd.intersection_interval != SimulateOptions{}.xpbd.intersection_interval) {
    throw UsageError(
        "--xpbd.intersection-interval does nothing with --grid, which counts in the "
        "end; leave it out");
  }
  if (said_material(options.material).bending == 0) {
    throw UsageError("--grid varies the bending stiffness, and --material.bending 0 has none");
  }
}

}  // namespace

int simulate_alone(const std::map<std::string, std::string>& values, const OptionSet& set,
                   Device device, bool json) {
  const auto value = [&](const char* name) {
    const auto found = values.find(name);
    return found != values.end() ? found->second : std::string();
  };
  for (const auto& [name, text] : values) {
    if (text.empty() && name != "garment" && name != "out") {  // these two are asked for below
      throw UsageError("--" + name + " cannot be '': leave it out, or say what it takes");
    }
  }
  SimulateOptions options = options_of<SimulateOptions>(set);
  const ScenePaths paths{garment_paths(value("garment")), value("body"), value("motion")};
  if (value("garment").empty() || value("out").empty()) {
    throw UsageError(
        "simulate without a workspace takes --garment and --out: atelier simulate --garment MESH "
        "--out FOLDER (or FILE.h5, FILE.usda)");
  }
  const OutputPlace place = output_place(value("out"), value("format"));
  if (!value("material").empty()) {
    if (options.material.name != "custom" && options.material.name != value("material")) {
      throw UsageError("--material says '" + value("material") + "', --material.name '" +
                       options.material.name + "'; choose one fabric");
    }
    OptionTable table = describe(options);
    const std::string problem = set_option(table, "material.name", value("material"));
    if (!problem.empty()) {
      throw UsageError(problem);
    }
  }
  if (value("grid") == "true") {
    require_grid(place, options, !value("format").empty());
  }
  if (paths.garments.size() > 1 && place.one_file) {
    throw UsageError("--out '" + value("out").substr(0, 80) +
                     "' is one file of one garment; name a folder for several");
  }
  require_scene_options(paths, options, device);
  std::vector<std::filesystem::path> inputs = paths.garments;
  inputs.insert(inputs.end(), {paths.body, paths.motion});
  for (const std::filesystem::path& input : inputs) {
    std::error_code none;  // where one of them is missing they are not the same
    if (std::filesystem::equivalent(input, place.path, none)) {
      throw UsageError("--out cannot be '" + value("out").substr(0, 80) +
                       "': it is an input, which would be lost; name another file");
    }
  }
  require_output_place(place);
  const SimulationScene scene = read_scene(paths, options, device);
  for (const std::string& note : scene.notes) {
    (json ? standard_error() : std::cout) << printable(note) << "\n";
  }
  const Cloth cloth = scene_cloth(scene, options);
  const bool several = scene.garments.size() > 1;
  for (std::size_t g = 0; g < scene.garments.size(); ++g) {
    say_garment(several ? scene.names[g] : "", scene.garments[g], options.cloth, json);
  }
  if (value("grid") == "true") {
    return simulate_grid(place, scene, cloth, options, device, json);
  }
  ClothSolver solver(cloth, scene.body_faces, scene_solver(scene, options), device);
  solver.set_state(scene_start(scene, cloth));
  catch_interrupts();
  std::vector<FrameWriter> writers;
  for (std::size_t g = 0; g < scene.garments.size(); ++g) {
    writers.emplace_back(place, several ? scene.names[g] : "garment", options.fps,
                         scene.frame_count, scene.garments[g].mesh.faces);
  }
  Album album(place, scene.frame_count, options.fps);
  const bool pictures = value("no-pictures") != "true";
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
      const FrameReport report = advance_scene(solver, scene, options, frame, paths);
      const std::vector<Mesh> meshes = garment_meshes(scene, solver.state().positions);
      for (std::size_t g = 0; g < meshes.size(); ++g) {
        writers[g].write(static_cast<int>(frame), meshes[g]);
      }
      reports.push_back(report);
      std::cout << (json ? json_text(json_of(report))
                         : line_of(report, scene.body_faces.rows() > 0))
                << std::endl;
      if (pictures) {
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
  if (pictures && done > 0) {
    attempt([&] { album.write_sheet(); });
  }
  if (pictures && done == scene.frame_count && !interrupted() && !failure) {
    (json ? standard_error() : std::cout) << "rendering a turntable and a video" << std::endl;
    attempt([&] { album.write_videos([] { return interrupted(); }); });
  }
  if (failure) {
    throw_with(failure, kept_text(done, writers.front().frames_place()));
  }
  std::ostream& words = json ? standard_error() : std::cout;
  for (const std::string& doubt : simulation_doubts(reports, options.xpbd.self_contact)) {
    words << kWarning << doubt << "\n";
  }
  if (interrupted()) {
    words << stopped_text(done, scene.frame_count, place.path) << std::endl;
    end_by_signal();
  }
  if (!json) {
    std::cout << place.path.string() << "\n";
  }
  return kExitDone;
}

}  // namespace atelier

#endif
