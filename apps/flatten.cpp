#ifdef ATELIER_HAS_REGISTRATION

#include "apps/flatten.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>

#include "apps/exit_code.h"
#include "apps/flatten_doubts.h"
#include "apps/flatten_pictures.h"
#include "apps/json_text.h"
#include "apps/output_place.h"
#include "apps/seam_input.h"
#include "apps/writable_place.h"
#include "core/printable.h"
#ifdef ATELIER_HAS_SIMULATION
#include "apps/hanging_acceleration.h"
#include "apps/simulation_scene.h"
#endif
#include "apps/standard_streams.h"
#include "apps/usage_error.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/file_kind.h"
#include "core/io/image_file.h"
#include "core/io/mesh_file.h"
#include "core/io/mesh_obj.h"
#include "core/normals.h"
#include "core/sequence_archive.h"
#include "core/store/write_text.h"
#include "registration/blunt_corners.h"
#include "registration/edge_paths.h"
#include "registration/find_pattern.h"
#include "registration/loose_vertices.h"
#include "registration/needless_triangles.h"
#include "registration/open_to_discs.h"
#include "registration/orient_faces.h"
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
  bool reached = true;  ///< what was asked of found seams
  bool relaxed = true;  ///< hangs as captured, where that was asked for
  bool equal = true;    ///< both sides of every seam are equally long, where that was asked for
};

/// Who watches the work on one mesh.
struct Watcher {
  std::function<void(const std::string&)> say;
  std::function<void(const Finding&)> warn;
  /// After a round of relaxing: of how many, and how far off the garment hangs [m].
  std::function<void(int round, int rounds, double error)> relaxed;
  std::function<bool()> stopped;  ///< the work is of no use any more
};

#ifdef ATELIER_HAS_SIMULATION
/// The waist of what is worn on the hips, which a belt or its elastic holds where it is; without,
/// the weight would pull it down the hips. Nothing of what hangs from the shoulders.
std::vector<int> held_waist(const Mesh& mesh, const Mesh& body) {
  std::vector<int> waist;
  double height = 0;
  for (std::vector<int>& loop : boundary_loops(topology_of(mesh.faces, mesh.vertices.rows()))) {
    const double y = mesh.vertices(loop, 1).mean();
    if (waist.empty() || y > height) {
      height = y;
      waist = std::move(loop);
    }
  }
  // Above a waist is half of the skin, above a neck a tenth, with raised arms a quarter.
  constexpr double kShareAboveWaist = 0.35;
  const Eigen::VectorXd areas = face_areas(body.vertices, body.faces);
  double above = 0;
  for (Index f = 0; f < body.faces.rows(); ++f) {
    above += body.vertices(body.faces(f, 0), 1) > height ? areas[f] : 0;
  }
  if (above < kShareAboveWaist * areas.sum()) {
    waist.clear();
  }
  return waist;
}

/// The warning "in-motion" where the frame of a registered sequence that a mesh is nearest to shows
/// that its motion held it up. Throws DataError for a sequence of another mesh.
std::optional<Finding> motion_doubt(const Mesh& mesh, const Mesh& body,
                                    const std::string& registered) {
  const Sequence sequence = open_sequence(registered);
  if (!equal_arrays(sequence.faces, mesh.faces)) {
    throw DataError(registered, "faces", "another topology than the mesh's",
                    "the sequence that the mesh is the template of");
  }
  int nearest = -1;
  double least = std::numeric_limits<double>::infinity();
  for (Index row = 0; row < frame_count(sequence); ++row) {
    const double off = (frame(sequence, row).vertices - mesh.vertices).rowwise().norm().mean();
    if (off < least) {
      least = off;
      nearest = sequence.frame_ids[static_cast<std::size_t>(row)];
    }
  }
  const std::optional<double> motion =
      hanging_acceleration(sequence, nearest, body.vertices, body.faces);
  if (!motion || *motion <= kInMotion) {
    return std::nullopt;
  }
  char text[160];
  std::snprintf(
      text, sizeof text,
      "what hangs free of it changes its motion by %.1f m/s2 in frame %d: that held it up, "
      "and no rest shape hangs so under gravity",
      *motion, nearest);
  return Finding{
      Severity::Warning, "in-motion", registered, text,
      "a template of a frame at rest (template --frame); this one is flattened as it was "
      "captured"};
}

