#include "simulation/xpbd/near_groups.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <tuple>

namespace atelier {
namespace {

int longest_side(const std::vector<std::array<double, 3>>& centres, const int* begin,
                 const int* end) {
  std::array<double, 3> low = centres[*begin];
  std::array<double, 3> high = low;
  for (const int* i = begin; i != end; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], centres[*i][k]);
      high[k] = std::max(high[k], centres[*i][k]);
    }
  }
  int longest = 0;
  for (int k = 1; k < 3; ++k) {
    longest = high[k] - low[k] > high[longest] - low[longest] ? k : longest;
  }
  return longest;
}

void split(const std::vector<std::array<double, 3>>& centres, int* begin, int* end) {
  const std::ptrdiff_t count = end - begin;
  if (count <= kEight) {
    std::sort(begin, end);
    return;
  }
  const std::ptrdiff_t unit = count > kGroup * kGroup ? kGroup * kGroup
                              : count > kGroup        ? kGroup
                                                      : kEight;
  int* const middle = begin + (count / 2 + unit - 1) / unit * unit;
  const int side = longest_side(centres, begin, end);
  std::nth_element(begin, middle, end, [&](int a, int b) {
    return std::tie(centres[a][side], a) < std::tie(centres[b][side], b);
  });
  split(centres, begin, middle);
  split(centres, middle, end);
}

}  // namespace

std::vector<int> near_group_order(const std::vector<std::array<double, 3>>& centres) {
  std::vector<int> order(centres.size());
  std::iota(order.begin(), order.end(), 0);
  if (!order.empty()) {
    split(centres, order.data(), order.data() + order.size());
  }
  return order;
}

}  // namespace atelier
