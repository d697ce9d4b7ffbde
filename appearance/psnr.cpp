#include "appearance/psnr.h"

#include <cmath>

namespace atelier {

double psnr_of(double mean_square) {
  constexpr double kLeast = 1e-9;  // of identical images
  return -10 * std::log10(mean_square < kLeast ? kLeast : mean_square);
}

}  // namespace atelier
