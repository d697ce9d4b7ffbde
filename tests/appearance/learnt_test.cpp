#include "appearance/learnt.h"

#include <limits>

#include <gtest/gtest.h>

namespace atelier {
namespace {

TEST(Learnt, Training_IsJudgedAgainstStaticTexture) {
  EXPECT_EQ(learnt(26, 23), Learnt::Enough);
  EXPECT_EQ(learnt(22.6, 23), Learnt::Enough);
  EXPECT_EQ(learnt(22.4, 23), Learnt::Doubtful);
  EXPECT_EQ(learnt(19.9, 23), Learnt::Diverged);
  EXPECT_EQ(learnt(std::numeric_limits<double>::quiet_NaN(), 23), Learnt::Diverged);
}

}  // namespace
}  // namespace atelier
