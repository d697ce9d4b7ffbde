#include "core/writable_place.h"

#include <cerrno>
#include <cstdlib>
#include <string>
#include <system_error>

#include <unistd.h>

#include "core/error.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

std::filesystem::path parent_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

void require_writable(const std::filesystem::path& folder) {
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error) && !error) {
    throw EnvironmentError(folder.string(), "not a folder: choose a path in a folder");
  }
  // Tried, since permissions do not tell of it: /proc, a disk that is full.
  std::string trial = (folder / ".atelier-XXXXXX").string();
  if (mkdtemp(trial.data()) == nullptr) {
    throw EnvironmentError(folder.string(), system_reason(errno));
  }
  rmdir(trial.c_str());
}

}  // namespace

void require_file_place(const std::filesystem::path& file) {
  const std::filesystem::path folder = parent_of(file);
  std::error_code error;
  if (std::filesystem::status(folder, error).type() == std::filesystem::file_type::not_found) {
    throw EnvironmentError(folder.string(), "no such folder; create it first");
  }
  require_writable(folder);
}

void require_folder_place(const std::filesystem::path& folder) {
  std::filesystem::path there = std::filesystem::absolute(folder);
  std::error_code error;
  while (std::filesystem::status(there, error).type() == std::filesystem::file_type::not_found &&
         there != there.parent_path()) {
    there = there.parent_path();
  }
  require_writable(there);
}

}  // namespace atelier
