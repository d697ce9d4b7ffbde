#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>

namespace atelier {

/// A regular file, open for reading. Every reader opens its file by this, so that all refuse alike.
class RegularFile {
 public:
  /// Throws DataError if nothing is there, or no regular file (a folder, pipe, device, loop of
  /// links); EnvironmentError if it may not be read, or the disk or the system fails.
  /// @param flags  of open(2), besides those for reading: O_NOFOLLOW
  explicit RegularFile(const std::filesystem::path& path, int flags = 0);
  ~RegularFile();
  RegularFile(const RegularFile&) = delete;
  RegularFile& operator=(const RegularFile&) = delete;

  int descriptor() const { return descriptor_; }
  std::int64_t size() const { return size_; }  ///< bytes, when it was opened

  /// Reads on from where the last read ended. Returns the number of bytes, fewer than the buffer
  /// has only at the end of the file. Throws EnvironmentError. @param path  for the error
  std::size_t read_on(std::span<std::byte> buffer, const std::filesystem::path& path) const;

  /// Throws DataError if it is larger, or what Git LFS leaves in a file's place until the file is
  /// fetched. @param path  for the error
  void check_size(std::int64_t max_bytes, const std::filesystem::path& path) const;

 private:
  int descriptor_ = -1;
  std::int64_t size_ = 0;
};

/// Whether there is a regular file that begins with these bytes. Throws EnvironmentError for one
/// that may not be read, or cannot be.
bool begins_with(const std::filesystem::path& path, std::string_view start);

}  // namespace atelier
