#include "core/printable.h"

#include <algorithm>

#include "core/utf8.h"

namespace atelier {

std::string printable(const std::string& text, bool lines) {
  std::string shown;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = lines ? std::min(text.find('\n', begin), text.size()) : text.size();
    std::string line = text.substr(begin, end - begin);
    if (!is_printable_utf8(line)) {
      std::replace_if(
          line.begin(), line.end(), [](char c) { return c < 0x20 || c >= 0x7f; }, '?');
    }
    shown += (begin > 0 ? "\n" : "") + line;
    begin = end + 1;
  }
  return shown;
}

std::string counted(std::int64_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

}  // namespace atelier
