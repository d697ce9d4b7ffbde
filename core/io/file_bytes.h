#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace atelier {

/// Every byte of a regular file of at most `max_bytes`. A file that is missing, larger, or no
/// regular file (folder, pipe, device, a loop of links) is a DataError; a disk that fails and a
/// file that may not be read are EnvironmentErrors.
std::vector<std::byte> read_file_bytes(const std::filesystem::path& path, std::int64_t max_bytes);

/// The same as text.
std::string read_file_text(const std::filesystem::path& path, std::int64_t max_bytes);

/// The first bytes of a file and the size of all of it: to judge a header by it before the rest
/// takes memory.
struct FileStart {
  std::vector<std::byte> bytes;
  std::uint64_t file_bytes = 0;
};

/// At most `start_bytes` of it; refuses what `read_file_bytes` refuses.
FileStart read_file_start(const std::filesystem::path& path, std::int64_t start_bytes,
                          std::int64_t max_bytes);

}  // namespace atelier
