#include "core/quantity_text.h"

#include <gtest/gtest.h>

namespace atelier {
namespace {

TEST(ShortNumber, NumbersOfAnySize_KeepTheirDigits) {
  EXPECT_EQ(short_number(0), "0");
  EXPECT_EQ(short_number(33.33333), "33.33");
  EXPECT_EQ(short_number(8.3e-10), "8.3e-10");
  EXPECT_EQ(short_number(0.00042), "0.00042");
  EXPECT_EQ(short_number(12345.6), "12346");
  EXPECT_EQ(short_number(1e9), "1e+09");
  EXPECT_EQ(short_number(0.0213, 3), "0.0213");
  EXPECT_EQ(short_number(-1234567, 3), "-1234567");
}

TEST(Percent, Shares_AreNeitherNothingNorAllUnlessTheyAre) {
  EXPECT_EQ(percent(0), "0%");
  EXPECT_EQ(percent(0.0003), "0.03%");
  EXPECT_EQ(percent(0.123), "12%");
  EXPECT_EQ(percent(0.9996), "over 99%");
  EXPECT_EQ(percent(1), "100%");
  EXPECT_EQ(percent(1.5), "150%");
}

}  // namespace
}  // namespace atelier
