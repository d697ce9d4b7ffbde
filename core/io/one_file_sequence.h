#pragma once

#include <filesystem>

#include "core/sequence.h"

namespace atelier {

/// Writes a sequence over one topology as one archive, schema "atelier.mesh_sequence"
/// (docs/reference/formats.md), vertices as float. Throws DataError from a frame that cannot be
/// read, EnvironmentError if the file cannot be written.
void write_one_file_sequence(const std::filesystem::path& path, const Sequence& sequence);

}  // namespace atelier
