#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>
#include <vector>

namespace atelier::fixtures {

/// When the tests began: what was written before is nobody's whom they name.
inline const std::filesystem::file_time_type kBegun = std::filesystem::file_time_type::clock::now();

/// Files below a folder that hold this text, of those written since the tests began.
inline std::vector<std::string> places_with(const std::string& text,
                                            const std::filesystem::path& below) {
  constexpr std::chrono::seconds kSlack(2);
  std::vector<std::string> found;
  std::error_code ignored;
  for (auto entry = std::filesystem::recursive_directory_iterator(
           below, std::filesystem::directory_options::skip_permission_denied, ignored);
       !ignored && entry != std::filesystem::recursive_directory_iterator();
       entry.increment(ignored)) {
    std::error_code gone;
    const std::uintmax_t size = entry->is_regular_file(gone) ? entry->file_size(gone) : 0;
    if (!gone && size < (1U << 20) && entry->last_write_time(gone) + kSlack >= kBegun) {
      std::string bytes(size, '\0');
      std::ifstream file(entry->path(), std::ios::binary);
      file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
      if (bytes.find(text) != std::string::npos) {
        found.push_back(entry->path().string());
      }
    }
  }
  return found;
}

}  // namespace atelier::fixtures
