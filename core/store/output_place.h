#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "core/store/stage.h"
#include "core/store/workspace_status.h"

namespace atelier {

/// Refuses a place that is taken: folders that a command makes, and what it adds to a capture or an
/// export, are never mixed with what is there. `argument` is what names the place: "OUT", "--out".
/// Throws UsageError if anything is there; EnvironmentError if it cannot be looked at.
void require_new_place(const std::filesystem::path& place, const std::string& argument);

/// True if a path that may not be there yet lies in a folder, or is that folder.
bool is_inside(const std::filesystem::path& path, const std::filesystem::path& folder);

/// Refuses a place in what a command reads: the folder, or the one around the file, that `input`
/// is. `argument` names the place, `input_name` what is read: "--out", "CAPTURE". Throws
/// UsageError.
void require_outside_input(const std::filesystem::path& place, const std::filesystem::path& input,
                           const std::string& argument, const std::string& input_name);

/// Refuses a place in what a workspace's results were made of: what is written there would outdate
/// them. Throws UsageError.
void require_outside_inputs(const std::filesystem::path& place, std::span<const StageStatus> stages,
                            const std::string& argument);

/// Refuses a place in a capture, whichever: what is written there would change it, or replace what
/// it holds. Throws UsageError.
void require_outside_captures(const std::filesystem::path& place, const std::string& argument);

/// Refuses a place among the results of a workspace's stages, which are what their manifests say
/// and nothing else, and one in a capture, also in one that was moved since: results name the place
/// where it was. Throws UsageError.
void require_outside_results(const std::filesystem::path& place,
                             const std::filesystem::path& workspace, std::span<const Stage> stages,
                             const std::string& argument);

}  // namespace atelier
