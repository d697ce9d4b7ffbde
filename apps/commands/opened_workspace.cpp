#include "apps/commands/opened_workspace.h"

#include "apps/console/failure.h"
#include "apps/console/standard_streams.h"
#include "core/error.h"
#include "core/file_kind.h"
#include "core/io/file_bytes.h"
#include "core/limits.h"
#include "core/printable.h"
#include "core/seal/packed_folder.h"
#include "core/seal/sealed_file.h"
#include "core/usage_error.h"
#include "pipeline/sealing/access_log.h"
#include "pipeline/sealing/sealing_note.h"

namespace atelier {

OpenedWorkspace::OpenedWorkspace(const std::string& workspace, const KeyArguments& keys)
    : path_(workspace) {
  if (!is_sealed_file(workspace)) {
    if (keys.any() && file_kind(workspace) != std::filesystem::file_type::directory) {
      throw DataError(workspace, "", "neither a folder nor a sealed file",
                      "a workspace, or one that atelier seal wrote, whole");
    }
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
  call_place(path_, workspace);
  seal_ = OpenedSeal{workspace, sealed.digest(), sealed.opened_by()};
  if (const std::filesystem::path note = content / kSealingNote;
      file_kind(note) == std::filesystem::file_type::regular) {
    checked_ = parse_sealing_note(read_file_text(note, Limits{}.text_file_bytes), note.string())
                   .digests_checked;
  }
  log("open", "by " + seal_->by);
}

void OpenedWorkspace::log(const std::string& action, const std::string& detail) const {
  write_log([&] { seal_ ? log_use(*seal_, action, detail) : log_access(path_, action, detail); });
}

void write_log(const std::function<void()>& write) {
  const auto warn = [](const std::exception& error) {
    standard_error() << "warning: the log was not written: " << printable(error.what()) << "\n";
  };
  try {
    write();
  } catch (const EnvironmentError& error) {
    warn(error);
  } catch (const DataError& error) {
    warn(error);
  }
}

}  // namespace atelier
