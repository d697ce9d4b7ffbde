#include "apps/output_place.h"

#include <algorithm>
#include <cerrno>
#include <system_error>

#include <unistd.h>

#include "apps/usage_error.h"
#include "core/error.h"
#include "core/store/file_kind.h"
#include "core/store/workspace_folder.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

std::filesystem::path parent_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

void require_writable(const std::filesystem::path& folder) {
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error) && !error) {
    throw EnvironmentError(folder.string(), "no folder: name a place in a folder");
  }
  if (access(folder.c_str(), W_OK | X_OK) != 0) {
    throw EnvironmentError(folder.string(), system_reason(errno));
  }
}

}  // namespace

void require_file_place(const std::filesystem::path& file) {
  const std::filesystem::path folder = parent_of(file);
  std::error_code error;
  if (std::filesystem::status(folder, error).type() == std::filesystem::file_type::not_found) {
    throw EnvironmentError(folder.string(), "no such folder; make the folder first");
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

void require_new_place(const std::filesystem::path& place, const std::string& argument) {
  // "new/.." is not there as long as "new" is not, but leads to a folder that is.
  if (link_kind(place) != std::filesystem::file_type::not_found ||
      link_kind(workspace_place(place)) != std::filesystem::file_type::not_found) {
    throw UsageError(place.string() + " is there already, and no flag replaces it; name another " +
                     argument + ", or remove it first");
  }
}

bool is_inside(const std::filesystem::path& path, const std::filesystem::path& folder) {
  // A relative path of which nothing is there yet would stay relative.
  const std::filesystem::path here = std::filesystem::current_path();
  const std::filesystem::path real = std::filesystem::weakly_canonical(here / path);
  const std::filesystem::path root = std::filesystem::weakly_canonical(here / folder);
  return std::mismatch(root.begin(), root.end(), real.begin(), real.end()).first == root.end();
}

void require_outside_inputs(const std::filesystem::path& place, std::span<const StageStatus> stages,
                            const std::string& argument) {
  for (const StageStatus& status : stages) {
    for (const ManifestInput& input :
         status.manifest ? status.manifest->inputs : std::vector<ManifestInput>{}) {
      if (!input.path.empty() && is_inside(place, input.path)) {
        throw UsageError(argument + " lies in " + input.path + ", of which '" + status.stage +
                         "' was made and which it would change; name a place outside of it");
      }
    }
  }
}

}  // namespace atelier
