#include "core/store/result.h"

#include <algorithm>
#include <cerrno>
#include <ctime>
#include <map>
#include <optional>
#include <set>
#include <system_error>

#include <sys/stat.h>
#include <unistd.h>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/file_kind.h"
#include "core/io/file_bytes.h"
#include "core/parallel.h"
#include "core/renamed_options.h"
#include "core/store/consent_file.h"
#include "core/store/input_digest.h"
#include "core/store/manifest_limits.h"
#include "core/store/utc_time.h"
#include "core/store/workspace_folder.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

constexpr double kClockSlack = 3600;  // seconds that another machine's clock may be ahead

/// Files of the folder by relative path, with the kind and size found; folders that lead to files
/// are not listed, empty ones are.
std::map<std::string, struct stat> files_below(const std::filesystem::path& folder) {
  std::map<std::string, struct stat> files;
  std::error_code error;
  auto walk = std::filesystem::recursive_directory_iterator(folder, error);
  std::filesystem::path at = folder;  // the folder that cannot be listed, where one cannot
  while (!error && walk != std::filesystem::recursive_directory_iterator()) {
    const std::filesystem::path path = walk->path();
    struct stat status {};
    if (lstat(path.c_str(), &status) != 0) {
      const int reason = errno;
      throw EnvironmentError(denied_place(path, reason).string(), system_reason(reason));
    }
    if (!S_ISDIR(status.st_mode)) {
      files[path.lexically_relative(folder).generic_string()] = status;
    }
    at = path;
    walk.increment(error);
  }
  if (error) {
    throw EnvironmentError(denied_place(at, error.value()).string(),
                           "cannot list the folder: " + system_reason(error.value()));
  }
  return files;
}

/// Where consent is stated today, for who has to renew it.
std::string consent_place(const Manifest& manifest) {
  for (const ManifestInput& input : manifest.inputs) {
    if (!input.stage.empty()) {
      continue;
    }
    try {
      const std::filesystem::path file = consent_file(input.path);
      if (!file.empty()) {
        return file.string();
      }
    } catch (const DataError&) {  // it states nothing that can be read now
    } catch (const EnvironmentError&) {
    }
  }
  return std::string("the capture.toml or ") + kConsentFile + " of the capture";
}

/// The consent that the inputs state today, in the manifest's order; nothing where one of them is
/// not there any more, or may not be read. Throws DataError where a file of consent is damaged.
/// @param folder  of the result, beside which results of earlier stages lie
std::optional<std::vector<Consent>> consent_today(const std::filesystem::path& folder,
                                                  const Manifest& manifest, int depth = 0) {
  constexpr int kMaxStages = 16;  // a chain is no longer; damaged manifests might go in a circle
  std::vector<Consent> today;
  for (const ManifestInput& input : manifest.inputs) {
    std::vector<Consent> stated;
    const std::filesystem::path handed = input.stage.empty() ? result_around(input.path) : "";
    if (input.stage.empty() && handed.empty()) {
      try {
        if (file_kind(input.path) == std::filesystem::file_type::not_found) {
          return std::nullopt;
        }
        stated = read_consent(input.path);
      } catch (const EnvironmentError&) {  // `status` says that it cannot be compared
        return std::nullopt;
      }
    } else {
      const std::string stage =
          handed.empty() ? input.stage : handed.parent_path().filename().string();
      const std::string name = std::filesystem::path(input.path).filename().string();
      if (depth == kMaxStages ||
          (handed.empty() && (!is_folder_name(name) || !is_safe_output_path(stage)))) {
        return std::nullopt;
      }
      const std::filesystem::path result =
          handed.empty() ? folder / "../.." / stage / name : handed;
      std::optional<Manifest> maker;
      try {
        maker = read_manifest(result, stage);
      } catch (const DataError&) {  // removed since, or damaged, which is told where it lies
        return std::nullopt;
      } catch (const EnvironmentError&) {
        return std::nullopt;
      }
      const auto of_maker = consent_today(result, *maker, depth + 1);
      if (!of_maker) {
        return std::nullopt;
      }
      stated = *of_maker;
    }
    add_consent(today, stated);
  }
  return today;
}

/// "consent-ended" for each that is over.
void note_ended_consent(const std::filesystem::path& folder, const Manifest& manifest,
                        const std::vector<Consent>& consent, std::vector<Finding>& findings) {
  for (const std::string& sentence :
       ended_consent(consent, static_cast<double>(std::time(nullptr)))) {
    findings.push_back({Severity::Warning, "consent-ended", folder.string(), sentence,
                        "renew it in " + consent_place(manifest) +
                            " and run the stage again, or delete what was made from it"});
  }
}

