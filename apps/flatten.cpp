#ifdef ATELIER_HAS_REGISTRATION

#include "apps/flatten.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/exit_code.h"
#include "apps/flatten_doubts.h"
#include "apps/flatten_pictures.h"
#include "apps/flatten_relax.h"
#include "apps/flatten_surface.h"
#include "apps/json_text.h"
#include "apps/output_place.h"
#include "apps/seam_input.h"
#include "apps/standard_streams.h"
#include "apps/usage_error.h"
#include "apps/writable_place.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/file_kind.h"
#include "core/io/image_file.h"
#include "core/io/mesh_file.h"
#include "core/io/mesh_obj.h"
#include "core/normals.h"
#include "core/printable.h"
#include "core/store/write_text.h"
#include "registration/blunt_corners.h"
#include "registration/edge_paths.h"
#include "registration/find_pattern.h"
#include "registration/front_and_back.h"
#include "registration/open_to_discs.h"
#include "registration/part_overlaps.h"
#include "registration/smooth_surface.h"
#ifdef ATELIER_HAS_SIMULATION
#include "simulation/fabric.h"
#endif

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// Everything that is made of one mesh.
struct Flattened {
  Mesh mesh;
  FlatPattern pattern;
  FlatMeasures measures;
  PatternLayout layout;
  Eigen::Vector3d facing = Eigen::Vector3d::Zero();  ///< where its wearer looks; zero: not known
  bool reached = true;                               ///< what was asked of found seams
  double gave_way_mean = 0, gave_way_most = 0;       ///< m, off the smoothed surface
  bool relaxed = true;  ///< hangs as captured, where that was asked for
  bool equal = true;    ///< both sides of every seam are equally long, where that was asked for
};

/// What is finer than panels can be is taken out of the surface.
void smooth_mesh(Mesh& mesh, double reach, const FlattenWatcher& watcher) {
  const double area = face_areas(mesh.vertices, mesh.faces).sum();
  const Points smooth = smoothed_surface(mesh, reach);
  char text[120];
  std::snprintf(text, sizeof text, "smoothed: moved by %.2f mm in the mean, area %+.2f%%",
                1000 * (smooth - mesh.vertices).rowwise().norm().mean(),
                100 * (face_areas(smooth, mesh.faces).sum() / area - 1));
  watcher.say(text);
  mesh.vertices = smooth;
}

/// Slivers, which no simulation takes, are taken out; where seams are given, triangles stay and
/// only what is near to being refused is changed.
void blunt_mesh(Mesh& mesh, bool seams_given, const FlattenWatcher& watcher) {
  constexpr double kNearlyRefused = 2;  // deg
  BluntCornersOptions how;
  if (seams_given) {
    how.least = kNearlyRefused;
    how.flips = false;
  }
  const double before = least_corners(mesh.vertices, mesh.faces).minCoeff();
  mesh = with_blunt_corners(mesh, how);
  const double after = least_corners(mesh.vertices, mesh.faces).minCoeff();
  if (after > before) {
    char text[120];
    std::snprintf(text, sizeof text, "slivers removed: smallest corner %.1f deg, was %.1f", after,
                  before);
    watcher.say(text);
  }
}

/// The pattern of a cut; panels that lie over themselves are parted.
void lay_out(Flattened& flat, const std::vector<char>& cut, const FlattenStageOptions& options,
             const FlattenWatcher& watcher) {
  flat.pattern = flatten_apart(flat.mesh, cut, options.flatten, [&](std::size_t panels) {
    watcher.say(std::to_string(panels) + (panels == 1
                                              ? " panel that overlaps itself is divided"
                                              : " panels that overlap themselves are divided"));
  });
  flat.measures = measure_flat(flat.mesh, flat.pattern);
}

