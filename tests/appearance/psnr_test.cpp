#include "appearance/psnr.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace atelier {
namespace {

TEST(Psnr, DifferenceOfATenth_Gives20Db) {
  EXPECT_NEAR(psnr_of(0.1 * 0.1), 20, 1e-12);
  EXPECT_NEAR(psnr_of(1), 0, 1e-12);
  // One step of 8 bits everywhere.
  EXPECT_NEAR(psnr_of(1 / (255.0 * 255.0)), 48.1308, 1e-4);
}

TEST(Psnr, IdenticalImages_GiveTheFiniteMaximum) {
  EXPECT_NEAR(psnr_of(0), 90, 1e-12);
  EXPECT_EQ(psnr_of(1e-15), psnr_of(0));
  EXPECT_LT(psnr_of(1 / (255.0 * 255.0) / 10'000), psnr_of(0));
}

TEST(Psnr, NonFiniteError_GivesNonFinitePsnr) {
  EXPECT_TRUE(std::isnan(psnr_of(std::numeric_limits<double>::quiet_NaN())));
  EXPECT_EQ(psnr_of(std::numeric_limits<double>::infinity()),
            -std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace atelier
