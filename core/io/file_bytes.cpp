#include "core/io/file_bytes.h"

#include <algorithm>
#include <cerrno>

#include <unistd.h>

#include "core/error.h"
#include "core/regular_file.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

/// The first `bytes` of a file, fewer if it has become shorter.
template <class Buffer>
Buffer read_first(const RegularFile& file, std::int64_t bytes, const std::filesystem::path& path) {
  Buffer buffer;
  buffer.resize(static_cast<std::size_t>(bytes));
  std::size_t filled = 0;
  while (filled < buffer.size()) {
    const ssize_t count = read(file.descriptor(), buffer.data() + filled, buffer.size() - filled);
    if (count < 0) {
      if (errno == EINTR) {
        continue;
      }
      throw EnvironmentError(path.string(), "cannot read: " + system_reason(errno));
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
  const RegularFile file(path);
  file.check_size(max_bytes, path);
  return read_first<std::vector<std::byte>>(file, file.size(), path);
}

std::string read_file_text(const std::filesystem::path& path, std::int64_t max_bytes) {
  const RegularFile file(path);
  file.check_size(max_bytes, path);
  return read_first<std::string>(file, file.size(), path);
}

FileStart read_file_start(const std::filesystem::path& path, std::int64_t start_bytes,
                          std::int64_t max_bytes) {
  const RegularFile file(path);
  file.check_size(max_bytes, path);
  return {read_first<std::vector<std::byte>>(file, std::min(start_bytes, file.size()), path),
          static_cast<std::uint64_t>(file.size())};
}

}  // namespace atelier