/// Seams and their pattern. Where none keeps the bound, what was found is laid out as it is.
void lay_out_found(Flattened& flat, const FlattenStageOptions& options,
                   const FlattenWatcher& watcher) {
  FindPatternOptions how;
  how.find = options.find;
  how.find.facing = nearly_ahead(flat.facing);
  how.flatten = options.flatten;
  how.give = options.give;
  FoundPattern found = find_pattern(flat.mesh, how, watcher.say);
  char text[120];
  std::snprintf(text, sizeof text, "the surface deviates by %.2f mm in the mean, %.1f mm at most",
                1000 * found.moved_mean, 1000 * found.moved_most);
  watcher.say(text);
  flat.gave_way_mean = found.moved_mean;
  flat.gave_way_most = found.moved_most;
  flat.mesh = std::move(found.mesh);
  flat.reached = found.reached;
  if (found.reached) {
    flat.pattern = std::move(found.pattern);
    flat.measures = std::move(found.measures);
  } else {
    FlattenStageOptions as_found = options;  // panels stiffen where the search's do
    as_found.flatten.panel.even = stiffening_of(options.find.stretch);
    lay_out(flat, found.seams.cut, as_found, watcher);
    flat.reached = found.seams.reached && flat.measures.strain_p99 <= options.find.stretch;
  }
}

/// The largest difference of a seam's two sides, on the surface's pattern and as it is drawn.
double mismatch_of(const Flattened& flat) {
  return std::max(flat.measures.seam_mismatch, flat.layout.seam_mismatch);
}

Flattened flatten_garment(const FlattenGarment& garment, const FlattenStageOptions& options,
                          const FlattenWatcher& watcher) {
  Flattened flat;
  auto [surface, given] = read_flatten_surface(garment.file, options.seams, options.input, watcher);
  flat.mesh = std::move(surface);
  flat.facing = garment.note.facing;
#ifdef ATELIER_HAS_SIMULATION
  if (!options.relax.body.empty()) {
    flat.relaxed = relax_mesh(flat.mesh, garment, options, watcher);
    if (watcher.stopped()) {
      return flat;
    }
  }
#endif
  if (options.smooth > 0) {
    smooth_mesh(flat.mesh, options.smooth, watcher);
  }
  blunt_mesh(flat.mesh, options.seams != "auto", watcher);
  const Topology topology = topology_of(flat.mesh.faces, flat.mesh.vertices.rows());
  try {
    if (options.seams == "auto") {
      lay_out_found(flat, options, watcher);
    } else {
      const std::vector<char> open =
          opened_to_discs(topology, given, edge_lengths(topology, flat.mesh.vertices));
      if (open != given) {
        watcher.say("panels with holes were cut open");
      }
      lay_out(flat, open, options, watcher);
    }
  } catch (const DataError& error) {
    throw DataError(garment.file.string(), error.where, error.found, error.expected);
  }
  flat.layout = lay_out_pattern(flat.pattern, options.pattern);
  if (const auto doubt =
          fabric_doubt(flat.layout, options.pattern.fabric_width, garment.file.string())) {
    watcher.warn(*doubt);
  }
  if (options.flatten.equal_seams) {
    const auto doubt = seam_doubt(mismatch_of(flat), garment.file.string());
    flat.equal = !doubt;
    if (doubt) {
      watcher.warn(*doubt);
    }
  }
  return flat;
}

/// The smallest corner of the flat panels, deg: a simulation refuses those below half a degree.
double flat_corner(const Flattened& flat) {
  return least_corners(flat.pattern.vertices, flat.pattern.cut.faces).minCoeff();
}

std::string summary_of(const Flattened& flat) {
  const FlatMeasures& m = flat.measures;
  char text[400];
  std::snprintf(
      text, sizeof text,
      "%d panels, %zu seams of %.2f m; stretch p50 %.2f%%, p95 %.2f%%, p99 %.2f%%, most %.1f%%; "
      "area %.2f%% of the surface's; seams differ by %.2f%% at most; %d inverted triangles, %d "
      "panels that overlap themselves; smallest corner %.1f deg; fabric %.2f x %.2f m",
      flat.pattern.cut.panel_count, flat.pattern.seams.size(), m.seam_length, 100 * m.strain_p50,
      100 * m.strain_p95, 100 * m.strain_p99, 100 * m.strain_max, 100 * m.area_ratio,
      100 * mismatch_of(flat), m.inverted, m.overlaps, flat_corner(flat), flat.layout.width,
      flat.layout.length);
  return text;
}

