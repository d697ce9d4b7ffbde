#include "core/io/file_bytes.h"

#include <algorithm>
#include <span>

#include "core/regular_file.h"

namespace atelier {
namespace {

/// The first `bytes` of a file, fewer if it has become shorter.
template <class Buffer>
Buffer read_first(const RegularFile& file, std::int64_t bytes, const std::filesystem::path& path) {
  Buffer buffer;
  buffer.resize(static_cast<std::size_t>(bytes));
  buffer.resize(file.read_on(std::as_writable_bytes(std::span(buffer)), path));
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
