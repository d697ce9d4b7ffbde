#include "pipeline/view/view_place.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/layouts/layout_table.h"
#include "capture/layouts/open_dataset.h"
#include "core/error.h"
#include "core/io/lower_extension.h"
#include "pipeline/view/view_clock.h"
#include "pipeline/view/view_data.h"
#include "pipeline/view/view_marks.h"
#include "pipeline/view/view_meshes.h"
#include "pipeline/view/view_sequences.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr const char* kTaken =
    "a workspace, a capture, a mesh (.obj .ply .stl .glb .gltf .fbx .usd .usda .usdc .usdz), or "
    "meshes over time: a folder with sequence.h5, a folder of numbered .obj, .ply, .glb, .gltf or "
    ".h5 files, or one file .h5 .hdf5 .npz .usd .usda .usdc .usdz";

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
    if (place.filename() == "sequence.h5") {
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

ViewScene view_of_capture(Dataset dataset) {
  if (!dataset.calibrated || dataset.cameras.empty()) {
    throw DataError(dataset.root.string(), "cameras", "no calibration",
                    "calibrated cameras; atelier calibrate makes them");
  }
  ViewScene scene;
  scene.title = fs::absolute(dataset.root).lexically_normal().filename().string();
  ViewTimeline timeline;
  timeline.name = "Capture";
  set_capture_frames(timeline, dataset.info.sequences, frame_ids(dataset));
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

}  // namespace atelier
