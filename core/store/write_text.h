#pragma once

#include <filesystem>
#include <string_view>

namespace atelier {

/// Fills the temporary file that a StageRun hands out; the runner syncs, digests and renames it.
/// Throws EnvironmentError if the disk is full or fails. (For files under their final name there is
/// AtomicFile.)
void write_text(const std::filesystem::path& file, std::string_view text);

}  // namespace atelier
