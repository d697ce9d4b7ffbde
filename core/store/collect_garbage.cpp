#include "core/store/collect_garbage.h"

#include <algorithm>
#include <optional>
#include <system_error>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/store/commit.h"
#include "core/store/file_lock.h"
#include "core/store/frame_log.h"
#include "core/store/result.h"

namespace atelier {
namespace {

std::int64_t bytes_below(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_directory(std::filesystem::symlink_status(path, error))) {
    const auto size = std::filesystem::is_regular_file(std::filesystem::symlink_status(path, error))
                          ? std::filesystem::file_size(path, error)
                          : 0;
    return error ? 0 : static_cast<std::int64_t>(size);
  }
  std::int64_t bytes = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(path, error)) {
    if (std::filesystem::is_regular_file(entry.symlink_status(error))) {
      bytes += static_cast<std::int64_t>(entry.file_size(error));
    }
  }
  return bytes;
}

/// What an entry of a stage's folder is, if nothing needs it; "" otherwise.
std::string uselessness(const std::filesystem::directory_entry& entry,
                        const std::optional<std::string>& current) {
  const std::string name = entry.path().filename().string();
  std::error_code error;
  const bool folder = std::filesystem::is_directory(entry.symlink_status(error));
  if (folder && name.starts_with(".staging-")) {
    return "unfinished work of " + std::to_string(read_frame_logs(entry.path()).size()) + " frames";
  }
  if (folder && name.starts_with(".replaced-")) {
    return "a result that was replaced";
  }
  if (folder && current && is_folder_name(name) && name != *current) {
    return "a result that is no longer current";
  }
  if (!folder && (is_temporary_name(name) || name == ".current-new")) {
    return "left by an interrupted run";
  }
  return "";
}

}  // namespace

std::vector<Garbage> collect_garbage(std::span<const Stage> stages,
                                     const std::filesystem::path& workspace, bool dry_run) {
  std::error_code error;
  if (!std::filesystem::is_directory(workspace, error)) {
    throw DataError(workspace.string(), "", "no folder", "a workspace");
  }
  std::vector<Garbage> all;
  for (const Stage& stage : stages) {
    const std::filesystem::path folder = workspace / stage.name;
    if (!std::filesystem::exists(std::filesystem::symlink_status(folder, error))) {
      continue;
    }
    require_folder(folder);
    const auto lock = FileLock::try_lock(folder / ".lock", FileLock::Mode::Exclusive);
    const auto current = current_name(folder);
    std::vector<Garbage> found;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      const std::string what = uselessness(entry, current);
      if (!what.empty()) {
        found.push_back({entry.path(), what, bytes_below(entry.path()), false});
      }
    }
    std::sort(found.begin(), found.end(),
              [](const Garbage& a, const Garbage& b) { return a.path < b.path; });
    for (Garbage& garbage : found) {
      const bool is_folder =
          std::filesystem::is_directory(std::filesystem::symlink_status(garbage.path, error));
      if (!lock) {
        garbage.what += "; the stage is running";
      } else if (is_folder && !FileLock::try_lock_folder(garbage.path, FileLock::Mode::Exclusive)) {
        garbage.what += "; it is being read";
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
