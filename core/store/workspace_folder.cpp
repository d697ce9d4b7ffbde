#include "core/store/workspace_folder.h"

#include <algorithm>
#include <cstdio>
#include <system_error>
#include <vector>

#include <sys/stat.h>

#include "core/error.h"
#include "core/file_kind.h"
#include "core/regular_file.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

using std::filesystem::file_type;

/// "a", "a and b", "a, b and 3 more".
std::string listed(const std::vector<std::string>& names) {
  constexpr std::size_t kShown = 2;
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kShown); ++i) {
    const bool last = i + 1 == names.size() && i > 0;
    text += (i == 0 ? "" : last ? " and " : ", ") + names[i].substr(0, 60);
  }
  return names.size() > kShown ? text + " and " + std::to_string(names.size() - kShown) + " more"
                               : text;
}

}  // namespace

std::string workspace_problem(std::span<const Stage> stages,
                              const std::filesystem::path& workspace) {
  const std::filesystem::path place = workspace_place(workspace);
  if (file_kind(place) != file_type::directory) {
    return "";
  }
  std::vector<std::string> others;
  for (const std::filesystem::path& entry : list_folder(place)) {
    const std::string name = entry.filename().string();
    if (find_stage(stages, name) != nullptr) {
      return "";
    }
    if (!name.starts_with(".") && name != "lost+found") {
      others.push_back(name);
    }
  }
  return others.empty() ? "" : "it holds " + listed(others) + ", and no stage's results";
}

std::filesystem::path workspace_place(const std::filesystem::path& workspace) {
  const bool leads_up = std::find(workspace.begin(), workspace.end(), "..") != workspace.end();
  if (!leads_up || file_kind(workspace) != file_type::not_found) {
    return workspace;
  }
  std::error_code error;
  std::filesystem::path place = std::filesystem::weakly_canonical(workspace, error);
  if (error) {
    throw EnvironmentError(workspace.string(), system_reason(error.value()));
  }
  return place;
}

std::string unseal_advice(const std::filesystem::path& workspace) {
  constexpr std::string_view kSealedStart = "age-encryption.org/v1\n";  // as core/seal has it
  if (file_kind(workspace) != file_type::regular || !begins_with(workspace, kSealedStart)) {
    return "";
  }
  return "atelier unseal " + workspace.string() + " FOLDER --identity KEY opens it";
}

std::string openness_of(const std::filesystem::path& workspace) {
  struct stat status {};
  if (stat(workspace.c_str(), &status) != 0 || (status.st_mode & (S_IRWXG | S_IRWXO)) == 0) {
    return "";
  }
  char mode[8];
  std::snprintf(mode, sizeof mode, "%04o", static_cast<unsigned>(status.st_mode & 07777U));
  return "others may look into " + workspace.string() + " (mode " + mode + "): chmod 700 " +
         workspace.string() + " closes it";
}

}  // namespace atelier
