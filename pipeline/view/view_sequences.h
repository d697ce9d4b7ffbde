#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/view/view_scene.h"

namespace atelier {

/// Folders below `root` that are sequences, itself among them, by name, each once; not those of
/// results that are no longer current.
std::vector<std::filesystem::path> sequence_folders(const std::filesystem::path& root);

/// A sequence in a folder as a layer.
ViewLayer sequence_layer(const std::filesystem::path& folder, const std::string& stage,
                         const std::string& name, const std::string& role);

/// Every sequence in a folder, or the one that it is; a file sequence.h5 is that of its folder.
/// Throws DataError.
ViewScene view_of_sequences(const std::filesystem::path& place);

}  // namespace atelier
