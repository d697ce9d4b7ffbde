#include "pipeline/view/view_place.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "capture/layouts/layout_table.h"
#include "capture/layouts/open_dataset.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/json.h"
#include "core/io/lower_extension.h"
#include "core/io/mesh_file.h"
#include "core/limits.h"
#include "core/sequence_archive.h"
#include "core/split_text.h"
#include "pipeline/cloth/simulation_scene.h"
#include "pipeline/pictures/report_drawings.h"
#include "pipeline/view/view_data.h"
#include "pipeline/view/view_meshes.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHeader = "sequence.h5";
constexpr const char* kTaken =
    "a workspace, a capture, a mesh (.obj .ply .stl .glb .gltf .fbx .usd .usda .usdc .usdz), or "
    "meshes over time: a folder with sequence.h5, a folder of numbered .obj, .ply, .glb, .gltf or "
    ".h5 files, or one file .h5 .hdf5 .npz .usd .usda .usdc .usdz";
constexpr double kStill = 1;  // frames a second of what says none

/// Whether a folder of results is not the one that `current` beside it leads to.
bool is_past_result(const fs::path& folder) {
  const fs::path current = folder.parent_path() / "current";
  std::error_code error;
  return fs::is_symlink(current, error) && !fs::equivalent(folder, current, error);
}

/// Folders below `root` that are sequences, itself among them, by name, each once; not those of
/// results that are no longer current.
std::vector<fs::path> sequence_folders(const fs::path& root) {
  std::vector<fs::path> folders;
  if (fs::exists(root / kHeader)) {
    folders.push_back(root);
  }
  constexpr int kDeepest = 4;
  for (auto it =
           fs::recursive_directory_iterator(root, fs::directory_options::skip_permission_denied);
       it != fs::recursive_directory_iterator(); ++it) {
    if (it.depth() >= kDeepest || it->path().filename() == "frames") {
      it.disable_recursion_pending();
    } else if (it->is_directory() && it->path().filename() != "current") {
      if (is_past_result(it->path())) {
        it.disable_recursion_pending();
      } else if (fs::exists(it->path() / kHeader)) {
        folders.push_back(it->path());
      }
    }
  }
  std::sort(folders.begin(), folders.end());
  return folders;
}

/// What a sequence is called: its folder, or the stage whose result it is.
std::string sequence_name(const fs::path& folder) {
  const fs::path whole = fs::absolute(folder / ".").lexically_normal().parent_path();
  const fs::path stage = whole.parent_path();
  std::error_code error;
  return whole.filename() == "current" || fs::is_symlink(stage / "current", error)
             ? stage.filename().string()
             : whole.filename().string();
}

ViewLayer sequence_layer(const fs::path& folder, const std::string& stage, const std::string& name,
                         const std::string& role) {
  ViewLayer layer;
  layer.name = name;
  layer.stage = stage;
  layer.role = role;
  layer.sequence = open_sequence(folder);
  layer.shared = read_sequence_header(folder).shared;
  return layer;
}

/// A mesh of a file as the rest shape or the pattern of a layer: with as many faces.
std::optional<Mesh> fitting_mesh(const fs::path& file, const ViewLayer& layer) {
  if (!fs::exists(file)) {
    return std::nullopt;
  }
  Mesh mesh = read_mesh(file);
  if (mesh.faces.rows() != layer.sequence.faces.rows()) {
    return std::nullopt;
  }
  return mesh;
}

/// What a workspace holds, and what is put together of it.
struct Workspace {
  fs::path path;
  std::span<const StageStatus> stages;
  ViewScene scene;

  ReportPlaces places() const { return {path, stages}; }

  const StageStatus* find(std::string_view stage) const {
    const auto at = std::find_if(stages.begin(), stages.end(),
                                 [&](const StageStatus& one) { return one.stage == stage; });
    return at == stages.end() || !at->manifest || at->state == StageStatus::State::Newer ? nullptr
                                                                                         : &*at;
  }

  fs::path result(const StageStatus& status) const { return result_folder_of(status, places()); }

  /// Adds what `add` makes; what cannot be read is a note.
  void try_to(const std::string& what, const std::function<void()>& add) {
    if (const auto problem = problem_of(add)) {
      scene.notes.push_back(what + " cannot be shown: " + *problem);
    }
  }
};

