#include "pipeline/view/view_workspace.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/io/json.h"
#include "core/io/mesh_file.h"
#include "pipeline/cloth/simulation_scene.h"
#include "pipeline/pictures/report_drawings.h"
#include "pipeline/view/view_clock.h"
#include "pipeline/view/view_data.h"
#include "pipeline/view/view_figures.h"
#include "pipeline/view/view_marks.h"
#include "pipeline/view/view_meshes.h"
#include "pipeline/view/view_sequences.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

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

FigureSource figure_source(const StageStatus& status) {
  return {status.stage, status.row != nullptr ? status.row->metrics : FigureSource{}.metrics};
}

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
  std::optional<std::string> problem;
  for (const char* stage : {"reconstruct", "track", "validate"}) {
    const StageStatus* status = workspace.find(stage);
    if (status == nullptr || timeline.capture || status->manifest->inputs.empty() ||
        status->manifest->inputs.front().kind != "capture") {
      continue;
    }
    const auto failed = problem_of([&] {
      Dataset dataset = dataset_of(*status);
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
        layer.sequence = scans_in(result / "scans", 0);
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
  if (timeline.capture) {
    set_capture_frames(timeline, timeline.capture->info.sequences, frame_ids(*timeline.capture));
  } else {
    set_layer_frames(timeline);
  }
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
  set_layer_frames(timeline);
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
  set_layer_frames(timeline);
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

}  // namespace

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

}  // namespace atelier