/// The unloaded garment that hangs as captured. Where none is found, the mesh stays as it is: a
/// garment that hangs elsewhere would be another one's pattern. False then.
bool relax_mesh(Mesh& mesh, const FlattenStageOptions& all, const Watcher& watcher) {
  constexpr double kAsCaptured = 2e-3;  // m, mean
  const FlattenRelaxOptions& options = all.relax;
  Garment garment;
  garment.name = options.body;
  garment.mesh = mesh;
  if (!options.fabric.empty()) {
    garment.material = fabric_material(options.fabric);
  }
  const Mesh body = read_mesh(options.body, all.input);
  if (const auto doubt = open_body_doubt(body, options.body)) {
    watcher.warn(*doubt);
  }
  if (!options.registered.empty()) {
    if (const auto doubt = motion_doubt(mesh, body, options.registered)) {
      watcher.warn(*doubt);
      return false;
    }
  }
  XpbdOptions solver = relaxing_solver();
  solver.substeps = options.substeps;
  solver.thickness = options.gap > 0 ? options.gap : -1;
  const RelaxedGarment relaxed =
      relax_gravity(garment, held_waist(mesh, body), body.vertices, body.faces, {}, solver,
                    options.relaxing, Device::Cpu, [&](int round, double error) {
                      watcher.relaxed(round, options.relaxing.rounds, error);
                      return !watcher.stopped();
                    });
  watcher.say(relaxed_text(relaxed, options.relaxing.seconds));
  if (relaxed.mean_error > kAsCaptured) {
    watcher.warn({Severity::Warning, "not-relaxed", options.body,
                  "no garment was found that hangs within 2 mm of the captured one",
                  "it is flattened as it was captured; more --relax.relaxing.rounds, or another "
                  "body or fabric"});
    return false;
  }
  mesh.vertices = relaxed.garment.mesh.vertices;
  return true;
}
#endif

/// What is finer than panels can be is taken out of the surface.
void smooth_mesh(Mesh& mesh, double reach, const Watcher& watcher) {
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
void blunt_mesh(Mesh& mesh, bool seams_given, const Watcher& watcher) {
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
    std::snprintf(text, sizeof text, "slivers taken out: smallest corner %.1f deg, was %.1f", after,
                  before);
    watcher.say(text);
  }
}

/// The pattern of a cut; panels that lie over themselves are parted.
void lay_out(Flattened& flat, const std::vector<char>& cut, const FlattenStageOptions& options,
             const Watcher& watcher) {
  flat.pattern = flatten_apart(flat.mesh, cut, options.flatten, [&](std::size_t panels) {
    watcher.say(std::to_string(panels) + (panels == 1
                                              ? " panel that lies over itself is parted"
                                              : " panels that lie over themselves are parted"));
  });
  flat.measures = measure_flat(flat.mesh, flat.pattern);
}

