#include "bodymodel/formats/portable_names.h"

#include <cctype>
#include <set>

namespace atelier {

std::vector<std::string> portable_names(const std::vector<std::string>& names) {
  std::set<std::string> taken;
  std::vector<std::string> result;
  for (const std::string& name : names) {
    std::string plain;
    for (const char c : name) {
      const auto u = static_cast<unsigned char>(c);
      plain += u < 128 && (std::isalnum(u) != 0 || c == '_' || c == '-' || c == '.') ? c : '_';
    }
    plain = plain.empty() ? "joint" : plain;
    std::string unique = plain;
    for (int number = 2; !taken.insert(unique).second; ++number) {
      unique = plain + "_" + std::to_string(number);
    }
    result.push_back(unique);
  }
  return result;
}

}  // namespace atelier
