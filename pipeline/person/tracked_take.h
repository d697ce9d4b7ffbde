#pragma once

#include <filesystem>
#include <string>

namespace atelier {

/// The take of a capture that `track` followed: by its name, or the first that is clothed. Throws
/// DataError for a name that was not tracked.
std::filesystem::path tracked_take(const std::filesystem::path& tracked,
                                   const std::filesystem::path& capture, const std::string& name);

}  // namespace atelier
