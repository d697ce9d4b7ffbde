#pragma once

#include <functional>
#include <optional>
#include <string>

#include "apps/commands/seal_keys.h"
#include "core/seal/private_folder.h"
#include "core/store/result.h"
#include "pipeline/sealing/use_log.h"

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
  /// Check::Digests, or Check::Sizes where whoever sealed it has compared the digests: what was
  /// opened is what was sealed, to the bit.
  Check check_needed() const { return checked_ ? Check::Sizes : Check::Digests; }
  /// Appends to the workspace's log; of a sealed one, to that of the sealed file, which already has
  /// a line on its being opened. A log that cannot be written is a warning.
  void log(const std::string& action, const std::string& detail) const;

 private:
  std::optional<PrivateFolder> folder_;
  std::optional<OpenedSeal> seal_;
  std::string path_;
  bool checked_ = false;
};

/// Writes into a log by `write`; a log that cannot be written is a warning.
void write_log(const std::function<void()>& write);

}  // namespace atelier
