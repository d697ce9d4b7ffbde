#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace atelier {

/// A folder (0700) for plain data, in memory, which is gone with the process, however that ends.
///
/// Where the system allows it (root, or user namespaces) it is a tmpfs of this process alone, in a
/// mount namespace of its own: no other process sees it, and the kernel frees it with the last
/// process in it. Else it lies on the tmpfs of XDG_RUNTIME_DIR or /dev/shm, and a child process
/// removes it once this one has ended. Swap may hold pages of either, but for a tmpfs of a kernel
/// that knows `noswap` (6.4).
///
/// While it is there TMPDIR names it, so that what this process and its children put aside between
/// two steps (scenes that are drawn, pictures on their way) lies in it, too.
///
/// To be made before any thread is started.
class PrivateFolder {
 public:
  /// @param own_mount  false: always the second way
  /// Throws EnvironmentError where there is no tmpfs.
  explicit PrivateFolder(bool own_mount = true);
  ~PrivateFolder();
  PrivateFolder(const PrivateFolder&) = delete;
  PrivateFolder& operator=(const PrivateFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// Whether it is of this process alone.
  bool is_mounted() const { return mounted_; }

 private:
  bool mount_own();
  void make_watched();
  void hold_temporaries();

  std::filesystem::path path_;
  std::optional<std::string> tmpdir_before_;
  bool mounted_ = false;
  int watcher_ = -1;  ///< pipe to the child: it removes the folder once this end is closed
  int watcher_id_ = -1;
};

}  // namespace atelier