/// The rest shape of a garment by its name, and its flat panels.
void add_garment_shapes(Workspace& workspace, ViewLayer& layer, const std::string& name) {
  workspace.try_to("the strain of " + name, [&] {
    if (const StageStatus* registered = workspace.find("register")) {
      layer.rest =
          fitting_mesh(workspace.result(*registered) / "registered" / name / "rest.obj", layer);
    }
  });
  workspace.try_to("the pattern of " + name, [&] {
    if (const StageStatus* flatten = workspace.find("flatten")) {
      layer.pattern = fitting_mesh(workspace.result(*flatten) / name / "garment.obj", layer);
      if (layer.pattern && layer.pattern->uv_faces.rows() == 0) {
        layer.pattern.reset();
      }
    }
  });
}

/// Whose figures are added, and what its numbers mean.
struct FigureSource {
  std::string stage;
  std::span<const StageMetric> metrics = {};
};

FigureSource figure_source(const StageStatus& status) {
  return {status.stage, status.row != nullptr ? status.row->metrics : FigureSource{}.metrics};
}

/// A figure's name in words: "strain_p99" as "strain, 99th percentile (of rest length)".
std::string figure_words(const std::string& name, std::span<const StageMetric> metrics) {
  std::string words;
  std::string unit;
  for (const std::string& word : split_text(name, '_')) {
    if (word.size() > 1 && word[0] == 'p' && std::isdigit(static_cast<unsigned char>(word[1]))) {
      std::string percent = word.substr(1);
      if (percent.size() > 2) {
        percent.insert(2, ".");
      }
      words += percent == "50" ? ", median" : ", " + percent + "th percentile";
    } else if (word == "m" || word == "rad" || word == "j") {
      unit = word == "j" ? "J" : word;
    } else {
      words += (words.empty() ? "" : " ") + word;
    }
  }
  const auto metric = std::find_if(metrics.begin(), metrics.end(),
                                   [&](const StageMetric& one) { return one.name == name; });
  if (metric != metrics.end()) {
    unit = metric->unit;
    // A metric sums up the frames; here it is the number of one.
    for (const std::string_view all : {", in all frames", ", all frames"}) {
      if (unit.ends_with(all)) {
        unit.resize(unit.size() - all.size());
      }
    }
  }
  return words + (unit.empty() ? "" : " (" + unit + ")");
}

/// Adds the numbers of a JSON object {"000000": {"name": 1.5}} as series.
void add_figures(ViewTimeline& timeline, const nlohmann::json& frames, const FigureSource& source,
                 const std::string& of) {
  std::map<std::string, ViewSeries> series;
  for (const auto& [frame, values] : frames.items()) {
    int id = -1;
    std::from_chars(frame.data(), frame.data() + frame.size(), id);
    if (!values.is_object()) {
      continue;
    }
    for (const auto& [name, value] : values.items()) {
      if (value.is_number()) {
        ViewSeries& one = series[name];
        one.frame_ids.push_back(id);
        one.values.push_back(value.get<double>());
      }
    }
  }
  for (auto& [name, one] : series) {
    one.name = (of.empty() ? "" : of + ": ") + figure_words(name, source.metrics);
    one.stage = source.stage;
    timeline.series.push_back(std::move(one));
  }
}

/// Of `register`: by garments; of `animate`: of all.
void add_figures_file(ViewTimeline& timeline, const fs::path& file, const FigureSource& source) {
  if (!fs::exists(file)) {
    return;
  }
  const nlohmann::json json =
      parse_json(read_file_text(file, Limits{}.text_file_bytes), file.string());
  if (json.contains("frames")) {
    add_figures(timeline, json["frames"], source, "");
    return;
  }
  for (const auto& [garment, content] : json.items()) {
    if (content.is_object() && content.contains("frames")) {
      add_figures(timeline, content["frames"], source, garment);
    }
  }
}

/// Columns of a table whose first is the frame.
void add_table(ViewTimeline& timeline, const fs::path& file, const FigureSource& source) {
  if (!fs::exists(file)) {
    return;
  }
  const std::vector<std::string> lines =
      split_text(read_file_text(file, Limits{}.text_file_bytes), '\n');
  const std::vector<std::string> names = lines.empty() ? lines : split_text(lines.front(), ',');
  for (std::size_t column = 2; column < names.size(); ++column) {  // behind frame and time
    ViewSeries series{figure_words(names[column], source.metrics), source.stage, {}, {}};
    for (std::size_t i = 1; i < lines.size(); ++i) {
      const std::vector<std::string> cells = split_text(lines[i], ',');
      if (column < cells.size() && !cells[column].empty()) {
        series.frame_ids.push_back(std::atoi(cells[0].c_str()));
        series.values.push_back(std::atof(cells[column].c_str()));
      }
    }
    if (!series.values.empty()) {
      timeline.series.push_back(std::move(series));
    }
  }
}

