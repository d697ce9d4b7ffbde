#include "core/new_folders.h"

#include <system_error>

#include <unistd.h>

namespace atelier {

NewFolders::NewFolders(const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::path folder = std::filesystem::absolute(path, error);
  while (!error && folder != folder.parent_path() &&
         std::filesystem::symlink_status(folder, error).type() ==
             std::filesystem::file_type::not_found) {
    error.clear();  // that it is missing counts as one
    if (folder.has_filename()) {
      missing_.push_back(folder);
    }
    folder = folder.parent_path();
  }
}

void NewFolders::remove_empty() const noexcept {
  for (const std::filesystem::path& folder : missing_) {
    rmdir(folder.c_str());
  }
}

}  // namespace atelier
