#include "core/store/output_place.h"

#include <algorithm>

#include "core/file_kind.h"
#include "core/store/workspace_folder.h"
#include "core/usage_error.h"

namespace atelier {
namespace {

/// The capture that a path, which may not be there yet, lies in; empty if in none.
std::filesystem::path capture_around(const std::filesystem::path& place) {
  for (std::filesystem::path folder =
           std::filesystem::weakly_canonical(std::filesystem::absolute(place)).parent_path();
       folder.has_relative_path(); folder = folder.parent_path()) {
    if (file_kind(folder / "capture.toml") != std::filesystem::file_type::not_found) {
      return folder;
    }
  }
  return {};
}

std::string in_capture(const std::string& argument, const std::filesystem::path& capture) {
  return argument + " lies in the capture " + capture.string() +
         ", which it would change; choose a path outside of it";
}

}  // namespace

void require_new_place(const std::filesystem::path& place, const std::string& argument) {
  // "new/.." is not there as long as "new" is not, but leads to a folder that is.
  if (link_kind(place) != std::filesystem::file_type::not_found ||
      link_kind(workspace_place(place)) != std::filesystem::file_type::not_found) {
    throw UsageError(place.string() + " already exists, and no flag replaces it; choose another " +
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

void require_outside_input(const std::filesystem::path& place, const std::filesystem::path& input,
                           const std::string& argument, const std::string& input_name) {
  const std::filesystem::path folder = file_kind(input) == std::filesystem::file_type::regular
                                           ? std::filesystem::absolute(input).parent_path()
                                           : input;
  if (is_inside(place, folder)) {
    throw UsageError(argument + " lies in " + input_name + " " + folder.string() +
                     ", which is not changed; name a place outside of it");
  }
}

void require_outside_inputs(const std::filesystem::path& place, std::span<const StageStatus> stages,
                            const std::string& argument) {
  for (const StageStatus& status : stages) {
    for (const ManifestInput& input :
         status.manifest ? status.manifest->inputs : std::vector<ManifestInput>{}) {
      if (!input.path.empty() && is_inside(place, input.path)) {
        throw UsageError(argument + " lies in " + input.path + ", of which '" + status.stage +
                         "' was made and which it would change; choose a path outside of it");
      }
    }
  }
}

void require_outside_captures(const std::filesystem::path& place, const std::string& argument) {
  if (const std::filesystem::path capture = capture_around(place); !capture.empty()) {
    throw UsageError(in_capture(argument, capture));
  }
}

void require_outside_results(const std::filesystem::path& place,
                             const std::filesystem::path& workspace, std::span<const Stage> stages,
                             const std::string& argument) {
  for (const Stage& stage : stages) {
    if (is_inside(place, workspace / stage.name)) {
      throw UsageError(argument + " lies among the results of '" + std::string(stage.name) +
                       "'; choose a path outside of them");
    }
  }
  if (const std::filesystem::path capture = capture_around(place);
      !capture.empty() && !is_inside(workspace, capture)) {
    throw UsageError(in_capture(argument, capture));
  }
}

}  // namespace atelier
