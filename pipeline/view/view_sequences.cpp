#include "pipeline/view/view_sequences.h"

#include <algorithm>
#include <utility>

#include "core/error.h"
#include "core/sequence_archive.h"
#include "pipeline/view/view_clock.h"
#include "pipeline/view/view_figures.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHeader = "sequence.h5";

/// Whether a folder of results is not the one that `current` beside it leads to.
bool is_past_result(const fs::path& folder) {
  const fs::path current = folder.parent_path() / "current";
  std::error_code error;
  return fs::is_symlink(current, error) && !fs::equivalent(folder, current, error);
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

}  // namespace

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
  set_layer_frames(timeline);
  if (timeline.frame_ids.empty()) {
    throw DataError(root.string(), "", "no frames", "a sequence with frames");
  }
  scene.timelines.push_back(std::move(timeline));
  return scene;
}

}  // namespace atelier
