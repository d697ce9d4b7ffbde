#include "core/io/file_bytes.h"

#include <cerrno>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/error.h"

namespace atelier {
namespace {

/// Closes at the end of the scope; nothing was written, so that close has nothing to report.
class Descriptor {
 public:
  explicit Descriptor(int value) : value_(value) {}
  ~Descriptor() {
    if (value_ >= 0) {
      close(value_);
    }
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int value() const { return value_; }

 private:
  int value_;
};

template <class Buffer>
Buffer read_whole(const std::filesystem::path& path, std::int64_t max_bytes) {
  // Not blocking: opening a pipe that nobody writes would never return.
  const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat status {};
  if (file.value() < 0 || fstat(file.value(), &status) != 0) {
    const int error = errno;
    const std::string reason = std::generic_category().message(error);
    if (error == EIO || error == ENOMEM || error == EMFILE || error == ENFILE) {
      throw EnvironmentError(path.string(), "cannot open: " + reason);
    }
    throw DataError(path.string(), "", reason, "a readable file");
  }
  if (!S_ISREG(status.st_mode)) {
    throw DataError(path.string(), "", S_ISDIR(status.st_mode) ? "a folder" : "not a regular file",
                    "a file");
  }
  if (status.st_size > max_bytes) {
    throw DataError(path.string(), "", std::to_string(status.st_size) + " bytes",
                    "at most " + std::to_string(max_bytes) + " bytes");
  }
  Buffer buffer;
  buffer.resize(static_cast<std::size_t>(status.st_size));
  std::size_t filled = 0;
  while (filled < buffer.size()) {
    const ssize_t count = read(file.value(), buffer.data() + filled, buffer.size() - filled);
    if (count < 0) {
      if (errno == EINTR) {
        continue;
      }
      throw EnvironmentError(path.string(),
                             "cannot read: " + std::generic_category().message(errno));
    }
    if (count == 0) {
      break;  // became shorter meanwhile
    }
    filled += static_cast<std::size_t>(count);
  }
  buffer.resize(filled);
  return buffer;
}

}  // namespace

std::vector<std::byte> read_file_bytes(const std::filesystem::path& path, std::int64_t max_bytes) {
  return read_whole<std::vector<std::byte>>(path, max_bytes);
}

std::string read_file_text(const std::filesystem::path& path, std::int64_t max_bytes) {
  return read_whole<std::string>(path, max_bytes);
}

}  // namespace atelier
