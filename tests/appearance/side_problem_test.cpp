#include "appearance/side_problem.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace atelier {
namespace {

TEST(SideProblem, PowersOfTwo_AreAccepted) {
  for (const int side : {16, 32, 1024, 2048}) {
    EXPECT_EQ(resolution_problem("resolution", side), "");
  }
  for (const int side : {1, 2, 16}) {
    EXPECT_EQ(shading_problem("shading", side), "");
  }
}

TEST(SideProblem, OtherSides_NameTheNearestValidOnes) {
  EXPECT_EQ(resolution_problem("resolution", 17),
            "resolution cannot be 17: it takes powers of 2 from 16 to 2048, as 16 or 32");
  EXPECT_THAT(resolution_problem("--resolution", 1000), ::testing::HasSubstr("as 512 or 1024"));
  EXPECT_THAT(resolution_problem("resolution", 8), ::testing::EndsWith("as 16"));
  EXPECT_THAT(resolution_problem("resolution", -3), ::testing::EndsWith("as 16"));
  EXPECT_THAT(resolution_problem("resolution", 5000), ::testing::EndsWith("as 2048"));
  EXPECT_THAT(shading_problem("shading", 3), ::testing::EndsWith("from 1 to 16, as 2 or 4"));
}

}  // namespace
}  // namespace atelier