/// "consent-changed" where the inputs state another consent today than the manifest.
void check_consent_today(const std::filesystem::path& folder, const Manifest& manifest,
                         std::vector<Finding>& findings) {
  const auto note = [&](const std::string& what, const std::string& advice) {
    findings.push_back({Severity::Warning, "consent-changed", folder.string(), what, advice});
  };
  try {
    const auto today = consent_today(folder, manifest);
    if (today && !std::is_permutation(today->begin(), today->end(), manifest.consent.begin(),
                                      manifest.consent.end())) {
      note("the consent has changed since: it was '" + to_string(manifest.consent) +
               "', today it says '" + to_string(*today) + "'",
           "run the stage again, which takes it over, or delete what was made from it");
      std::vector<Consent> others;  // than the manifest's, which are told of anyway
      std::copy_if(today->begin(), today->end(), std::back_inserter(others),
                   [&](const Consent& one) {
                     return std::find(manifest.consent.begin(), manifest.consent.end(), one) ==
                            manifest.consent.end();
                   });
      note_ended_consent(folder, manifest, others, findings);
    }
  } catch (const DataError& error) {
    note(std::string("what the consent says today cannot be read: ") + error.what(),
         "mend the file, which every run refuses as it is, or delete what was made from it");
  }
}

Finding finding(Severity severity, const char* code, const std::filesystem::path& place,
                std::string what) {
  return {severity, code, place.string(), std::move(what), "run the stage again"};
}

}  // namespace

std::filesystem::path result_around(const std::filesystem::path& path) {
  constexpr int kFoldersAbove = 3;
  std::filesystem::path folder = path;
  for (int i = 0; i <= kFoldersAbove && folder.has_relative_path(); ++i) {
    if (is_folder_name(folder.filename().string()) &&
        file_kind(folder / "manifest.json") == std::filesystem::file_type::regular) {
      return folder;
    }
    folder = folder.parent_path();
  }
  return {};
}

Manifest read_manifest(const std::filesystem::path& folder, std::string_view stage) {
  require_folder(folder);
  const std::filesystem::path path = folder / "manifest.json";
  if (link_kind(path) == std::filesystem::file_type::symlink) {
    throw DataError(path.string(), "", "a symbolic link", "the manifest itself");
  }
  const Limits limits = manifest_limits();
  Manifest manifest =
      parse_manifest(read_file_text(path, limits.text_file_bytes), path.string(), limits);
  if (manifest.stage != stage && renamed_stage(manifest.stage) != stage) {
    throw DataError(path.string(), "stage", "'" + manifest.stage + "'",
                    "'" + std::string(stage) + "'");
  }
  const std::string name = folder.filename().string();
  if (is_folder_name(name) && folder_name(manifest.key) != name) {
    throw DataError(path.string(), "key", "the key of folder " + folder_name(manifest.key),
                    "that of the folder it is in");
  }
  return manifest;
}

bool is_of_newer_program(const std::filesystem::path& folder, std::string_view stage) {
  try {
    read_manifest(folder, stage);
  } catch (const NewerManifestError&) {
    return true;
  } catch (const DataError&) {
  } catch (const EnvironmentError&) {
  }
  return false;
}

std::vector<Finding> check_outputs(const std::filesystem::path& folder, const Manifest& manifest,
                                   Check check, const StageEvents& events) {
  std::map<std::string, struct stat> found = files_below(folder);
  found.erase("manifest.json");
  std::vector<Finding> findings;
  std::vector<const ManifestOutput*> to_digest;
  for (const ManifestOutput& output : manifest.outputs) {
    const std::filesystem::path path = folder / output.path;
    const auto file = found.find(output.path);
    if (file == found.end()) {
      findings.push_back(finding(Severity::Error, "output-missing", path, "the file is missing"));
      continue;
    }
    if (!S_ISREG(file->second.st_mode)) {
      findings.push_back(finding(Severity::Error, "output-kind", path,
                                 S_ISLNK(file->second.st_mode) ? "a symbolic link is in its place"
                                                               : "it is no regular file"));
    } else if (file->second.st_size != output.size) {
      findings.push_back(finding(Severity::Error, "output-size", path,
                                 std::to_string(file->second.st_size) +
                                     " bytes, the manifest says " + std::to_string(output.size)));
    } else if (check == Check::Digests) {
      to_digest.push_back(&output);
    }
    found.erase(file);
  }
  for (const auto& [path, status] : found) {
    findings.push_back(finding(Severity::Error, "output-extra", folder / path,
                               "the manifest does not name this file"));
  }
  DigestMeter meter(events);
  for (const ManifestOutput* output : to_digest) {
    meter.expect(output->size);
  }
  std::vector<char> differs(to_digest.size(), 0);
  parallel_for(static_cast<Index>(to_digest.size()), 1, [&](Index begin, Index end) {
    for (Index i = begin; i < end && !meter.stopped(); ++i) {
      const auto at = static_cast<std::size_t>(i);
      const FileDigest digest = digest_of_file(folder / to_digest[at]->path, meter);
      differs[at] = digest.digest != to_digest[at]->digest;
    }
  });
  for (std::size_t i = 0; i < to_digest.size(); ++i) {
    if (differs[i] != 0) {
      findings.push_back(finding(Severity::Error, "output-digest", folder / to_digest[i]->path,
                                 "its bytes are not those that the stage wrote"));
    }
  }
  const double now = static_cast<double>(std::time(nullptr));
  const auto finished = seconds_of_utc(manifest.finished);
  if (!finished || *finished > now + kClockSlack) {
    findings.push_back(
        finding(Severity::Warning, "manifest-time", folder / "manifest.json",
                "finished at '" + manifest.finished + "', which is not in the past"));
  }
  note_ended_consent(folder, manifest, manifest.consent, findings);
  check_consent_today(folder, manifest, findings);
  return findings;
}

