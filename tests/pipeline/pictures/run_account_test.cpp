#include "pipeline/pictures/run_account.h"

#include <gtest/gtest.h>

namespace atelier {
namespace {

TEST(RunAccount, FailedStage_KeepsNoTime) {
  const RunAccount earlier{"", "", 1, 0, {{"track", "failed", "a reason", 1, 7}}};
  RunAccount account{
      "", "", 1, 0, {{"track", "done already", "", 1, 0.1}, {"body", "done", "", 1, 3}}};
  keep_times(earlier, account);
  EXPECT_EQ(account.stages[0].seconds, 0);
  EXPECT_EQ(account.stages[1].seconds, 3);
}

TEST(RunAccount, Text_KeepsTheReportsTimeAndReadsAccountsWithoutOne) {
  const RunAccount account{"c", "2026-01-01T00:00:00Z", 5, 2.5, {{"track", "done", "", 1, 7}}};
  const std::string text = run_account_text(account);
  EXPECT_EQ(parse_run_account(text).report_seconds, 2.5);
  std::string old = text;
  const std::size_t at = old.find(" \"report_seconds\"");
  old.erase(at, old.find('\n', at) - at + 1);
  EXPECT_EQ(parse_run_account(old).report_seconds, 0);
  EXPECT_EQ(parse_run_account(old).stages[0].seconds, 7);
}

}  // namespace
}  // namespace atelier
