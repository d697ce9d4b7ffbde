#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace atelier {

/// The folder of a stage's current result. Throws DataError where there is none, with the command
/// that computes it.
std::filesystem::path required_result(const std::filesystem::path& workspace,
                                      const std::string& stage);

/// A folder of a workspace that is made of results: recomputed only when these have changed or the
/// folder itself has, and then whole, with their consent, in place of the one before.
/// @param results  folders of results, as required_result gives them
/// @param fill     fills a new folder
/// Throws DataError where a result is damaged, EnvironmentError.
std::filesystem::path derived_folder(
    const std::filesystem::path& workspace, const std::string& name,
    const std::vector<std::filesystem::path>& results,
    const std::function<void(const std::filesystem::path& folder)>& fill);

}  // namespace atelier