/// How sure the poses of a track are, frame by frame, and a mark for each run of frames that were
/// bridged.
void add_track(ViewTimeline& timeline, const TrackedMotion& tracked) {
  const std::vector<int>& ids = tracked.motion.frame_ids;
  const auto add = [&](const std::string& name, const Eigen::VectorXd& values) {
    timeline.series.push_back({name, "track", ids, {values.begin(), values.end()}});
  };
  if (tracked.deviations.cols() > 0) {
    add("standard deviation of joints, mean (m)", tracked.deviations.rowwise().mean());
    add("standard deviation of joints, largest (m)", tracked.deviations.rowwise().maxCoeff());
  }
  if ((tracked.keypoint_rms.array() > 0).any()) {
    add("keypoints to the fit, root mean square (m)", tracked.keypoint_rms);
  }
  if ((tracked.scan_rms.array() > 0).any()) {
    add("scan to the fit, root mean square (m)", tracked.scan_rms);
  }
  for (std::size_t i = 0; i < tracked.trusted.size(); ++i) {
    const std::size_t first = i;
    while (i < tracked.trusted.size() && tracked.trusted[i] == 0) {
      ++i;
    }
    if (i > first) {
      const std::string run =
          std::to_string(ids[first]) + (i > first + 1 ? " to " + std::to_string(ids[i - 1]) : "");
      timeline.marks.push_back(
          {Severity::Note,
           (i > first + 1 ? "frames " : "frame ") + run +
               ": bridged from those around; too little was seen, or it did not agree",
           "track", ids[first], ""});
    }
  }
}

/// All frames of the layers, and those of the capture.
void set_frames(ViewTimeline& timeline, double fps, std::vector<int> more) {
  std::set<int> ids(more.begin(), more.end());
  for (const ViewLayer& layer : timeline.layers) {
    ids.insert(layer.sequence.frame_ids.begin(), layer.sequence.frame_ids.end());
    fps = fps > 0 ? fps : layer.sequence.fps;
  }
  timeline.frame_ids.assign(ids.begin(), ids.end());
  timeline.fps = fps > 0 ? fps : kStill;
}

double clothed_fps(const CaptureInfo& info) {
  double fps = 0;
  for (const CaptureSequence& sequence : info.sequences) {
    if (fps == 0 || sequence.kind == "clothed") {
      fps = sequence.fps;
    }
  }
  return fps;
}

/// Warnings of results and findings of `validate`, as marks.
void add_marks(const Workspace& workspace, ViewTimeline& timeline,
               const std::vector<std::string>& of_stages) {
  std::vector<std::string> cameras;
  if (timeline.capture) {
    for (const Camera& camera : timeline.capture->cameras) {
      cameras.push_back(camera.id);
    }
  }
  for (const std::string& stage : of_stages) {
    const StageStatus* status = workspace.find(stage);
    if (status == nullptr) {
      continue;
    }
    for (const Finding& finding : status->findings) {
      timeline.marks.push_back(
          mark_of(finding.severity, to_string(finding), stage, timeline.frame_ids, cameras));
    }
    for (const std::string& warning : status->manifest->warnings) {
      const Severity severity = warning.starts_with("error ") ? Severity::Error : Severity::Warning;
      timeline.marks.push_back(mark_of(severity, warning, stage, timeline.frame_ids, cameras));
    }
    for (const std::string& reason : status->reasons) {
      timeline.marks.push_back(
          {Severity::Note, stage + " is outdated: " + reason, stage, std::nullopt, ""});
    }
  }
}

