#pragma once

#include <filesystem>

namespace atelier {

/// Throws DataError for an Alembic file (.abc), with what to make of it: no library that this is
/// built with reads the format. Does nothing for any other file.
void refuse_alembic(const std::filesystem::path& path);

}  // namespace atelier
