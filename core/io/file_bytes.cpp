#include "core/io/file_bytes.h"

#include <cerrno>
#include <system_error>

#include <unistd.h>

#include "core/error.h"
#include "core/regular_file.h"

namespace atelier {
namespace {

template <class Buffer>
Buffer read_whole(const std::filesystem::path& path, std::int64_t max_bytes) {
  const RegularFile file(path);
  if (file.size() > max_bytes) {
    throw DataError(path.string(), "", std::to_string(file.size()) + " bytes",
                    "at most " + std::to_string(max_bytes) + " bytes");
  }
  Buffer buffer;
  buffer.resize(static_cast<std::size_t>(file.size()));
  std::size_t filled = 0;
  while (filled < buffer.size()) {
    const ssize_t count = read(file.descriptor(), buffer.data() + filled, buffer.size() - filled);
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
