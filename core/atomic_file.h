#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>

namespace atelier {

/// A file that appears under its name whole or not at all. Bytes go to a temporary name in the same
/// folder; `commit` does write, fsync, close, rename and fsync of the folder, each checked. Without
/// `commit` the temporary file is removed and an older file under the name stays as it was: the
/// destructor never commits, also not while an exception unwinds.
///
/// A disk that is full or fails throws EnvironmentError with the path. After such an error the
/// object can only be destroyed: what fsync has lost once cannot be synced again.
class AtomicFile {
 public:
  /// Creates the temporary file, readable as `mode` says (by default for the owner alone).
  explicit AtomicFile(std::filesystem::path path, unsigned mode = 0600);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// Appends; short writes and interrupted calls are continued.
  void write(std::span<const std::byte> bytes);
  void write(std::string_view text);

  /// Makes the file durable under its name, replacing an older one. Once only.
  void commit();

  /// Where the bytes are until `commit`: for libraries that write by name (HDF5). They may truncate
  /// and rewrite it; `commit` syncs what they wrote.
  const std::filesystem::path& temporary_path() const { return temporary_path_; }

 private:
  std::filesystem::path path_;
  std::filesystem::path temporary_path_;
  int descriptor_ = -1;
};

/// Writes `text` to `path` through AtomicFile.
void write_file_atomically(const std::filesystem::path& path, std::string_view text,
                           unsigned mode = 0600);

/// True for the names that AtomicFile gives to files that are not committed: what a kill leaves
/// behind and a later run may remove.
bool is_temporary_name(std::string_view file_name);

/// Removes what killed writers left in that folder; nothing if there is no such folder. Only for a
/// folder in which nobody else writes at the moment: hold the lock that its writers take. Throws
/// EnvironmentError if something cannot be removed.
void remove_temporaries(const std::filesystem::path& folder);

/// Creates the folder and its missing parents for their owner alone (0700) and syncs the parent of
/// each new one. Nothing happens if it is there; something else of that name is EnvironmentError.
void make_private_directory(const std::filesystem::path& path);

/// fsync of a folder: makes creations, renames and removals in it durable.
void sync_directory(const std::filesystem::path& path);

}  // namespace atelier
