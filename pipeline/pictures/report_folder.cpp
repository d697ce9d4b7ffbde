#include "pipeline/pictures/report_folder.h"

#include "core/atomic_file.h"

namespace atelier {

std::filesystem::path report_folder(const std::filesystem::path& workspace) {
  return workspace / "report";
}

FileLock lock_report_folder(const std::filesystem::path& workspace) {
  const std::filesystem::path folder = report_folder(workspace);
  make_private_directory(folder);
  FileLock lock = FileLock::wait(folder / ".lock", FileLock::Mode::Exclusive);
  remove_temporaries(folder);
  return lock;
}

}  // namespace atelier