void add_capture_timeline(Workspace& workspace) {
  ViewTimeline timeline;
  timeline.name = "Capture";
  double fps = 0;
  std::optional<std::string> problem;
  for (const char* stage : {"reconstruct", "track", "validate"}) {
    const StageStatus* status = workspace.find(stage);
    if (status == nullptr || timeline.capture || status->manifest->inputs.empty() ||
        status->manifest->inputs.front().kind != "capture") {
      continue;
    }
    const auto failed = problem_of([&] {
      Dataset dataset = dataset_of(*status);
      fps = clothed_fps(dataset.info);
      if (dataset.calibrated) {
        timeline.capture = std::move(dataset);
      }
    });
    problem = problem ? problem : failed;
  }
  if (problem && !timeline.capture) {
    workspace.scene.notes.push_back("the cameras and their images cannot be shown: " + *problem +
                                    "; if the capture was moved, move it back");
  }
  if (const StageStatus* status = workspace.find("reconstruct")) {
    const fs::path result = workspace.result(*status);
    workspace.try_to("reconstruct", [&] {
      if (fs::exists(result / "scans")) {
        ViewLayer layer;
        layer.name = "scan";
        layer.stage = "reconstruct";
        layer.role = "scan";
        layer.sequence = scans_in(result / "scans", fps);
        timeline.layers.push_back(std::move(layer));
      }
    });
    if (fs::exists(result / "keypoints3d")) {
      timeline.keypoints3d = result / "keypoints3d";
    }
  }
  if (const StageStatus* status = workspace.find("body")) {
    workspace.try_to("body", [&] {
      timeline.layers.push_back(sequence_layer(workspace.result(*status), "body", "body", "body"));
    });
  }
  if (const StageStatus* status = workspace.find("avatar")) {
    workspace.try_to("avatar", [&] {
      const fs::path result = workspace.result(*status);
      ViewLayer layer = sequence_layer(result / "surface", "avatar", "avatar", "body");
      layer.shown = false;
      if (fs::exists(result / "texture.png")) {
        layer.texture = result / "texture.png";
      }
      timeline.layers.push_back(std::move(layer));
    });
  }
  if (const StageStatus* status = workspace.find("register")) {
    const fs::path result = workspace.result(*status);
    workspace.try_to("register", [&] {
      for (const fs::path& folder : sequence_folders(result / "registered")) {
        const std::string name = folder.filename().string();
        ViewLayer layer = sequence_layer(folder, "register", name, "garment");
        add_garment_shapes(workspace, layer, name);
        timeline.layers.push_back(std::move(layer));
      }
    });
    workspace.try_to("the figures of register", [&] {
      add_figures_file(timeline, result / "figures.json", figure_source(*status));
    });
  }
  if (timeline.capture && workspace.find("track") != nullptr) {
    workspace.try_to("the track", [&] {
      if (const auto track = reported_track(workspace.places(), *timeline.capture)) {
        add_track(timeline, track->motion);
      }
    });
  }
  // Of scans and registered surfaces, which hide each other, the surfaces at first.
  if (timeline.layers.size() > 1 && timeline.layers.front().role == "scan") {
    timeline.layers.front().shown = false;
  }
  set_frames(timeline, fps, timeline.capture ? frame_ids(*timeline.capture) : std::vector<int>{});
  add_marks(workspace, timeline,
            {"validate", "reconstruct", "personalize", "track", "body", "refine", "template",
             "register", "flatten", "appearance", "avatar"});
  if (!timeline.layers.empty() || timeline.capture) {
    workspace.scene.timelines.push_back(std::move(timeline));
  }
}

/// The body that simulated garments hang on, in the frames of the simulation.
std::optional<ViewLayer> simulated_body(const StageStatus& status, const Sequence& garment) {
  const fs::path folder = status.manifest->inputs.front().path;
  if (!fs::is_directory(folder)) {
    return std::nullopt;
  }
  OptionSet set = option_set<SimulateOptions>();
  for (const ManifestOption& option : status.manifest->options) {
    const nlohmann::json value = parse_json(option.json, "manifest.json");
    set_option(set.table, option.name, value.is_string() ? value.get<std::string>() : option.json);
  }
  const SimulationScene scene = read_scene_body(scene_in(folder), options_of<SimulateOptions>(set));
  if (scene.body_faces.rows() == 0) {
    return std::nullopt;
  }
  ViewLayer layer;
  layer.name = "body";
  layer.stage = "simulate";
  layer.role = "body";
  layer.sequence.fps = garment.fps;
  layer.sequence.frame_ids = garment.frame_ids;
  layer.sequence.faces = scene.body_faces;
  layer.sequence.load = [body = scene.body, faces = scene.body_faces, ids = garment.frame_ids,
                         mutex = std::make_shared<std::mutex>()](Index i) {
    const std::lock_guard lock(*mutex);
    Mesh mesh;
    mesh.vertices = body(ids[static_cast<std::size_t>(i)]);
    mesh.faces = faces;
    return mesh;
  };
  return layer;
}

