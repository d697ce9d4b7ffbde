#pragma once

#include <optional>
#include <string>

#include "apps/commands/seal_keys.h"
#include "core/seal/private_folder.h"

namespace atelier {

/// A workspace that a command reads: the folder itself, or, of a sealed file, what it holds, in a
/// folder in memory that is gone with the process (PrivateFolder).
class OpenedWorkspace {
 public:
  /// To be made before any thread is started. Throws UsageError for keys without a sealed file and
  /// the other way round, DataError for a file that is damaged or sealed to others, or that holds
  /// no workspace.
  OpenedWorkspace(const std::string& workspace, const KeyArguments& keys);

  const std::string& path() const { return path_; }
  /// Appends to the workspace's log; of a sealed one, which nobody could write into, nothing. A log
  /// that cannot be written is a warning.
  void log(const std::string& action, const std::string& detail) const;

 private:
  std::optional<PrivateFolder> folder_;
  std::string path_;
};

}  // namespace atelier