nlohmann::ordered_json json_of(const Flattened& flat) {
  const FlatMeasures& m = flat.measures;
  return {{"panels", flat.pattern.cut.panel_count},
          {"seams", flat.pattern.seams.size()},
          {"stretch_p50", m.strain_p50},
          {"stretch_p95", m.strain_p95},
          {"stretch_p99", m.strain_p99},
          {"stretch_max", m.strain_max},
          {"area_ratio", m.area_ratio},
          {"seam_mismatch", mismatch_of(flat)},
          {"seam_length", m.seam_length},
          {"inverted", m.inverted},
          {"overlaps", m.overlaps},
          {"gave_way_mean", flat.gave_way_mean},
          {"gave_way_most", flat.gave_way_most},
          {"smallest_corner", flat_corner(flat)},
          {"fabric_width", flat.layout.width},
          {"fabric_length", flat.layout.length}};
}

/// The mesh with its flat panels as texture coordinates, in metres.
Mesh with_flat_uvs(const Flattened& flat) {
  const Garment garment = garment_of(flat.mesh, flat.pattern);
  Mesh mesh = flat.mesh;
  mesh.uvs = garment.rest;
  mesh.uv_faces = garment.rest_faces;
  mesh.normals.resize(0, 3);
  return mesh;
}

/// The meshes of a folder, by name.
std::vector<fs::path> meshes_in(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".obj" || entry.path().extension() == ".ply") {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// The mesh itself, or every mesh of a folder or of a result of `template`, with what that says of
/// it there; none of any other folder. What lies beside the INPUT is no part of it, nor of the
/// result's key.
std::vector<FlattenGarment> garments_in(const fs::path& input) {
  if (!fs::is_directory(input)) {
    return {{input, {}}};
  }
  std::vector<fs::path> files = meshes_in(input);
  if (files.empty() && fs::exists(input / kTemplateFile) &&
      fs::is_directory(input / kTemplateGarments)) {
    files = meshes_in(input / kTemplateGarments);
  }
  std::vector<FlattenGarment> garments;
  garments.reserve(files.size());
  for (const fs::path& file : files) {
    garments.push_back({file, template_note(input / kTemplateFile, file.stem().string())});
  }
  return garments;
}

/// The warning "template-unread" of a garment beside whose INPUT lies where its wearer looks.
std::optional<Finding> unread_doubt(const FlattenGarment& garment) {
  const fs::path file = template_file(garment.file);
  try {
    if (!garment.note.facing.isZero() ||
        template_note(file, garment.file.stem().string()).facing.isZero()) {
      return std::nullopt;
    }
  } catch (const DataError&) {  // nothing that this run reads
    return std::nullopt;
  }
  return Finding{
      Severity::Warning, "template-unread", garment.file.string(),
      file.string() + " says where its wearer looks, and is no part of this INPUT",
      "seams are found by the shape; INPUT " + file.parent_path().string() + " has it read"};
}

void write_flat(StageRun& run, const Flattened& flat, const std::string& title,
                const std::string& folder) {
  run.output_text(folder + "pattern.svg", pattern_svg(flat.layout, title));
  run.output_text(folder + "pattern.dxf", pattern_dxf(flat.layout, title));
  run.output(folder + "garment.obj", [&](const fs::path& file) {
    write_text(file, obj_text(polygons_of(with_flat_uvs(flat))));
  });
#ifdef ATELIER_HAS_CORE_RENDER
  run.output(folder + "stretch.png", [&](const fs::path& file) {
    write_text(file,
               image_bytes(stretch_picture(flat.mesh, flat.pattern, flat.measures, flat.facing),
                           ImageFormat::Png));
  });
#endif
}

}  // namespace

