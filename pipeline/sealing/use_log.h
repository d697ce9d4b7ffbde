#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/sha256.h"

namespace atelier {

/// A sealed file that was opened.
struct OpenedSeal {
  std::filesystem::path file;
  Digest digest{};  ///< SealedFile::digest: SHA-256 of its header
  std::string by;   ///< the recipient whose key opened it, or "a passphrase"
};

/// Where uses of a sealed file are logged: beside it, "person.sealed.log".
std::filesystem::path use_log_beside(const std::filesystem::path& sealed);

/// The same for those who cannot write there: in their own folder, XDG_STATE_HOME/atelier/sealed
/// (~/.local/state), by the file's digest. Empty where there is no home.
std::filesystem::path use_log_of_user(const Digest& digest);

/// Appends who used a sealed file, how, and which file it was, chained as in the log of a workspace
/// (access_log.h): beside the file or, where that cannot be written, to the user's own. Throws
/// EnvironmentError, DataError where neither log can be written.
void log_use(const OpenedSeal& seal, const std::string& action, const std::string& detail);

/// The logs that there are of a sealed file, as this user may see them.
std::vector<std::filesystem::path> use_logs(const std::filesystem::path& sealed);

}  // namespace atelier
