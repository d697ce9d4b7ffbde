#include "capture/mask_share.h"

#include <algorithm>

namespace atelier {

double set_share(const ByteImage& mask, bool rim) {
  double set = 0;
  double all = 0;
  const int band = std::max(1, std::min(mask.width, mask.height) / 50);
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      const bool at_rim = x < band || y < band || x >= mask.width - band || y >= mask.height - band;
      if (!rim || at_rim) {
        set += mask.at(x, y) != 0 ? 1 : 0;
        all += 1;
      }
    }
  }
  return all > 0 ? set / all : 0;
}

}  // namespace atelier
