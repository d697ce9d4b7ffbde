#include "core/plain_name.h"

#include <algorithm>
#include <cstdio>

namespace atelier {

bool is_plain_name(const std::string& name) {
  return !name.empty() && name.size() <= 100 && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                  c == '.' || c == '_' || c == '-';
         });
}

std::string frame_name(int frame_id) {
  char name[16];
  std::snprintf(name, sizeof(name), "%06d", frame_id);
  return name;
}

}  // namespace atelier
