#include "apps/commands/opened_workspace.h"

#include "apps/console/standard_streams.h"
#include "core/error.h"
#include "core/printable.h"
#include "core/seal/packed_folder.h"
#include "core/seal/sealed_file.h"
#include "core/usage_error.h"
#include "pipeline/sealing/access_log.h"

namespace atelier {

OpenedWorkspace::OpenedWorkspace(const std::string& workspace, const KeyArguments& keys)
    : path_(workspace) {
  if (!is_sealed_file(workspace)) {
    if (keys.any()) {
      throw UsageError("--identity does nothing: '" + workspace + "' is not sealed; leave it out");
    }
    return;
  }
  if (!keys.any()) {
    throw UsageError(
        "WORKSPACE '" + workspace +
        "' is sealed: --identity FILE, --passphrase-file FILE or --passphrase opens it");
  }
  folder_.emplace();  // before the keys: a process that may not be dumped may leave no mounts
  SealedFile sealed(workspace, read_keys(keys));
  const std::filesystem::path content = folder_->path() / "workspace";
  unpack_folder([&](std::span<std::uint8_t> buffer) { return sealed.read(buffer); }, content,
                workspace);
  path_ = content.string();
}

void OpenedWorkspace::log(const std::string& action, const std::string& detail) const {
  if (folder_) {
    return;
  }
  const auto warn = [](const std::exception& error) {
    standard_error() << "warning: the log was not written: " << printable(error.what()) << "\n";
  };
  try {
    log_access(path_, action, detail);
  } catch (const EnvironmentError& error) {
    warn(error);
  } catch (const DataError& error) {
    warn(error);
  }
}

}  // namespace atelier
