#include "appearance/training_log.h"

#include <gtest/gtest.h>

namespace atelier {
namespace {

/// A log of steps first..last.
std::string log_of(int first, int last) {
  std::string log = training_log_header();
  for (int i = first; i <= last; ++i) {
    log += training_log_row({i, 0.1 / i, 20.0 + i, 1e-3});
  }
  return log;
}

TEST(TrainingLog, ResumedLog_ContinuesAfterTheCheckpoint) {
  EXPECT_EQ(resumed_training_log(log_of(1, 12), 12), log_of(1, 12));
  EXPECT_EQ(resumed_training_log(log_of(1, 12), 8), log_of(1, 8)) << "the rest is done again";
  EXPECT_EQ(resumed_training_log(log_of(1, 12), 0), training_log_header());
  EXPECT_EQ(resumed_training_log("", 8), training_log_header());
  EXPECT_EQ(resumed_training_log(log_of(101, 105), 104), log_of(101, 104))
      << "named when the training was on its way";
}

TEST(TrainingLog, TornRow_IsDropped) {
  const std::string log = log_of(1, 14);
  for (std::size_t cut = 0; cut <= log.size(); ++cut) {
    const std::string kept = resumed_training_log(log.substr(0, cut), 11);
    ASSERT_EQ(log.substr(0, kept.size()), kept) << "cut at " << cut;
    ASSERT_LE(kept.size(), log_of(1, 11).size());
    ASSERT_TRUE(cut < log_of(1, 11).size() || kept == log_of(1, 11)) << "cut at " << cut;
  }
}

TEST(TrainingLog, RowsAfterABrokenOne_AreDropped) {
  const std::string sound = log_of(1, 3);
  const std::string more = training_log_row({4, 0.1, 20, 1e-3});
  for (const char* broken : {"12\n", "4,0.1,20\n", "\n", "4,0.1,20,1e-3,7\n", "x,0.1,20,1e-3\n",
                             "6,0.1,20,1e-3\n", "3,0.1,20,1e-3\n", "-1,0.1,20,1e-3\n"}) {
    EXPECT_EQ(resumed_training_log(sound + broken + more, 9), sound) << broken;
  }
}

TEST(TrainingLog, LastSteps_GiveTheFinalPsnr) {
  EXPECT_EQ(judged_after(300, 18, 2), 285);
  EXPECT_EQ(judged_after(20, 19, 2), 10) << "all views, once";
  EXPECT_DOUBLE_EQ(mean_psnr_after(log_of(1, 12), 9).value(), 31);
  EXPECT_DOUBLE_EQ(mean_psnr_after(log_of(1, 12), -3).value(), 26.5);
  EXPECT_FALSE(mean_psnr_after(log_of(1, 9), 9)) << "rows are lost that a checkpoint has";
  EXPECT_FALSE(mean_psnr_after("", 9));
}

}  // namespace
}  // namespace atelier
