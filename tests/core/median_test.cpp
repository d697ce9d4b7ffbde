#include "core/median.h"

#include <gtest/gtest.h>

namespace atelier {
namespace {

TEST(Median, EvenCount_GivesTheUpperMiddleValue) {
  EXPECT_EQ(median({}), 0);
  EXPECT_EQ(median({3}), 3);
  EXPECT_EQ(median({4, 1, 3}), 3);
  EXPECT_EQ(median({4, 1, 3, 2}), 3);
}

}  // namespace
}  // namespace atelier
