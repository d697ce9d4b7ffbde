#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/random.h"
#include "simulation/xpbd/box_groups.h"

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

TEST(NearGroups, Groups_HoldEveryElementOnce) {
  for (int count : {0, 1, 31, 32, 33, 1024, 1025, 3333}) {
    std::vector<int> order = near_group_order(sheet(count, 1));
    std::sort(order.begin(), order.end());
    std::vector<int> all(static_cast<std::size_t>(count));
    std::iota(all.begin(), all.end(), 0);
    EXPECT_EQ(order, all) << count;
  }
}

TEST(NearGroups, Groups_AreCompact) {
  const std::vector<Centre> centres = sheet(150, 130);
  const std::vector<int> order = near_group_order(centres);
  // A square of 8 has a diagonal of 4, one of 32 of 8, one of 1024 of 45; the splits make halves,
  // not squares.
  for (std::size_t begin = 0; begin < order.size(); begin += kEight) {
    EXPECT_LT(spread(centres, order, begin, kEight), 2 * 4.0) << begin;
  }
  for (std::size_t begin = 0; begin < order.size(); begin += kGroup) {
    EXPECT_LT(spread(centres, order, begin, kGroup), 2 * 8.0) << begin;
  }
  for (std::size_t begin = 0; begin < order.size(); begin += kGroup * kGroup) {
    EXPECT_LT(spread(centres, order, begin, kGroup * kGroup), 2 * 45.0) << begin;
  }
}

TEST(NearGroups, CoincidentElements_AreStillSplit) {
  const std::vector<Centre> centres(2000, Centre{1, 2, 3});
  const std::vector<int> order = near_group_order(centres);
  EXPECT_EQ(order.size(), 2000u);
  EXPECT_EQ(order, near_group_order(centres));
}

// What may meet is found through groups as by comparing all boxes, also where some have moved
// since.
TEST(GroupedBoxes, GroupedBoxes_FindAllOverlaps) {
  for (int count : {0, 1, 40, 1500}) {
    Random random{7};
    const auto point = [&] { return Centre{uniform(random), uniform(random), uniform(random)}; };
    std::vector<Centre> centres(static_cast<std::size_t>(count));
    std::generate(centres.begin(), centres.end(), point);
    std::vector<Box<double>> boxes;
    for (const Centre& c : centres) {
      const double r = 0.03 * uniform(random);
      boxes.push_back({{c[0] - r, c[1] - r, c[2] - r}, {c[0] + r, c[1] + r, c[2] + r}});
    }
    GroupedBoxes groups(centres);
    const auto box = [&](int i) { return boxes[i]; };
    groups.fill(box);
    for (const bool moved : {false, true}) {
      if (moved) {
        for (int i = 0; i < count; i += 3) {
          boxes[i] = inflated(boxes[i], 0.05);
        }
        groups.fill_where([](int i) { return i % 3 == 0; }, box);
      }
      std::set<std::pair<int, int>> all;
      for (int i = 0; i < count; ++i) {
        for (int j = i + 1; j < count; ++j) {
          if (overlap(boxes[i], boxes[j])) {
            all.emplace(i, j);
          }
        }
      }
      std::set<std::pair<int, int>> found;
      int times = 0;
      for (int k = 0; k < groups.groups(); ++k) {
        groups.visit_near<true>(k, groups, [&](int i, int j) {
          found.emplace(std::min(i, j), std::max(i, j));
          ++times;
        });
      }
      EXPECT_EQ(found, all) << count;
      EXPECT_EQ(times, static_cast<int>(all.size())) << count << ": each pair once";
      found.clear();
      for (int i = 0; i < count; ++i) {
        groups.visit_near(boxes[i], [&](int j) {
          if (i != j) {
            found.emplace(std::min(i, j), std::max(i, j));
          }
        });
      }
      EXPECT_EQ(found, all) << count;
    }
  }
}

}  // namespace
}  // namespace atelier
