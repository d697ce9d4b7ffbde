#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/finding.h"
#include "core/store/digest_meter.h"
#include "core/store/manifest.h"
#include "core/store/stage.h"

namespace atelier {

// Content of a workspace, for each stage that ran:
//
//   <stage>/.lock                  flock(2): one run of the stage, or several of disjoint frames
//   <stage>/.commit-lock           held for the moment in which a result is made current
//   <stage>/<key16>/               a finished result: outputs and, written last, manifest.json
//   <stage>/current -> <key16>     the result of the latest request
//   <stage>/.staging-<key16>/      work that is not finished

/// How closely outputs are compared with their manifest.
enum class Check {
  Sizes,    ///< names, kinds and sizes: one stat per file
  Digests,  ///< also every byte
};

/// The manifest of a result's folder. Throws DataError unless it is there, sound, of that stage,
/// which may have its former name, and of the key that the folder is named after.
Manifest read_manifest(const std::filesystem::path& folder, std::string_view stage);

/// True of a result whose manifest has a later schema, which this program may neither replace nor
/// remove.
bool is_of_newer_program(const std::filesystem::path& folder, std::string_view stage);

/// Everything in which a result's folder differs from its manifest: "output-missing",
/// "output-extra", "output-kind" (a link, folder or device), "output-size", "output-digest",
/// "manifest-time" (a finish in the future, a warning), "consent-ended" (a warning),
/// "consent-changed" (a warning: the inputs state another consent today). Empty if they agree.
/// Digests are taken on several threads; throws StopRequested if `events.stop` says so meanwhile.
std::vector<Finding> check_outputs(const std::filesystem::path& folder, const Manifest& manifest,
                                   Check check, const StageEvents& events = {});

/// True for 16 lower-case hexadecimal digits.
bool is_folder_name(std::string_view name);

/// The `<key16>` of `<prefix><key16>`, as in `.staging-<key16>`; "" of any other name, which no
/// stage gave.
std::string_view key_behind(std::string_view prefix, std::string_view name);

/// The folder `<stage>/<key16>` of a result that a real path is or lies in; "" where it is in none.
std::filesystem::path result_around(const std::filesystem::path& path);

/// Throws DataError unless the workspace is a folder with a folder of one of the stages;
/// EnvironmentError if it cannot be looked at.
void require_workspace(std::span<const Stage> stages, const std::filesystem::path& workspace);

/// The folder of a stage's results: WORKSPACE/STAGE, or, where only that is there, the one of the
/// stage's former name (core/renamed_options.h), whose results are read as this stage's.
std::filesystem::path results_of_stage(const std::filesystem::path& workspace,
                                       std::string_view stage);

/// The name that `<stage>/current` points to; nothing if it is missing or no link to a result
/// beside it. Links are never followed. Throws EnvironmentError if it cannot be looked at,
/// DataError for a file in the stage folder's place.
std::optional<std::string> current_name(const std::filesystem::path& stage_folder);

/// The error "current-folder" where a folder lies in the place of the link `current`, which no link
/// can replace.
std::optional<Finding> current_folder_finding(const std::filesystem::path& stage_folder);

/// Refuses such a folder, and what is no folder in the place of the stage's own. Throws DataError.
void require_usable_stage_folder(const std::filesystem::path& stage_folder);

/// How many results of a stage there are if no link says which of them is current, and the stage
/// can make one; else 0.
std::int64_t unlinked_results(const std::filesystem::path& stage_folder);

/// Makes `current` point to a result beside it, in one step, and syncs the folder.
void set_current(const std::filesystem::path& stage_folder, const std::string& name);

/// The folder itself: not missing, not a link, not a file. Throws DataError otherwise, and
/// EnvironmentError if it cannot be looked at.
void require_folder(const std::filesystem::path& path);

}  // namespace atelier
