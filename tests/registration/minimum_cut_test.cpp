#include "registration/minimum_cut.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/random.h"

namespace atelier {
namespace {

double cost_of(const std::vector<char>& first, const std::vector<double>& cost_first,
               const std::vector<double>& cost_second, const std::vector<CutLink>& links) {
  double cost = 0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    cost += first[i] != 0 ? cost_first[i] : cost_second[i];
  }
  for (const CutLink& link : links) {
    cost += first[link.a] != first[link.b] ? link.cost : 0;
  }
  return cost;
}

TEST(MinimumCut, RandomGraphs_GetTheMinCostCut) {
  constexpr std::size_t kNodes = 9;
  Random random{11};
  for (int trial = 0; trial < 30; ++trial) {
    std::vector<double> cost_first(kNodes);
    std::vector<double> cost_second(kNodes);
    std::vector<CutLink> links;
    for (std::size_t i = 0; i < kNodes; ++i) {
      cost_first[i] = uniform(random);
      cost_second[i] = uniform(random);
      for (std::size_t j = 0; j < i; ++j) {
        if (uniform(random) < 0.4) {
          links.push_back({i, j, 0.5 * uniform(random)});
        }
      }
    }
    double least = 1e300;
    for (unsigned sides = 0; sides < 1U << kNodes; ++sides) {
      std::vector<char> first(kNodes);
      for (std::size_t i = 0; i < kNodes; ++i) {
        first[i] = static_cast<char>(sides >> i & 1U);
      }
      least = std::min(least, cost_of(first, cost_first, cost_second, links));
    }
    EXPECT_NEAR(
        cost_of(minimum_cut(cost_first, cost_second, links), cost_first, cost_second, links), least,
        1e-12);
  }
}

TEST(MinimumCut, EmptyGraphAndTies_AreResolved) {
  EXPECT_TRUE(minimum_cut({}, {}, {}).empty());
  EXPECT_EQ(minimum_cut({1, 2, 0}, {1, 3, 0}, {}), (std::vector<char>{0, 1, 0}));
}

TEST(MinimumCutRefused, MismatchedOrNegativeCosts_AreRefused) {
  EXPECT_THROW(minimum_cut({1}, {}, {}), LogicError);
  EXPECT_THROW(minimum_cut({1, 1}, {1, -1}, {}), LogicError);
  EXPECT_THROW(minimum_cut({1, 1}, {1, 1}, {{0, 2, 1}}), LogicError);
  EXPECT_THROW(minimum_cut({1, 1}, {1, 1}, {{1, 1, 1}}), LogicError);
}

}  // namespace
}  // namespace atelier
