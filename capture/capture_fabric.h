#pragma once

#include <filesystem>
#include <string>

namespace atelier {

/// Appearance of the cloth of a synthetic capture ("plain", "woven", "print", "all-print",
/// "coded"), as its synthesis.json says; empty where nothing says it. Throws DataError for a file
/// that is no JSON.
std::string capture_fabric(const std::filesystem::path& capture);

}  // namespace atelier
