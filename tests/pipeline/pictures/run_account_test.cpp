#include "pipeline/pictures/run_account.h"

#include <gtest/gtest.h>

namespace atelier {
namespace {

TEST(RunAccount, FailedStage_KeepsNoTime) {
  const RunAccount earlier{"", "", 1, {{"track", "failed", "a reason", 1, 7}}};
  RunAccount account{
      "", "", 1, {{"track", "done already", "", 1, 0.1}, {"body", "done", "", 1, 3}}};
  keep_times(earlier, account);
  EXPECT_EQ(account.stages[0].seconds, 0);
  EXPECT_EQ(account.stages[1].seconds, 3);
}

}  // namespace
}  // namespace atelier
