#include "core/listed_frames.h"

#include <algorithm>

namespace atelier {

std::string listed_frames(const std::vector<int>& ids) {
  constexpr std::size_t kShown = 8;
  std::string text;
  for (std::size_t i = 0; i < std::min(kShown, ids.size()); ++i) {
    text += (i > 0 ? ", " : "") + std::to_string(ids[i]);
  }
  return ids.size() > kShown ? text + " and " + std::to_string(ids.size() - kShown) + " others"
                             : text;
}

}  // namespace atelier
