#include "appearance/learning_outcome.h"

#include <limits>

#include <gtest/gtest.h>

namespace atelier {
namespace {

TEST(LearningOutcome, Training_IsJudgedAgainstStaticTexture) {
  EXPECT_EQ(learning_outcome(26, 23), LearningOutcome::Sufficient);
  EXPECT_EQ(learning_outcome(22.6, 23), LearningOutcome::Sufficient);
  EXPECT_EQ(learning_outcome(22.4, 23), LearningOutcome::Doubtful);
  EXPECT_EQ(learning_outcome(19.9, 23), LearningOutcome::Diverged);
  EXPECT_EQ(learning_outcome(std::numeric_limits<double>::quiet_NaN(), 23),
            LearningOutcome::Diverged);
}

}  // namespace
}  // namespace atelier