void add_simulation(Workspace& workspace) {
  const StageStatus* status = workspace.find("simulate");
  if (status == nullptr) {
    return;
  }
  const fs::path result = workspace.result(*status);
  ViewTimeline timeline;
  timeline.name = "Simulation";
  workspace.try_to("simulate", [&] {
    for (const fs::path& folder : sequence_folders(result)) {
      ViewLayer layer = sequence_layer(folder, "simulate", folder.filename().string(), "garment");
      const fs::path scene = status->manifest->inputs.front().path;
      workspace.try_to("the strain of the simulated garment", [&] {
        const ScenePaths paths = fs::is_directory(scene) ? scene_in(scene) : ScenePaths{};
        if (paths.garments.size() == 1 && paths.garments.front().extension() != ".h5") {
          layer.rest = fitting_mesh(paths.garments.front(), layer);
        }
      });
      workspace.try_to("the pattern", [&] {
        const StageStatus* flatten = workspace.find("flatten");
        if (flatten == nullptr) {
          return;
        }
        for (const auto& entry : fs::directory_iterator(workspace.result(*flatten))) {
          if (entry.is_directory() && !layer.pattern) {
            layer.pattern = fitting_mesh(entry.path() / "garment.obj", layer);
          }
        }
      });
      timeline.layers.push_back(std::move(layer));
    }
  });
  if (timeline.layers.empty()) {
    return;
  }
  workspace.try_to("the body of the simulation", [&] {
    if (auto body = simulated_body(*status, timeline.layers.front().sequence)) {
      timeline.layers.insert(timeline.layers.begin(), std::move(*body));
    }
  });
  workspace.try_to("the table of simulate",
                   [&] { add_table(timeline, result / "frames.csv", figure_source(*status)); });
  set_frames(timeline, 0, {});
  add_marks(workspace, timeline, {"material", "simulate"});
  workspace.scene.timelines.push_back(std::move(timeline));
}

void add_animation(Workspace& workspace) {
  const StageStatus* status = workspace.find("animate");
  if (status == nullptr) {
    return;
  }
  const fs::path result = workspace.result(*status);
  ViewTimeline timeline;
  timeline.name = "Animation";
  workspace.try_to("animate", [&] {
    for (const fs::path& folder : sequence_folders(result)) {
      const std::string name = folder.filename().string();
      const bool garment = folder.parent_path().filename() == "garments";
      ViewLayer layer = sequence_layer(folder, "animate", name, garment ? "garment" : "body");
      if (garment) {
        add_garment_shapes(workspace, layer, name);
      } else if (name == "seen") {
        layer.name = "body, as drawn";
        const StageStatus* avatar = workspace.find("avatar");
        if (avatar != nullptr && fs::exists(workspace.result(*avatar) / "texture.png")) {
          layer.texture = workspace.result(*avatar) / "texture.png";
        }
      }
      layer.shown = garment || name != "body" || !fs::exists(result / "seen");
      timeline.layers.push_back(std::move(layer));
    }
    if (fs::exists(result / "animation.mp4")) {
      timeline.videos.push_back(result / "animation.mp4");
    }
  });
  workspace.try_to("the figures of animate", [&] {
    add_figures_file(timeline, result / "figures.json", figure_source(*status));
  });
  set_frames(timeline, 0, {});
  add_marks(workspace, timeline, {"animate"});
  if (!timeline.layers.empty()) {
    workspace.scene.timelines.push_back(std::move(timeline));
  }
}

/// Folders that texts name: the workspace's own, and those in which its inputs lie.
std::vector<std::string> roots_of(const Workspace& workspace) {
  std::vector<std::string> roots;
  const auto add = [&](const fs::path& folder) {
    roots.push_back(folder.string());
    roots.push_back(fs::absolute(folder).lexically_normal().string());
    roots.push_back(fs::weakly_canonical(folder).string());
  };
  add(workspace.path);
  for (const StageStatus& status : workspace.stages) {
    for (const ManifestInput& input :
         status.manifest ? status.manifest->inputs : std::vector<ManifestInput>{}) {
      if (fs::path(input.path).is_absolute()) {
        add(fs::path(input.path).parent_path());
      }
    }
  }
  return roots;
}

