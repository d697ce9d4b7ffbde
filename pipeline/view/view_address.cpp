#include "pipeline/view/view_address.h"

#include <algorithm>

namespace atelier {
namespace {

bool is_same(std::string_view given, std::string_view token) {
  unsigned difference = given.size() == token.size() ? 0U : 1U;
  for (std::size_t i = 0; i < token.size(); ++i) {
    const char other = i < given.size() ? given[i] : '\0';
    difference |= static_cast<unsigned char>(token[i]) ^ static_cast<unsigned char>(other);
  }
  return difference == 0;
}

bool is_plain(std::string_view name) {
  return std::all_of(name.begin(), name.end(), [before = '/'](char c) mutable {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
    const bool good = letter || c == '_' || c == '-' || ((c == '.' || c == '/') && before != '/');
    before = c;
    return good;
  });
}

}  // namespace

std::optional<std::string> page_file_of(std::string_view path, std::string_view token) {
  if (token.empty() || !path.starts_with('/')) {
    return std::nullopt;
  }
  const std::string_view behind = path.substr(1);
  const std::size_t slash = behind.find('/');
  if (slash == std::string_view::npos || !is_same(behind.substr(0, slash), token)) {
    return std::nullopt;
  }
  const std::string_view name = behind.substr(slash + 1);
  if (!is_plain(name)) {
    return std::nullopt;
  }
  return name.empty() ? "index.html" : std::string(name);
}

}  // namespace atelier
