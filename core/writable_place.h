#pragma once

#include <filesystem>

namespace atelier {

/// Refuses a file that could not be written at the end, before the work for it begins: throws
/// EnvironmentError if its folder is missing or cannot be written into, which is tried.
void require_file_place(const std::filesystem::path& file);

/// The same of a folder that is made if it is missing, with those above it.
void require_folder_place(const std::filesystem::path& folder);

}  // namespace atelier