/// A folder of a workspace in which a stage keeps its results.
void refuse_stage_folder(const fs::path& place, std::span<const Stage> stages) {
  const fs::path folder = fs::absolute(place / ".").lexically_normal().parent_path();
  for (const Stage& stage : stages) {
    if (results_of_stage(folder.parent_path(), stage.name) == folder &&
        (fs::exists(folder / "current") || unlinked_results(folder) > 0)) {
      throw DataError(place.string(), "",
                      "the folder of stage " + std::string(stage.name) + " of a workspace",
                      "the workspace: atelier view " + folder.parent_path().string());
    }
  }
}

/// Whether the files of a folder are those of a capture; images alone are those of anything.
bool is_capture(const fs::path& place, bool images_alone) {
  return std::any_of(all_layouts().begin(), all_layouts().end(), [&](const Layout& layout) {
    return (images_alone || std::string(layout.name) != "images") &&
           !layout.recognize(place).empty();
  });
}

/// The first place below a folder, by name, that holds meshes over time; none where there is none.
std::optional<fs::path> mesh_frames_below(const fs::path& root) {
  std::optional<fs::path> first;
  constexpr int kDeepest = 4;
  for (auto it =
           fs::recursive_directory_iterator(root, fs::directory_options::skip_permission_denied);
       it != fs::recursive_directory_iterator(); ++it) {
    if (it.depth() >= kDeepest) {
      it.disable_recursion_pending();
    }
    const bool other = lower_extension(it->path()) == ".npz";  // more often parameters than meshes
    if (!other && holds_mesh_frames(it->path()) && (!first || it->path() < *first)) {
      first = it->path();
    }
  }
  return first;
}

}  // namespace

ViewKind view_kind(const fs::path& place, std::span<const Stage> stages) {
  if (!fs::exists(place)) {
    throw DataError(place.string(), "", "nothing is there", kTaken);
  }
  if (!fs::is_directory(place)) {
    if (place.filename() == kHeader) {
      return ViewKind::Sequences;
    }
    if (holds_mesh_frames(place)) {
      return ViewKind::MeshFrames;
    }
    if (!is_mesh_file(place)) {
      throw DataError(place.string(), "", "a file of another kind", kTaken);
    }
    return ViewKind::Mesh;
  }
  for (const Stage& stage : stages) {
    const fs::path folder = results_of_stage(place, stage.name);
    if (fs::exists(folder / "current") || unlinked_results(folder) > 0) {
      return ViewKind::Workspace;
    }
  }
  if (fs::exists(place / "capture.toml") || fs::exists(place / "cameras.json")) {
    return ViewKind::Capture;
  }
  refuse_stage_folder(place, stages);
  if (!sequence_folders(place).empty()) {
    return ViewKind::Sequences;
  }
  if (!is_capture(place, false) && holds_mesh_frames(place)) {
    return ViewKind::MeshFrames;
  }
  if (fs::is_empty(place)) {
    throw DataError(place.string(), "", "an empty folder", kTaken);
  }
  return ViewKind::Capture;  // of another layout, or of none: require_capture
}

void require_capture(const fs::path& place) {
  if (is_capture(place, true)) {
    return;
  }
  require_no_folder_above(place);
  const std::optional<fs::path> meshes = mesh_frames_below(place);
  throw DataError(
      place.string(), "", "no workspace, no capture and no meshes",
      meshes ? "one place: atelier view " + meshes->string() + ", for example" : kTaken);
}

ViewScene view_of_workspace(const fs::path& path, std::span<const StageStatus> stages) {
  Workspace workspace{path, stages, {}};
  workspace.scene.title = fs::absolute(path).lexically_normal().filename().string();
  for (const StageStatus& status : stages) {
    if (status.state == StageStatus::State::Damaged) {
      workspace.scene.notes.push_back(status.stage +
                                      " is damaged: its files are not what the stage wrote; run "
                                      "the stage again");
    } else if (status.state == StageStatus::State::Newer) {
      workspace.scene.notes.push_back(status.stage + " was written by a newer program");
    }
  }
  add_animation(workspace);
  add_simulation(workspace);
  add_capture_timeline(workspace);
  const std::vector<std::string> roots = roots_of(workspace);
  for (std::string& note : workspace.scene.notes) {
    note = without_folders(note, roots);
  }
  for (ViewTimeline& timeline : workspace.scene.timelines) {
    for (ViewMark& mark : timeline.marks) {
      mark.text = without_folders(mark.text, roots);
    }
  }
  if (workspace.scene.timelines.empty()) {
    throw DataError(path.string(), "", "no result with anything to see",
                    "results of reconstruct, body, register, simulate or animate; atelier status "
                    "lists what there is");
  }
  return std::move(workspace.scene);
}

