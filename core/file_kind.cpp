#include "core/file_kind.h"

#include <algorithm>
#include <cerrno>
#include <system_error>

#include <sys/stat.h>

#include "core/error.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

using std::filesystem::file_type;

file_type kind_of(const std::filesystem::path& path, int (*look)(const char*, struct stat*)) {
  struct stat status {};
  if (look(path.c_str(), &status) != 0) {
    const int error = errno;
    if (error == ENOENT) {
      return file_type::not_found;
    }
    if (error == ELOOP) {
      return file_type::unknown;  // links that lead nowhere, neither file nor folder
    }
    throw EnvironmentError(denied_place(path, error).string(), system_reason(error));
  }
  return S_ISREG(status.st_mode)   ? file_type::regular
         : S_ISDIR(status.st_mode) ? file_type::directory
         : S_ISLNK(status.st_mode) ? file_type::symlink
                                   : file_type::unknown;
}

}  // namespace

std::filesystem::path denied_place(const std::filesystem::path& path, int error) {
  std::filesystem::path folder = path;
  struct stat status {};
  while (error == EACCES && folder.has_relative_path() && stat(folder.c_str(), &status) != 0) {
    folder = folder.has_parent_path() ? folder.parent_path() : ".";
  }
  return folder;
}

file_type file_kind(const std::filesystem::path& path) {
  return kind_of(path, [](const char* name, struct stat* status) { return stat(name, status); });
}

file_type link_kind(const std::filesystem::path& path) {
  return kind_of(path, [](const char* name, struct stat* status) { return lstat(name, status); });
}

std::vector<std::filesystem::path> list_folder(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> paths;
  std::error_code error;
  auto walk = std::filesystem::directory_iterator(folder, error);
  while (!error && walk != std::filesystem::directory_iterator()) {
    paths.push_back(walk->path());
    walk.increment(error);
  }
  if (error && error != std::errc::no_such_file_or_directory) {
    throw EnvironmentError(denied_place(folder, error.value()).string(),
                           "cannot list the folder: " + system_reason(error.value()));
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

}  // namespace atelier
