#include "core/store/commit.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <set>
#include <string>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/file_kind.h"
#include "core/store/file_lock.h"
#include "core/store/result.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

/// Removes logs, locks and temporary files, and whatever else nobody answers for.
void sweep(const std::filesystem::path& staging, const Manifest& manifest) {
  std::set<std::string> named = {"manifest.json"};
  for (const ManifestOutput& output : manifest.outputs) {
    named.insert(output.path);
  }
  std::error_code error;
  std::vector<std::filesystem::path> unnamed;
  auto walk = std::filesystem::recursive_directory_iterator(staging, error);
  while (!error && walk != std::filesystem::recursive_directory_iterator()) {
    const bool folder = std::filesystem::is_directory(walk->symlink_status(error));
    if (!error && !folder &&
        !named.contains(walk->path().lexically_relative(staging).generic_string())) {
      unnamed.push_back(walk->path());
    }
    walk.increment(error);
  }
  for (const std::filesystem::path& path : unnamed) {
    if (!error) {
      std::filesystem::remove(path, error);
    }
  }
  if (error) {
    throw EnvironmentError(staging.string(),
                           "cannot remove temporary files: " + system_reason(error.value()));
  }
}

/// staging -> result, where a result is there already: in one step if the file system can.
void exchange(const std::filesystem::path& staging, const std::filesystem::path& result) {
  if (renameat2(AT_FDCWD, staging.c_str(), AT_FDCWD, result.c_str(), RENAME_EXCHANGE) == 0) {
    return;
  }
  const int error = errno;
  if (error != EINVAL && error != ENOSYS) {
    throw EnvironmentError(result.string(), "cannot replace it: " + system_reason(error));
  }
  const std::filesystem::path aside =
      result.parent_path() / (".replaced-" + result.filename().string());
  remove_folder(aside);
  if (std::rename(result.c_str(), aside.c_str()) != 0 ||
      std::rename(staging.c_str(), result.c_str()) != 0) {
    throw EnvironmentError(result.string(), "cannot replace it: " + system_reason(errno));
  }
  remove_folder(aside);
}

}  // namespace

void commit_result(const std::filesystem::path& staging, const std::filesystem::path& result,
                   const Manifest& manifest) {
  write_file_atomically(staging / "manifest.json", manifest_text(manifest));
  finish_commit(staging, result, manifest);
}

std::filesystem::path scratch_of(const std::filesystem::path& staging) {
  return staging / ".scratch";
}

void finish_commit(const std::filesystem::path& staging, const std::filesystem::path& result,
                   const Manifest& manifest) {
  if (link_kind(scratch_of(staging)) != std::filesystem::file_type::not_found) {
    remove_folder(scratch_of(staging));
  }
  sweep(staging, manifest);
  sync_directory(staging);
  const std::filesystem::path parent = result.parent_path();
  remove_temporaries(parent);
  struct stat status {};
  const bool replaces = lstat(result.c_str(), &status) == 0;
  if (replaces) {
    exchange(staging, result);
  } else if (std::rename(staging.c_str(), result.c_str()) != 0) {
    throw EnvironmentError(result.string(), "cannot rename to it: " + system_reason(errno));
  }
  sync_directory(parent);
  set_current(parent, result.filename().string());
  if (replaces) {
    remove_folder(staging);  // now the older result
  }
}

void replace_manifest(const std::filesystem::path& result, const Manifest& manifest) {
  // Made outside of the result: a kill leaves no file in it that its manifest does not name.
  const std::filesystem::path fresh = result.parent_path() / ".manifest-new";
  remove_temporaries(result.parent_path());
  write_file_atomically(fresh, manifest_text(manifest));
  if (std::rename(fresh.c_str(), (result / "manifest.json").c_str()) != 0) {
    throw EnvironmentError((result / "manifest.json").string(),
                           "cannot replace it: " + system_reason(errno));
  }
  sync_directory(result);
}

void remove_bare_stage_folder(const std::filesystem::path& stage_folder) {
  const std::filesystem::path lock_file = stage_folder / ".lock";
  const std::filesystem::path commit_lock_file = stage_folder / ".commit-lock";
  const auto is_empty_staging = [](const std::filesystem::path& entry) {
    return !key_behind(".staging-", entry.filename().string()).empty() &&
           link_kind(entry) == std::filesystem::file_type::directory && list_folder(entry).empty();
  };
  const auto is_bare = [&] {
    const std::vector<std::filesystem::path> entries = list_folder(stage_folder);
    return std::all_of(entries.begin(), entries.end(), [&](const std::filesystem::path& entry) {
      return entry == lock_file || entry == commit_lock_file || is_empty_staging(entry);
    });
  };
  if (link_kind(stage_folder) != std::filesystem::file_type::directory || !is_bare()) {
    return;
  }
  // As long as these are held nobody begins to work; who waits for them finds the files gone, and
  // makes new ones (`FileLock`).
  const auto lock = FileLock::try_lock(lock_file, FileLock::Mode::Exclusive);
  const auto commit_lock = FileLock::try_lock(commit_lock_file, FileLock::Mode::Exclusive);
  if (lock && commit_lock && is_bare()) {
    for (const std::filesystem::path& entry : list_folder(stage_folder)) {
      rmdir(entry.c_str());  // of the locks, which are no folders, nothing
    }
    unlink(lock_file.c_str());
    unlink(commit_lock_file.c_str());
    rmdir(stage_folder.c_str());
  }
}

void remove_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::remove_all(folder, error);
  if (error) {
    throw EnvironmentError(folder.string(), "cannot remove it: " + system_reason(error.value()));
  }
}

}  // namespace atelier
