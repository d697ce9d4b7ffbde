#pragma once

#include <filesystem>

namespace atelier {

/// For other programs, in the folder `export` of the workspace: the avatar as glTF, its motion as
/// BVH and TRC, and the patterns that were found (export_motion.h). `atelier export` writes
/// everything. Recomputed when these results have changed (core/store/derived_folder.h). Throws
/// DataError where a result is missing or damaged, EnvironmentError.
std::filesystem::path exported_avatar(const std::filesystem::path& workspace);

}  // namespace atelier
