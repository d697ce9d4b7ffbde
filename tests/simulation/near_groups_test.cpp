#include "simulation/near_groups.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

namespace atelier {
namespace {

using Centre = std::array<double, 3>;

std::vector<Centre> sheet(int columns, int rows) {
  std::vector<Centre> out;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      out.push_back({static_cast<double>(c), 0, static_cast<double>(r)});
    }
  }
  return out;
}

/// Diagonal of the box over `count` things from place `begin` on.
double spread(const std::vector<Centre>& centres, const std::vector<int>& order, std::size_t begin,
              std::size_t count) {
  Centre low = centres[order[begin]];
  Centre high = low;
  for (std::size_t i = begin; i < std::min(order.size(), begin + count); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], centres[order[i]][k]);
      high[k] = std::max(high[k], centres[order[i]][k]);
    }
  }
  return std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
}

TEST(NearGroups, HoldEveryThingOnce) {
  for (int count : {0, 1, 31, 32, 33, 1024, 1025, 3333}) {
    std::vector<int> order = near_group_order(sheet(count, 1));
    std::sort(order.begin(), order.end());
    std::vector<int> all(static_cast<std::size_t>(count));
    std::iota(all.begin(), all.end(), 0);
    EXPECT_EQ(order, all) << count;
  }
}

TEST(NearGroups, LieCloseTogether) {
  const std::vector<Centre> centres = sheet(150, 130);
  const std::vector<int> order = near_group_order(centres);
  // A square of 32 has a diagonal of 8, one of 1024 of 45; the splits make halves, not squares.
  for (std::size_t begin = 0; begin < order.size(); begin += kGroup) {
    EXPECT_LT(spread(centres, order, begin, kGroup), 2 * 8.0) << begin;
  }
  for (std::size_t begin = 0; begin < order.size(); begin += kGroup * kGroup) {
    EXPECT_LT(spread(centres, order, begin, kGroup * kGroup), 2 * 45.0) << begin;
  }
}

TEST(NearGroups, AreSplitWhereAllLieInOnePlaceToo) {
  const std::vector<Centre> centres(2000, Centre{1, 2, 3});
  const std::vector<int> order = near_group_order(centres);
  EXPECT_EQ(order.size(), 2000u);
  EXPECT_EQ(order, near_group_order(centres));
}

}  // namespace
}  // namespace atelier
