#include "core/regular_file.h"

#include <array>
#include <cerrno>
#include <string>
#include <string_view>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/error.h"
#include "core/system_reason.h"

namespace atelier {

RegularFile::RegularFile(const std::filesystem::path& path, int flags)
    // Not blocking: opening a pipe that nobody writes would never return.
    : descriptor_(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | flags)) {
  struct stat status {};
  if (descriptor_ < 0 || fstat(descriptor_, &status) != 0) {
    const int error = errno;
    const std::string reason = std::generic_category().message(error);
    if (error == ELOOP) {
      throw DataError(
          path.string(), "",
          (flags & O_NOFOLLOW) != 0 ? "a symbolic link" : "not a regular file: " + reason,
          "a file");
    }
    // A file that this run may not read, or cannot now, may be sound.
    if (error == EACCES || error == EPERM || error == EIO || error == ENOMEM || error == EMFILE ||
        error == ENFILE) {
      throw EnvironmentError(path.string(), "cannot open: " + system_reason(error));
    }
    throw DataError(path.string(), "", reason, "a readable file");
  }
  if (!S_ISREG(status.st_mode)) {
    close(descriptor_);
    throw DataError(path.string(), "", S_ISDIR(status.st_mode) ? "a folder" : "not a regular file",
                    "a file");
  }
  size_ = status.st_size;
}

RegularFile::~RegularFile() {
  close(descriptor_);
}

std::size_t RegularFile::read_on(std::span<std::byte> buffer,
                                 const std::filesystem::path& path) const {
  std::size_t filled = 0;
  while (filled < buffer.size()) {
    const ssize_t count = read(descriptor_, buffer.data() + filled, buffer.size() - filled);
    if (count < 0 && errno == EINTR) {
      continue;
    }
    if (count < 0) {
      throw EnvironmentError(path.string(), "cannot read: " + system_reason(errno));
    }
    if (count == 0) {
      break;
    }
    filled += static_cast<std::size_t>(count);
  }
  return filled;
}

void RegularFile::check_size(std::int64_t max_bytes, const std::filesystem::path& path) const {
  if (size_ > max_bytes) {
    throw DataError(path.string(), "", std::to_string(size_) + " bytes",
                    "at most " + std::to_string(max_bytes) + " bytes");
  }
  constexpr std::string_view kPointer = "version https://git-lfs.github.com/spec/";
  constexpr std::int64_t kLargestPointer = 1024;
  std::array<char, kPointer.size()> start{};
  if (size_ >= std::ssize(kPointer) && size_ < kLargestPointer &&
      pread(descriptor_, start.data(), start.size(), 0) == std::ssize(kPointer) &&
      std::string_view(start.data(), start.size()) == kPointer) {
    throw DataError(path.string(), "", "a pointer of Git LFS, not the file itself",
                    "the file: git lfs pull in its repository fetches it");
  }
}

bool begins_with(const std::filesystem::path& path, std::string_view start) {
  try {
    const RegularFile file(path);
    std::string bytes(start.size(), '\0');
    const ssize_t got = pread(file.descriptor(), bytes.data(), bytes.size(), 0);
    if (got < 0) {
      throw EnvironmentError(path.string(), "cannot read: " + system_reason(errno));
    }
    return got == std::ssize(start) && bytes == start;
  } catch (const DataError&) {
    return false;
  }
}

}  // namespace atelier
