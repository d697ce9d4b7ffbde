#include "core/store/named_files.h"

#include <algorithm>

#include "core/file_kind.h"

namespace atelier {

std::vector<std::filesystem::path> files_named_in(const std::string& text) {
  std::vector<std::filesystem::path> files;
  const auto take = [&](const std::string& name) {
    const bool there = !name.empty() && file_kind(name) != std::filesystem::file_type::not_found;
    if (there) {
      files.emplace_back(name);
    }
    return there;
  };
  if (take(text)) {
    return files;
  }
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find_first_of(",+", begin), text.size());
    begin = std::min(text.find_first_not_of(' ', begin), end);
    const std::string part = text.substr(begin, end - begin);
    begin = end + 1;
    const std::size_t label = part.find_first_of("=:");
    if (!take(part) && label != std::string::npos) {
      take(part.substr(label + 1));
    }
  }
  return files;
}

}  // namespace atelier