OptionTable describe(FlattenRelaxOptions& options) {
  OptionTable table;
#ifdef ATELIER_HAS_SIMULATION
  table.add("body", options.body, std::vector<std::string>{},
            "Mesh of the body that a captured garment hangs on, in the unit of the garment, or the "
            "bodies of its capture (WORKSPACE/body/current), of which the one of the garment's "
            "frame is used: the stretch due to its weight is removed before flattening");
  std::vector<std::string> fabrics = fabric_names();
  fabrics.insert(fabrics.begin(), "");
  table.add("fabric", options.fabric, fabrics, "Fabric of the garment, for its weight");
  table.add("registered", options.registered, std::vector<std::string>{},
            "Folder of the garment's registered sequence (registered/LABEL of register) or of "
            "those of all garments (registered): a garment captured in motion is not relaxed");
  table.add("gap", options.gap, 0, 0.02, "m",
            "Gap kept from the body; 0: the one that the garment keeps where it rests on the body");
  table.add("substeps", options.substeps, 1, 1000, "",
            "Substeps of a simulated frame; more for stiff cloth with small triangles");
  table.add("relaxing", describe(options.relaxing));
#endif
  return table;
}

OptionTable describe(FlattenStageOptions& options) {
  OptionTable table;
  table.add("seams", options.seams, std::vector<std::string>{},
            "Seams: auto (found), uvs (where texture coordinates part), labels (where vertex "
            "labels part), none (opened only), or a file (.json)");
  table.add("smooth", options.smooth, 0, 0.1, "m",
            "Smoothing length: noise and creases finer than six times this are smoothed away "
            "first; 0: no smoothing");
  table.add("give", options.give, 0, 0.02, "m",
            "Developability tolerance where seams are found: distance by which most of the surface "
            "may move to lie flat without stretch, about the error of the surface; 0: none");
  table.add("find", describe(options.find));
  table.add("flatten", describe(options.flatten));
  table.add("pattern", describe(options.pattern));
  table.add("relax", describe(options.relax));
  table.add("input", describe(options.input));
  return table;
}

int flatten_alone(const std::map<std::string, std::string>& values, const OptionSet& set,
                  Device /*device*/, bool json) {
  const auto value = [&](const char* name) {
    const auto found = values.find(name);
    return found != values.end() ? found->second : std::string();
  };
  const auto& options = options_of<FlattenStageOptions>(set);
  if (value("mesh").empty() || value("out").empty()) {
    throw UsageError(
        "flatten without a workspace takes --mesh and --out: atelier flatten --mesh MESH --out "
        "FOLDER");
  }
  const fs::path out = value("out");
  require_new_place(out, "--out");
  require_folder_place(out);
  FlattenWatcher watcher;
  watcher.say = [&](const std::string& line) {
    (json ? standard_error() : std::cout) << printable(line) << std::endl;
  };
  watcher.warn = [&](const Finding& finding) { watcher.say(to_string(finding)); };
  watcher.relaxed = [&](int round, int rounds, double error) {
    char text[100];
    std::snprintf(text, sizeof text,
                  "round %d of at most %d: hangs %.2f mm from the captured shape", round, rounds,
                  1000 * error);
    watcher.say(text);
  };
  watcher.stopped = [] { return false; };
  const fs::path mesh = value("mesh");
  const FlattenGarment garment{mesh, template_note(template_file(mesh), mesh.stem().string())};
#ifdef ATELIER_HAS_SIMULATION
  require_relaxable(options, {garment});
#endif
  const Flattened flat = flatten_garment(garment, options, watcher);
  make_private_directory(out);
  const std::string title = fs::path(value("mesh")).stem().string();
  write_file_atomically(out / "pattern.svg", pattern_svg(flat.layout, title));
  write_file_atomically(out / "pattern.dxf", pattern_dxf(flat.layout, title));
  write_mesh(out / "garment.obj", with_flat_uvs(flat));
#ifdef ATELIER_HAS_CORE_RENDER
  if (value("no-pictures") != "true") {
    write_image(out / "stretch.png",
                stretch_picture(flat.mesh, flat.pattern, flat.measures, flat.facing));
  }
#endif
  if (json) {
    std::cout << json_text(json_of(flat)) << "\n";
  } else {
    std::cout << summary_of(flat) << "\n" << out.string() << "\n";
  }
  const bool as_asked = flat.reached && flat.relaxed && flat.equal && flat.measures.overlaps == 0;
  return as_asked ? kExitDone : kExitNotConverged;
}

