#include "appearance/picture_similarity.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"

namespace atelier {
namespace {

constexpr int kReach = 5;
constexpr int kSide = 2 * kReach + 1;

std::array<double, kSide> gaussian() {
  constexpr double kDeviation = 1.5;
  std::array<double, kSide> weights{};
  for (int i = 0; i < kSide; ++i) {
    const double off = (i - kReach) / kDeviation;
    weights.at(static_cast<std::size_t>(i)) = std::exp(-off * off / 2);
  }
  return weights;
}

/// Of one pixel, the sum over its channels.
double similarity_at(const Image& a, const Image& b, const ByteImage& mask, int x, int y) {
  static const std::array<double, kSide> falling = gaussian();  // from -kReach to kReach
  constexpr double kC1 = 0.01 * 0.01;
  constexpr double kC2 = 0.03 * 0.03;
  double total = 0;
  for (int c = 0; c < a.channels; ++c) {
    double weight = 0;
    double sum_a = 0;
    double sum_b = 0;
    double sum_aa = 0;
    double sum_bb = 0;
    double sum_ab = 0;
    for (int j = std::max(0, y - kReach); j <= std::min(a.height - 1, y + kReach); ++j) {
      for (int i = std::max(0, x - kReach); i <= std::min(a.width - 1, x + kReach); ++i) {
        if (mask.at(i, j) == 0) {
          continue;
        }
        const int column = i - x + kReach;
        const int row = j - y + kReach;
        const double w =
            falling[static_cast<std::size_t>(column)] * falling[static_cast<std::size_t>(row)];
        const double va = a.at(i, j, c);
        const double vb = b.at(i, j, c);
        weight += w;
        sum_a += w * va;
        sum_b += w * vb;
        sum_aa += w * va * va;
        sum_bb += w * vb * vb;
        sum_ab += w * va * vb;
      }
    }
    const double mean_a = sum_a / weight;
    const double mean_b = sum_b / weight;
    const double var_a = std::max(0.0, sum_aa / weight - mean_a * mean_a);
    const double var_b = std::max(0.0, sum_bb / weight - mean_b * mean_b);
    const double covariance = sum_ab / weight - mean_a * mean_b;
    total += (2 * mean_a * mean_b + kC1) * (2 * covariance + kC2) /
             ((mean_a * mean_a + mean_b * mean_b + kC1) * (var_a + var_b + kC2));
  }
  return total;
}

}  // namespace

double structural_similarity(const Image& a, const Image& b, const ByteImage& mask) {
  ATELIER_CHECK(a.width == b.width && a.height == b.height && a.channels == b.channels &&
                    a.width == mask.width && a.height == mask.height && mask.channels == 1,
                "images and mask differ in size");
  struct Sum {
    double value = 0;
    double count = 0;
    Sum operator+(const Sum& other) const { return {value + other.value, count + other.count}; }
  };
  constexpr Index kRows = 16;
  const Sum sum = parallel_sum(Index{a.height}, kRows, Sum{}, [&](Index begin, Index end) {
    Sum part;
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      for (int x = 0; x < a.width; ++x) {
        if (mask.at(x, y) != 0) {
          part.value += similarity_at(a, b, mask, x, y);
          part.count += a.channels;
        }
      }
    }
    return part;
  });
  return sum.count > 0 ? sum.value / sum.count : 1;
}

}  // namespace atelier
