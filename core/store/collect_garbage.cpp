#include "core/store/collect_garbage.h"

#include <algorithm>
#include <optional>
#include <system_error>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/file_kind.h"
#include "core/store/commit.h"
#include "core/store/file_lock.h"
#include "core/store/frame_log.h"
#include "core/store/result.h"

namespace atelier {
namespace {

using std::filesystem::file_type;

std::int64_t size_of(const std::filesystem::path& file) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  return error ? 0 : static_cast<std::int64_t>(size);  // gone meanwhile: it frees nothing
}

std::int64_t bytes_below(const std::filesystem::path& path) {
  const file_type kind = link_kind(path);
  if (kind != file_type::directory) {
    return kind == file_type::regular ? size_of(path) : 0;
  }
  std::int64_t bytes = 0;
  for (const std::filesystem::path& entry : list_folder(path)) {
    bytes += bytes_below(entry);
  }
  return bytes;
}

/// The name of the current result if there are older ones beside it and it is sound: beside a
/// damaged one they may be the last sound ones, and are needed.
std::optional<std::string> current_over_older(const std::filesystem::path& folder,
                                              std::string_view stage) {
  const auto current = current_name(folder);
  const std::vector<std::filesystem::path> entries = list_folder(folder);
  const bool any_older = std::any_of(entries.begin(), entries.end(), [&](const auto& entry) {
    const std::string name = entry.filename().string();
    return is_folder_name(name) && name != current;
  });
  if (!current || !any_older) {
    return std::nullopt;
  }
  try {
    const Manifest manifest = read_manifest(folder / *current, stage);
    const bool sound = !has_errors(check_outputs(folder / *current, manifest, Check::Digests));
    return sound ? current : std::nullopt;
  } catch (const DataError&) {
    return std::nullopt;
  }
}

/// Description of an entry of a stage's folder, if nothing needs it; "" otherwise.
std::string uselessness(const std::filesystem::path& entry,
                        const std::optional<std::string>& current) {
  const std::string name = entry.filename().string();
  const bool folder = link_kind(entry) == file_type::directory;
  if (folder && !key_behind(".staging-", name).empty()) {
    const std::size_t frames = read_frame_logs(entry).size();
    return "unfinished work of " + std::to_string(frames) + (frames == 1 ? " frame" : " frames");
  }
  if (folder && !key_behind(".replaced-", name).empty()) {
    return "a result that was replaced";
  }
  if (folder && current && is_folder_name(name) && name != *current) {
    return "a result that is no longer current";
  }
  if (!folder && (is_temporary_name(name) || name == ".current-new" || name == ".manifest-new")) {
    return "left by an interrupted run";
  }
  return "";
}

}  // namespace

std::vector<Garbage> collect_garbage(std::span<const Stage> stages,
                                     const std::filesystem::path& workspace, bool dry_run) {
  require_workspace(stages, workspace);
  std::vector<Garbage> all;
  for (const Stage& stage : stages) {
    const std::filesystem::path folder = results_of_stage(workspace, stage.name);
    if (link_kind(folder) == file_type::not_found) {
      continue;
    }
    require_folder(folder);
    // Who only asks changes nothing, and may be one who is not allowed to write.
    std::optional<FileLock> lock;
    if (!dry_run) {
      lock = FileLock::try_lock(folder / ".lock", FileLock::Mode::Exclusive);
    }
    const bool running = dry_run ? FileLock::is_held(folder / ".lock") : !lock;
    const auto current = current_over_older(folder, stage.name);
    std::vector<Garbage> found;
    for (const std::filesystem::path& entry : list_folder(folder)) {
      const std::string what = uselessness(entry, current);
      if (!what.empty()) {
        found.push_back({entry, what, bytes_below(entry), "", false});
      }
    }
    for (Garbage& garbage : found) {
      const bool is_folder = link_kind(garbage.path) == file_type::directory;
      if (running) {
        garbage.kept = "the stage is running";
      } else if (is_folder && !FileLock::try_lock_folder(garbage.path, FileLock::Mode::Exclusive)) {
        garbage.kept = "it is being read";
      } else if (is_folder_name(garbage.path.filename().string()) &&
                 is_of_newer_program(garbage.path, stage.name)) {
        garbage.kept = "a newer atelier wrote it";
      } else if (!dry_run) {
        remove_folder(garbage.path);
        garbage.removed = true;
      }
      all.push_back(std::move(garbage));
    }
  }
  return all;
}

}  // namespace atelier