bool is_folder_name(std::string_view name) {
  return name.size() == 16 && std::all_of(name.begin(), name.end(), [](char c) {
           return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
         });
}

std::string_view key_behind(std::string_view prefix, std::string_view name) {
  return name.starts_with(prefix) && is_folder_name(name.substr(prefix.size()))
             ? name.substr(prefix.size())
             : "";
}

void require_workspace(std::span<const Stage> stages, const std::filesystem::path& workspace) {
  if (file_kind(workspace) != std::filesystem::file_type::directory) {
    const std::string sealed = unseal_advice(workspace);
    throw DataError(workspace.string(), "", sealed.empty() ? "no folder" : "a sealed file",
                    sealed.empty() ? "a workspace" : "a workspace; " + sealed);
  }
  const bool any = std::any_of(stages.begin(), stages.end(), [&](const Stage& stage) {
    return link_kind(results_of_stage(workspace, stage.name)) !=
           std::filesystem::file_type::not_found;
  });
  if (!any) {
    throw DataError(workspace.string(), "", "a folder in which no stage has run", "a workspace");
  }
}

std::filesystem::path results_of_stage(const std::filesystem::path& workspace,
                                       std::string_view stage) {
  const std::filesystem::path folder = workspace / stage;
  const std::string former = former_stage(stage);
  const auto is_there = [](const std::filesystem::path& path) {
    return link_kind(path) != std::filesystem::file_type::not_found;
  };
  return !former.empty() && !is_there(folder) && is_there(workspace / former) ? workspace / former
                                                                              : folder;
}

std::optional<std::string> current_name(const std::filesystem::path& stage_folder) {
  std::error_code error;
  const std::filesystem::path target =
      std::filesystem::read_symlink(stage_folder / "current", error);
  if (error == std::errc::not_a_directory) {
    require_folder(stage_folder);
  }
  // Neither a missing link nor something else in its place names a result.
  if (error && error != std::errc::no_such_file_or_directory &&
      error != std::errc::invalid_argument) {
    throw EnvironmentError((stage_folder / "current").string(), system_reason(error.value()));
  }
  if (error || !is_folder_name(target.string())) {
    return std::nullopt;
  }
  return target.string();
}

std::optional<Finding> current_folder_finding(const std::filesystem::path& stage_folder) {
  const std::filesystem::path current = stage_folder / "current";
  if (link_kind(current) != std::filesystem::file_type::directory) {
    return std::nullopt;
  }
  return Finding{Severity::Error, "current-folder", current.string(),
                 "a folder, as a copy that follows links leaves it",
                 "remove the folder and run the stage again, which makes a link; "
                 "cp -a copies links as they are"};
}

void require_usable_stage_folder(const std::filesystem::path& stage_folder) {
  if (link_kind(stage_folder) == std::filesystem::file_type::not_found) {
    return;
  }
  require_folder(stage_folder);
  if (const std::optional<Finding> problem = current_folder_finding(stage_folder)) {
    throw DataError(problem->place, "", problem->what, "a link: " + problem->advice);
  }
}

std::int64_t unlinked_results(const std::filesystem::path& stage_folder) {
  if (current_name(stage_folder) || current_folder_finding(stage_folder)) {
    return 0;
  }
  const std::vector<std::filesystem::path> entries = list_folder(stage_folder);
  return std::count_if(entries.begin(), entries.end(), [](const std::filesystem::path& entry) {
    return is_folder_name(entry.filename().string()) &&
           link_kind(entry) == std::filesystem::file_type::directory;
  });
}

void set_current(const std::filesystem::path& stage_folder, const std::string& name) {
  ATELIER_CHECK(is_folder_name(name), name + " names no result");
  const std::filesystem::path link = stage_folder / "current";
  const std::filesystem::path fresh = stage_folder / ".current-new";
  // Only the holder of the commit lock comes here: a link left by a kill is nobody's.
  unlink(fresh.c_str());
  if (symlink(name.c_str(), fresh.c_str()) != 0 || rename(fresh.c_str(), link.c_str()) != 0) {
    throw EnvironmentError(link.string(), system_reason(errno));
  }
  sync_directory(stage_folder);
}

void require_folder(const std::filesystem::path& path) {
  const std::filesystem::file_type kind = link_kind(path);
  if (kind == std::filesystem::file_type::not_found) {
    throw DataError(path.string(), "", "nothing there", "a folder");
  }
  if (kind == std::filesystem::file_type::symlink) {
    throw DataError(path.string(), "", "a symbolic link", "a folder: a workspace holds no links");
  }
  if (kind != std::filesystem::file_type::directory) {
    throw DataError(path.string(), "", "a file", "a folder");
  }
}

}  // namespace atelier