/// Seams and their pattern. Where none keeps the bound, what was found is laid out as it is.
void lay_out_found(Flattened& flat, const FlattenStageOptions& options, const Watcher& watcher) {
  FindPatternOptions how;
  how.find = options.find;
  how.flatten = options.flatten;
  how.give = options.give;
  FoundPattern found = find_pattern(flat.mesh, how, watcher.say);
  char text[120];
  std::snprintf(text, sizeof text, "the surface gave way by %.2f mm in the mean, %.1f mm at most",
                1000 * found.moved_mean, 1000 * found.moved_most);
  watcher.say(text);
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

/// Refuses what has no area, or is so small that the pattern's files, in micrometres, would not
/// hold it.
void require_extent(const Mesh& mesh, const std::string& file) {
  constexpr double kSmallest = 0.001;  // m
  const Mesh used = without_loose_vertices(mesh);
  if (used.faces.rows() == 0) {
    return;  // said by check_flattenable
  }
  const double extent =
      (used.vertices.colwise().maxCoeff() - used.vertices.colwise().minCoeff()).maxCoeff();
  if (extent < kSmallest) {
    char text[80];
    std::snprintf(text, sizeof text, "a mesh of %.4g m", extent);
    throw DataError(file, "size", text,
                    "1 mm at least, a garment's size: --input.unit says the file's unit");
  }
  for (Index f = 0; f < used.faces.rows(); ++f) {
    const auto corner = [&](int k) { return used.vertices.row(used.faces(f, k)).transpose(); };
    if (!is_without_area(corner(0), corner(1), corner(2))) {
      return;
    }
  }
  throw DataError(file, "mesh", "no triangle with an area", "a garment's surface");
}

/// Flags of edges as those of another mesh of the same vertices, which has no edge that is not in
/// the first; edges of one triangle are no seam.
std::vector<char> flags_of(const Topology& topology, const Topology& whole,
                           const std::vector<char>& flags) {
  std::vector<char> result(static_cast<std::size_t>(topology.edges.rows()), 0);
  Index at = 0;
  for (Index e = 0; e < topology.edges.rows(); ++e) {  // both in lexicographic order
    while (whole.edges.row(at) != topology.edges.row(e)) {
      ++at;
    }
    if (corners_of_edge(topology, e).size() == 2) {
      result[static_cast<std::size_t>(e)] = flags[static_cast<std::size_t>(at)];
    }
  }
  return result;
}

/// The mesh as it can be flattened, and its seams where they are given: read before the long work,
/// which changes no edge of a mesh whose seams are given.
std::vector<char> read_garment(Flattened& flat, const fs::path& file,
                               const FlattenStageOptions& options, const Watcher& watcher) {
  MeshFile read = read_mesh_file(file, options.input);
  require_extent(read.mesh, file.string());
  flat.mesh = without_needless_triangles(read.mesh);
  if (const Index needless = read.mesh.faces.rows() - flat.mesh.faces.rows(); needless > 0) {
    watcher.warn({Severity::Warning, "triangles-left-out", file.string(),
                  counted(needless, "triangle") + " without area, or there already",
                  "left out; the surface is the same"});
  }
  const Triangles oriented = consistently_oriented(flat.mesh.faces, flat.mesh.vertices.rows());
  if (oriented != flat.mesh.faces) {
    watcher.say("triangles of opposite orientation were turned round");
    for (Index f = 0; f < flat.mesh.uv_faces.rows(); ++f) {
      if (oriented.row(f) != flat.mesh.faces.row(f)) {
        std::swap(flat.mesh.uv_faces(f, 1), flat.mesh.uv_faces(f, 2));
      }
    }
    flat.mesh.faces = oriented;
  }
  check_flattenable(flat.mesh, file.string());
  const Topology topology = topology_of(flat.mesh.faces, flat.mesh.vertices.rows());
  const bool words = options.seams == "uvs" || options.seams == "labels";
  // A file counts all triangles.
  const Topology whole = words ? topology : topology_of(read.mesh.faces, read.mesh.vertices.rows());
  std::vector<char> given = flags_of(
      topology, whole, seam_input(options.seams, words ? flat.mesh : read.mesh, whole, file));
  if (words && std::find(given.begin(), given.end(), 1) == given.end()) {
    watcher.say((options.seams == "uvs" ? "texture coordinates" : "labels") +
                std::string(" part nowhere: no seam is given"));
  }
  const Index vertices = flat.mesh.vertices.rows();
  flat.mesh = without_loose_vertices(flat.mesh);  // seams of files count all of them
  if (const Index loose = vertices - flat.mesh.vertices.rows(); loose > 0) {
    watcher.say(std::to_string(loose) + (loose == 1
                                             ? " vertex without a triangle was left out"
                                             : " vertices without a triangle were left out"));
  }
  read.mesh.vertices = flat.mesh.vertices;
  if (const auto doubt = garment_size_doubt(read, file.string())) {
    watcher.warn(*doubt);
  }
  return given;
}

/// The largest difference of a seam's two sides, on the surface's pattern and as it is drawn.
double mismatch_of(const Flattened& flat) {
  return std::max(flat.measures.seam_mismatch, flat.layout.seam_mismatch);
}

Flattened flatten_mesh(const fs::path& file, const FlattenStageOptions& options,
                       const Watcher& watcher) {
  Flattened flat;
  const std::vector<char> given = read_garment(flat, file, options, watcher);
#ifdef ATELIER_HAS_SIMULATION
  if (!options.relax.body.empty()) {
    flat.relaxed = relax_mesh(flat.mesh, options, watcher);
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
    throw DataError(file.string(), error.where, error.found, error.expected);
  }
  flat.layout = lay_out_pattern(flat.pattern, options.pattern);
  if (const auto doubt = fabric_doubt(flat.layout, options.pattern.fabric_width, file.string())) {
    watcher.warn(*doubt);
  }
  if (options.flatten.equal_seams) {
    const auto doubt = seam_doubt(mismatch_of(flat), file.string());
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
      "%d panels, %zu seams of %.2f m; stretch p50 %.2f%%, p95 %.2f%%, p99 %.2f%%, most "
      "%.1f%%; area %.2f%% of the surface's; seams differ by %.2f%% at most; %d "
      "triangles turned over, %d panels over themselves; smallest corner %.1f deg; fabric "
      "%.2f x %.2f m",
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

/// The mesh itself, or every mesh of a folder by its name.
std::vector<fs::path> surfaces_in(const fs::path& input) {
  if (!fs::is_directory(input)) {
    return {input};
  }
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(input)) {
    if (entry.path().extension() == ".obj" || entry.path().extension() == ".ply") {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  if (files.empty()) {
    throw DataError(input.string(), "", "no .obj or .ply",
                    "a mesh for each garment, as 'atelier run' leaves them in WORKSPACE/surfaces");
  }
  return files;
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
    write_text(file, image_bytes(stretch_picture(flat.mesh, flat.pattern, flat.measures),
                                 ImageFormat::Png));
  });
#endif
}

}  // namespace

OptionTable describe(FlattenRelaxOptions& options) {
  OptionTable table;
#ifdef ATELIER_HAS_SIMULATION
  table.add("body", options.body, std::vector<std::string>{},
            "Mesh of the body that a captured garment hangs on: what its weight has stretched is "
            "taken out before it is flattened; its unit as the garment's");
  std::vector<std::string> fabrics = fabric_names();
  fabrics.insert(fabrics.begin(), "");
  table.add("fabric", options.fabric, fabrics, "What the garment is made of, for its weight");
  table.add("registered", options.registered, std::vector<std::string>{},
            "Folder of the garment's registered sequence (registered/LABEL of register): one that "
            "was captured in motion is not relaxed");
  table.add("gap", options.gap, 0, 0.02, "m",
            "Kept from the body; 0: what the garment keeps where it rests on it");
  table.add("substeps", options.substeps, 1, 1000, "",
            "Of each simulated frame; more for stiff cloth of fine triangles");
  table.add("relaxing", describe(options.relaxing));
#endif
  return table;
}

OptionTable describe(FlattenStageOptions& options) {
  OptionTable table;
  table.add("seams", options.seams, std::vector<std::string>{},
            "auto (found), uvs (where texture coordinates part), labels (where labels of vertices "
            "part), none (opened alone), or a file (.json)");
  table.add("smooth", options.smooth, 0, 0.1, "m",
            "Noise and creases finer than six times this are smoothed away before; 0: none");
  table.add("give", options.give, 0, 0.02, "m",
            "Where seams are found: how far the surface may move to lie flat without stretch, what "
            "it is in doubt by; 0: not at all");
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
  Watcher watcher;
  watcher.say = [&](const std::string& line) {
    (json ? standard_error() : std::cout) << printable(line) << std::endl;
  };
  watcher.warn = [&](const Finding& finding) { watcher.say(to_string(finding)); };
  watcher.relaxed = [&](int round, int rounds, double error) {
    char text[100];
    std::snprintf(text, sizeof text, "round %d of at most %d: hangs %.2f mm from as captured",
                  round, rounds, 1000 * error);
    watcher.say(text);
  };
  watcher.stopped = [] { return false; };
  const Flattened flat = flatten_mesh(value("mesh"), options, watcher);
  make_private_directory(out);
  const std::string title = fs::path(value("mesh")).stem().string();
  write_file_atomically(out / "pattern.svg", pattern_svg(flat.layout, title));
  write_file_atomically(out / "pattern.dxf", pattern_dxf(flat.layout, title));
  write_mesh(out / "garment.obj", with_flat_uvs(flat));
#ifdef ATELIER_HAS_CORE_RENDER
  if (value("no-pictures") != "true") {
    write_image(out / "stretch.png", stretch_picture(flat.mesh, flat.pattern, flat.measures));
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

void require_named(const FlattenStageOptions& options) {
  require_seams_named(options.seams);
  if (const std::string& body = options.relax.body;
      !body.empty() && file_kind(body) == fs::file_type::not_found) {
    read_mesh(body);  // says what it would have read
  }
}

void check_flatten_input(const fs::path& input) {
  surfaces_in(input);
}

void run_flatten(StageRun& run) {
  const auto& options = run.options<FlattenStageOptions>();
  FlatMeasures worst;
  worst.area_ratio = 1;
  int panels = 0;
  const std::vector<fs::path> files = surfaces_in(run.input("surface"));
  run.progress(0, std::ssize(files), "garments");
  for (const fs::path& file : files) {
    if (run.stop_requested()) {
      return;
    }
    const std::string title = file.stem().string();
    const std::string folder = fs::is_directory(run.input("surface")) ? title + "/" : "";
    const std::string whose = folder.empty() ? "" : title + ": ";
    Watcher watcher;
    watcher.say = [&](const std::string& line) { run.say(whose + line); };
    watcher.warn = [&](const Finding& finding) { tell(run, {finding}, whose); };
    watcher.relaxed = [&](int round, int rounds, double error) {
      run.progress(round, rounds, "rounds of relaxing", {{"off_mm", 1000 * error}});
    };
    watcher.stopped = [&] { return run.stop_requested(); };
    if (!options.relax.body.empty()) {
      run.progress(0, options.relax.relaxing.rounds, "rounds of relaxing");
    }
    const Flattened flat = flatten_mesh(file, options, watcher);
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
    worst.seam_length += m.seam_length;
    worst.inverted += m.inverted;
    worst.overlaps += m.overlaps;
    run.say((folder.empty() ? "" : title + ": ") + summary_of(flat));
    run.progress(&file - files.data() + 1, std::ssize(files), "garments");
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
}

}  // namespace atelier

#endif
