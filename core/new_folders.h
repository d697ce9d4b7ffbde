#pragma once

#include <filesystem>
#include <vector>

namespace atelier {

/// The folders that have to be made on the way to a path: noted before the work, so that work that
/// came to nothing takes them away again.
class NewFolders {
 public:
  /// Notes which of the path and the folders above it are missing.
  explicit NewFolders(const std::filesystem::path& path);

  /// Removes those of them that are there now and empty, the deepest first. Folders that cannot be
  /// removed stay.
  void remove_empty() const noexcept;

 private:
  std::vector<std::filesystem::path> missing_;  ///< the deepest first
};

}  // namespace atelier
