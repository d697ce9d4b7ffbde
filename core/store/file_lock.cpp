#include "core/store/file_lock.h"

#include <algorithm>
#include <cerrno>
#include <string>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/error.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& action, int error) {
  throw EnvironmentError(path.string(), action + ": " + system_reason(error));
}

int open_lock(const std::filesystem::path& path) {
  const int file = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (file < 0) {
    fail(path, "cannot open the lock", errno);
  }
  return file;
}

/// True if locked; false if somebody else's lock stands against it.
bool flock_file(int file, const std::filesystem::path& path, int operation) {
  while (flock(file, operation) != 0) {
    if (errno == EINTR) {
      continue;
    }
    const int error = errno;
    if (error == EWOULDBLOCK) {
      return false;
    }
    close(file);
    fail(path, "cannot lock", error);
  }
  return true;
}

/// False if the name has gone to another file since it was opened: who holds a lock may remove the
/// file (`remove_bare_stage_folder`), and a lock on what nobody can find any more locks nothing.
bool is_still(int file, const std::filesystem::path& path) {
  struct stat opened {};
  struct stat there {};
  return fstat(file, &opened) == 0 && lstat(path.c_str(), &there) == 0 &&
         opened.st_dev == there.st_dev && opened.st_ino == there.st_ino;
}

int operation_of(FileLock::Mode mode) {
  return mode == FileLock::Mode::Shared ? LOCK_SH : LOCK_EX;
}

}  // namespace

std::optional<FileLock> FileLock::try_lock(const std::filesystem::path& path, Mode mode) {
  while (true) {
    const int file = open_lock(path);
    if (!flock_file(file, path, operation_of(mode) | LOCK_NB)) {
      close(file);
      return std::nullopt;
    }
    if (is_still(file, path)) {
      return FileLock(file);
    }
    close(file);
  }
}

bool FileLock::is_held(const std::filesystem::path& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  if (file < 0) {
    return false;
  }
  const bool held = !flock_file(file, path, LOCK_EX | LOCK_NB);
  close(file);
  return held;
}

FileLock FileLock::wait(const std::filesystem::path& path, Mode mode) {
  while (true) {
    const int file = open_lock(path);
    flock_file(file, path, operation_of(mode));
    if (is_still(file, path)) {
      return FileLock(file);
    }
    close(file);
  }
}

std::optional<FileLock> FileLock::try_lock_folder(const std::filesystem::path& path, Mode mode) {
  const int file = open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW);
  if (file < 0) {
    fail(path, "cannot open the folder", errno);
  }
  if (!flock_file(file, path, operation_of(mode) | LOCK_NB)) {
    close(file);
    return std::nullopt;
  }
  return FileLock(file);
}

bool FileLock::try_exclusive() {
  while (flock(file_, LOCK_EX | LOCK_NB) != 0) {
    if (errno != EINTR) {
      return false;
    }
  }
  return true;
}

FileLock::~FileLock() {
  if (file_ >= 0) {
    // First: where close fails the lock may stay, and we would wait for ourselves.
    flock(file_, LOCK_UN);
    close(file_);
  }
}

FileLock::FileLock(FileLock&& other) noexcept : file_(std::exchange(other.file_, -1)) {}

FileLock& FileLock::operator=(FileLock&& other) noexcept {
  std::swap(file_, other.file_);
  return *this;
}

std::optional<FrameLock> FrameLock::try_lock(const std::filesystem::path& path,
                                             const std::vector<int>& frame_ids) {
  std::vector<int> sorted = frame_ids;
  std::sort(sorted.begin(), sorted.end());
  const int file = open_lock(path);
  for (std::size_t begin = 0; begin < sorted.size();) {
    std::size_t end = begin + 1;
    while (end < sorted.size() && sorted[end] <= sorted[end - 1] + 1) {
      ++end;  // neighbours are one range
    }
    struct flock range {};
    range.l_type = F_WRLCK;
    range.l_whence = SEEK_SET;
    range.l_start = sorted[begin];
    range.l_len = off_t{sorted[end - 1]} - sorted[begin] + 1;
    while (fcntl(file, F_OFD_SETLK, &range) != 0) {
      const int error = errno;
      if (error == EINTR) {
        continue;
      }
      close(file);
      if (error == EAGAIN || error == EACCES) {
        return std::nullopt;
      }
      fail(path, "cannot lock frames", error);
    }
    begin = end;
  }
  return FrameLock(file);
}

FrameLock::~FrameLock() {
  if (file_ >= 0) {
    close(file_);
  }
}

FrameLock::FrameLock(FrameLock&& other) noexcept : file_(std::exchange(other.file_, -1)) {}

FrameLock& FrameLock::operator=(FrameLock&& other) noexcept {
  std::swap(file_, other.file_);
  return *this;
}

}  // namespace atelier
