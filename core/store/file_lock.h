#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

namespace atelier {

/// An flock(2) lock on a file that is created if it is missing. The kernel frees it with the
/// process, however that ends, so that a killed run blocks nobody; there are no PID files.
class FileLock {
 public:
  enum class Mode { Shared, Exclusive };

  /// The lock, or nothing if somebody else's stands against it. Throws EnvironmentError.
  static std::optional<FileLock> try_lock(const std::filesystem::path& path, Mode mode);
  /// True if somebody's lock of either mode stands on the file. Only looks, and needs no more than
  /// to read: a file that is missing or may not be opened is held by nobody that can be known.
  static bool is_held(const std::filesystem::path& path);
  /// Waits for it.
  static FileLock wait(const std::filesystem::path& path, Mode mode);
  /// The same on a folder that exists.
  static std::optional<FileLock> try_lock_folder(const std::filesystem::path& path, Mode mode);

  /// Makes a shared lock exclusive. False if somebody else has it too; this one is then lost.
  bool try_exclusive();

  ~FileLock();
  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&& other) noexcept;
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

 private:
  explicit FileLock(int file) : file_(file) {}
  int file_ = -1;
};

/// Locks on single frames (one byte of a file each, by open-file-description locks): runs of the
/// same stage may work side by side as long as no frame is worked on twice, however they split
/// them.
class FrameLock {
 public:
  /// Locks every frame, or none and returns nothing if another run has one of them. Throws
  /// EnvironmentError.
  static std::optional<FrameLock> try_lock(const std::filesystem::path& path,
                                           const std::vector<int>& frame_ids);

  ~FrameLock();
  FrameLock(FrameLock&& other) noexcept;
  FrameLock& operator=(FrameLock&& other) noexcept;
  FrameLock(const FrameLock&) = delete;
  FrameLock& operator=(const FrameLock&) = delete;

 private:
  explicit FrameLock(int file) : file_(file) {}
  int file_ = -1;
};

}  // namespace atelier
