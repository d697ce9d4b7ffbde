#pragma once

#include <filesystem>
#include <vector>

namespace atelier {

/// The path that caused `error` (errno) in an access to `path`: where permission was denied
/// (EACCES), the nearest folder above that can be examined but not searched, or `path` itself if it
/// can be examined; else `path`.
std::filesystem::path denied_place(const std::filesystem::path& path, int error);

/// The kind of file at a path, after following links: file_type::not_found only where there is
/// nothing (ENOENT). A path that cannot be examined (no permission, a name too long, a loop of
/// links, a failing disk) is not absent: it throws EnvironmentError with denied_place and the
/// reason.
std::filesystem::file_type file_kind(const std::filesystem::path& path);

/// The same of the path itself: a link is file_type::symlink.
std::filesystem::file_type link_kind(const std::filesystem::path& path);

/// The entries of a folder, sorted by path; none if there is no such folder (another run may have
/// moved it). Throws EnvironmentError if it cannot be listed.
std::vector<std::filesystem::path> list_folder(const std::filesystem::path& folder);

}  // namespace atelier
