#pragma once

#include <filesystem>

#include "core/store/manifest.h"

namespace atelier {

/// Makes a staging folder the result of its key: writes manifest.json, removes everything that the
/// manifest does not name, syncs, renames (replacing an older result of the key in one step where
/// the file system can), syncs the parent and makes the result current. A kill at any point leaves
/// the older result or this one, and a staging folder from which the next run finishes. The caller
/// holds the commit lock. Throws EnvironmentError.
void commit_result(const std::filesystem::path& staging, const std::filesystem::path& result,
                   const Manifest& manifest);

/// The second half, for a staging folder that already has its manifest.
void finish_commit(const std::filesystem::path& staging, const std::filesystem::path& result,
                   const Manifest& manifest);

/// Replaces a result's manifest by one of the same outputs, in one step, durably. The caller holds
/// the commit lock. Throws EnvironmentError.
void replace_manifest(const std::filesystem::path& result, const Manifest& manifest);

/// Where a stage keeps what is not finished (StageRun::scratch_folder), inside its staging folder.
std::filesystem::path scratch_of(const std::filesystem::path& staging);

/// Removes a folder and everything in it; links are removed, not followed. Throws EnvironmentError.
void remove_folder(const std::filesystem::path& folder);

/// Removes a stage's folder that holds nothing but locks that nobody has and
/// work that was not begun. Of any other, nothing.
/// Throws EnvironmentError if it cannot be looked at.
void remove_bare_stage_folder(const std::filesystem::path& stage_folder);

}  // namespace atelier
