#include "core/store/collect_garbage.h"

#include <optional>
#include <system_error>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/store/commit.h"
#include "core/store/file_kind.h"
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

/// What an entry of a stage's folder is, if nothing needs it; "" otherwise.
std::string uselessness(const std::filesystem::path& entry,
                        const std::optional<std::string>& current) {
  const std::string name = entry.filename().string();
  const bool folder = link_kind(entry) == file_type::directory;
  if (folder && name.starts_with(".staging-")) {
    const std::size_t frames = read_frame_logs(entry).size();
    return "unfinished work of " + std::to_string(frames) + (frames == 1 ? " frame" : " frames");
  }
  if (folder && name.starts_with(".replaced-")) {
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
  if (file_kind(workspace) != file_type::directory) {
    throw DataError(workspace.string(), "", "no folder", "a workspace");
  }
  std::vector<Garbage> all;
  for (const Stage& stage : stages) {
    const std::filesystem::path folder = workspace / stage.name;
    if (link_kind(folder) == file_type::not_found) {
      continue;
    }
    require_folder(folder);
    const auto lock = FileLock::try_lock(folder / ".lock", FileLock::Mode::Exclusive);
    const auto current = current_name(folder);
    std::vector<Garbage> found;
    for (const std::filesystem::path& entry : list_folder(folder)) {
      const std::string what = uselessness(entry, current);
      if (!what.empty()) {
        found.push_back({entry, what, bytes_below(entry), false});
      }
    }
    for (Garbage& garbage : found) {
      const bool is_folder = link_kind(garbage.path) == file_type::directory;
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