void require_named(const FlattenStageOptions& options, [[maybe_unused]] const fs::path& input) {
  require_seams_named(options.seams);
#ifdef ATELIER_HAS_SIMULATION
  if (const std::string& body = options.relax.body;
      !body.empty() && file_kind(body) == fs::file_type::not_found) {
    read_mesh(body);  // says what it would have read
  }
  require_relaxable(options, garments_in(input));
#endif
}

void check_flatten_input(const fs::path& input) {
  if (garments_in(input).empty()) {
    throw DataError(input.string(), "", "no .obj or .ply",
                    "a mesh for each garment, as 'atelier run' leaves them in WORKSPACE/surfaces");
  }
}

void run_flatten(StageRun& run) {
  const auto& options = run.options<FlattenStageOptions>();
  FlatMeasures worst;
  worst.area_ratio = 1;
  double gave_way_mean = 0;
  double gave_way_most = 0;
  int panels = 0;
  const std::vector<FlattenGarment> garments = garments_in(run.input("surface"));
#ifdef ATELIER_HAS_SIMULATION
  require_relaxable(options, garments);
#endif
  if (options.seams == "auto") {
    for (const FlattenGarment& garment : garments) {
      if (const auto doubt = unread_doubt(garment)) {
        tell(run, {*doubt});
        break;  // of one INPUT
      }
    }
  }
  run.progress(0, std::ssize(garments), "garments");
  for (const FlattenGarment& garment : garments) {
    if (run.stop_requested()) {
      return;
    }
    const std::string title = garment.file.stem().string();
    const std::string folder = fs::is_directory(run.input("surface")) ? title + "/" : "";
    const std::string whose = folder.empty() ? "" : title + ": ";
    FlattenWatcher watcher;
    watcher.say = [&](const std::string& line) { run.say(whose + line); };
    watcher.warn = [&](const Finding& finding) { tell(run, {finding}, whose); };
    watcher.relaxed = [&](int round, int rounds, double error) {
      run.progress(round, rounds, "rounds of relaxing", {{"off_mm", 1000 * error}});
    };
    watcher.stopped = [&] { return run.stop_requested(); };
    if (!options.relax.body.empty()) {
      run.progress(0, options.relax.relaxing.rounds, "rounds of relaxing");
    }
    const Flattened flat = flatten_garment(garment, options, watcher);
    if (run.stop_requested()) {
      return;
    }
    write_flat(run, flat, title, folder);
    const FlatMeasures& m = flat.measures;
    panels += flat.pattern.cut.panel_count;
    worst.strain_p50 = std::max(worst.strain_p50, m.strain_p50);
    worst.strain_p95 = std::max(worst.strain_p95, m.strain_p95);
    worst.strain_p99 = std::max(worst.strain_p99, m.strain_p99);
    worst.seam_mismatch = std::max(worst.seam_mismatch, mismatch_of(flat));
    if (std::abs(m.area_ratio - 1) > std::abs(worst.area_ratio - 1)) {
      worst.area_ratio = m.area_ratio;
    }
    gave_way_mean = std::max(gave_way_mean, flat.gave_way_mean);
    gave_way_most = std::max(gave_way_most, flat.gave_way_most);
    worst.seam_length += m.seam_length;
    worst.inverted += m.inverted;
    worst.overlaps += m.overlaps;
    run.say((folder.empty() ? "" : title + ": ") + summary_of(flat));
    run.progress(&garment - garments.data() + 1, std::ssize(garments), "garments");
  }
  run.metric("panels", panels);
  run.metric("stretch_p50", worst.strain_p50);
  run.metric("stretch_p95", worst.strain_p95);
  run.metric("stretch_p99", worst.strain_p99);
  run.metric("seam_mismatch", worst.seam_mismatch);
  run.metric("seam_length", worst.seam_length);
  run.metric("area_ratio", worst.area_ratio);
  run.metric("inverted", worst.inverted);
  run.metric("overlaps", worst.overlaps);
  run.metric("gave_way_mean", gave_way_mean);
  run.metric("gave_way_most", gave_way_most);
}

}  // namespace atelier

#endif
