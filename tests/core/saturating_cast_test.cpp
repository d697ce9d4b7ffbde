#include "core/saturating_cast.h"

#include <cmath>
#include <cstdint>
#include <limits>

#include <gtest/gtest.h>

namespace atelier {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(SaturatingCast, NumbersThatFit_LoseWhatIsBehindThePoint) {
  EXPECT_EQ(saturating_cast<int>(3.99), 3);
  EXPECT_EQ(saturating_cast<int>(-3.99), -3);
  EXPECT_EQ(saturating_cast<int>(2147483647.0), 2147483647);
  EXPECT_EQ(saturating_cast<int>(-2147483648.0), std::numeric_limits<int>::min());
  EXPECT_EQ(saturating_cast<std::uint8_t>(255.9F), 255);
  EXPECT_EQ(saturating_cast<std::size_t>(9007199254740992.0), 9007199254740992U);
}

TEST(SaturatingCast, NumbersThatDoNotFit_AreTheNearestThatDoes) {
  EXPECT_EQ(saturating_cast<int>(2147483648.0), std::numeric_limits<int>::max());
  EXPECT_EQ(saturating_cast<int>(1e300), std::numeric_limits<int>::max());
  EXPECT_EQ(saturating_cast<int>(-1e300), std::numeric_limits<int>::min());
  EXPECT_EQ(saturating_cast<int>(kInfinity), std::numeric_limits<int>::max());
  EXPECT_EQ(saturating_cast<int>(-kInfinity), std::numeric_limits<int>::min());
  EXPECT_EQ(saturating_cast<int>(3e38F), std::numeric_limits<int>::max());
  EXPECT_EQ(saturating_cast<std::int64_t>(9223372036854775808.0),
            std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(saturating_cast<std::uint64_t>(18446744073709551616.0),
            std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(saturating_cast<std::uint8_t>(256.0), 255);
  EXPECT_EQ(saturating_cast<std::uint8_t>(-1.0), 0);
  EXPECT_EQ(saturating_cast<std::size_t>(-0.5), 0U);
}

TEST(SaturatingCast, NaN_IsZero) {
  EXPECT_EQ(saturating_cast<int>(std::nan("")), 0);
  EXPECT_EQ(saturating_cast<int>(std::nanf("")), 0);
  EXPECT_EQ(saturating_cast<std::uint64_t>(std::nan("")), 0U);
}

}  // namespace
}  // namespace atelier