ViewScene view_of_capture(Dataset dataset) {
  if (!dataset.calibrated || dataset.cameras.empty()) {
    throw DataError(dataset.root.string(), "cameras", "no calibration",
                    "calibrated cameras; atelier calibrate makes them");
  }
  ViewScene scene;
  scene.title = fs::absolute(dataset.root).lexically_normal().filename().string();
  ViewTimeline timeline;
  timeline.name = "Capture";
  set_frames(timeline, clothed_fps(dataset.info), frame_ids(dataset));
  if (timeline.frame_ids.empty()) {
    throw DataError(dataset.root.string(), "images", "no frames", "images of the cameras");
  }
  std::vector<std::string> cameras;
  for (const Camera& camera : dataset.cameras) {
    cameras.push_back(camera.id);
  }
  const std::vector<std::string> roots = {dataset.root.string(),
                                          fs::absolute(dataset.root).lexically_normal().string()};
  for (const Finding& finding : dataset.findings) {
    timeline.marks.push_back(
        mark_of(finding.severity, to_string(finding), "", timeline.frame_ids, cameras));
    timeline.marks.back().text = without_folders(timeline.marks.back().text, roots);
  }
  timeline.capture = std::move(dataset);
  scene.timelines.push_back(std::move(timeline));
  return scene;
}

ViewScene view_of_sequences(const fs::path& place) {
  const fs::path root =
      fs::is_directory(place) ? place : fs::absolute(place).lexically_normal().parent_path();
  ViewScene scene;
  scene.title = fs::absolute(root / ".").lexically_normal().parent_path().filename().string();
  ViewTimeline timeline;
  timeline.name = "Sequence";
  for (const fs::path& folder : sequence_folders(root)) {
    const std::string name = sequence_name(folder);
    const bool body = name == "body" || name == "seen" || name == "surface";
    timeline.layers.push_back(sequence_layer(folder, "", name, body ? "body" : "garment"));
  }
  add_table(timeline, root / "frames.csv", {});
  set_frames(timeline, 0, {});
  if (timeline.frame_ids.empty()) {
    throw DataError(root.string(), "", "no frames", "a sequence with frames");
  }
  scene.timelines.push_back(std::move(timeline));
  return scene;
}

ViewMark mark_of(Severity severity, const std::string& text, const std::string& stage,
                 const std::vector<int>& frame_ids, const std::vector<std::string>& cameras) {
  ViewMark mark{severity, text, stage, std::nullopt, ""};
  std::vector<std::string> words(1);
  std::set<std::size_t> bracketed;  // a finding's place: "camera-off [07]: ..."
  for (const char c : text) {
    if (c == '[') {
      bracketed.insert(words.back().empty() ? words.size() - 1 : words.size());
    }
    const bool in_word = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-';
    if (in_word) {
      words.back() += c;
    } else if (!words.back().empty()) {
      words.emplace_back();
    }
  }
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    int id = -1;
    const bool number =
        !word.empty() && std::from_chars(word.data(), word.data() + word.size(), id).ptr ==
                             word.data() + word.size();
    constexpr std::size_t kFileDigits = 6;
    const bool of_frame = i > 0 && (words[i - 1] == "frame" || words[i - 1] == "frames");
    if (!mark.frame_id && number && (of_frame || word.size() == kFileDigits) &&
        std::binary_search(frame_ids.begin(), frame_ids.end(), id)) {
      mark.frame_id = id;
    } else if (mark.camera.empty() &&
               std::find(cameras.begin(), cameras.end(), word) != cameras.end()) {
      // A camera called 7 is not meant by every 7.
      const bool plain_number = number && word.size() < kFileDigits;
      if (!plain_number || bracketed.contains(i) ||
          (i > 0 &&
           (words[i - 1] == "camera" || words[i - 1] == "images" || words[i - 1] == "keypoints2d" ||
            words[i - 1] == "labels" || words[i - 1] == "masks"))) {
        mark.camera = word;
      }
    }
  }
  return mark;
}

}  // namespace atelier
