#pragma once

#include <filesystem>
#include <optional>

#include "core/new_folders.h"
#include "core/store/file_lock.h"

namespace atelier {

/// Where a new folder is written until it is whole: ".NAME.unfinished/NAME" beside its place, this
/// run's alone. In the end what is not finished is gone, with the folders above it that were made
/// for it and are empty; the remains of a killed run are overwritten by the next run.
class UnfinishedFolder {
 public:
  /// @param out  the folder to be, which is not there; symbolic links above it are followed
  /// Throws EnvironmentError where another run is writing it.
  explicit UnfinishedFolder(const std::filesystem::path& out);
  ~UnfinishedFolder();
  UnfinishedFolder(const UnfinishedFolder&) = delete;
  UnfinishedFolder& operator=(const UnfinishedFolder&) = delete;

  /// Where to write. Not there yet.
  std::filesystem::path content() const { return folder_ / place_.filename(); }
  /// Moves what was written to its place.
  void finish() const;

 private:
  std::filesystem::path place_;
  std::filesystem::path folder_;
  NewFolders above_;
  std::optional<FileLock> lock_;
};

}  // namespace atelier
