// A stage that is added as CONTRIBUTING.md says, by a room (tests/pipeline/toy) and one line: the
// program runs it, and everything that loops over rows has it.
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/exit_code.h"
#include "core/io/file_bytes.h"
#include "core/store/workspace_status.h"
#include "pipeline/chain/run_chain.h"
#include "pipeline/chain/run_options.h"
#include "pipeline/evaluation/evaluation.h"
#include "pipeline/report/report_pictures.h"
#include "pipeline/stages/option_rules.h"
#include "pipeline/stages/stages.h"
#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using fixtures::ChildResult;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class AddedStage : public ::testing::Test {
 protected:
  void SetUp() override { std::ofstream(input()) << "1 2 30\n"; }

  std::filesystem::path input() const { return root_ / "numbers.txt"; }
  std::filesystem::path workspace() const { return root_ / "work"; }
  ChildResult run_toy(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> command = {fixtures::small_program_path(), "toy", input().string(),
                                        workspace().string()};
    command.insert(command.end(), more.begin(), more.end());
    return fixtures::run_child(command);
  }
  std::string sum() const {
    return read_file_text(workspace() / "toy" / "current" / "sum.txt", 1 << 10);
  }

  fixtures::TemporaryDirectory root_;
};

TEST_F(AddedStage, Help_ListsIt) {
  const ChildResult help = fixtures::run_child({fixtures::small_program_path(), "--help"});
  EXPECT_THAT(help.out, AllOf(HasSubstr("toy"), HasSubstr("numbers of a file")));
  const ChildResult own = fixtures::run_child({fixtures::small_program_path(), "toy", "--help"});
  EXPECT_THAT(own.out, AllOf(HasSubstr("--low"), HasSubstr("Largest number that is kept")));
}

TEST_F(AddedStage, FramesOfAPartialRun_AreKept) {
  ASSERT_EQ(run_toy({"--frames", "0:2"}).exit_code, kExitDone);
  EXPECT_FALSE(std::filesystem::exists(workspace() / "toy" / "current"));
  EXPECT_THAT(run_toy({"--dry-run"}).out, HasSubstr("go on"));
  const ChildResult rest = run_toy();
  ASSERT_EQ(rest.exit_code, kExitDone) << rest.err;
  EXPECT_EQ(sum(), "13.000000\n");
  EXPECT_THAT(run_toy({"--dry-run"}).out, HasSubstr("would do nothing"));
}

TEST_F(AddedStage, BrokenRule_IsRefused) {
  const ChildResult refused = run_toy({"--low", "5", "--high", "3"});
  EXPECT_EQ(refused.exit_code, kExitUsage);
  EXPECT_THAT(refused.err, HasSubstr("--low cannot be 5 with --high 3: it takes less than that"));
  EXPECT_FALSE(std::filesystem::exists(workspace()));
}

TEST_F(AddedStage, Chain_HasItsPlaceCostAndOptions) {
  ASSERT_EQ(run_steps().size(), 1U);
  const StageRow& step = *run_steps().front();
  EXPECT_EQ(step.stage.name, "toy");
  CaptureFacts facts;
  facts.frames = 3;
  EXPECT_EQ(nothing_for(step, facts), "");
  EXPECT_THAT(needed_stages(step, facts), IsEmpty());
  EXPECT_EQ(expected_seconds(step, facts), 7);

  OptionSet options = run_options();
  EXPECT_EQ(set_option(options.table, "toy.low", "20"), "");
  EXPECT_THAT(broken_rules(options.table),
              ElementsAre(HasSubstr("toy.low cannot be 20 with toy.high 10")));
}

TEST_F(AddedStage, Result_IsMeasuredAndJudged) {
  std::ofstream(root_ / "sum.txt") << "12.25\n";
  EXPECT_THAT(evaluated_stages(), ElementsAre("capture", "toy"));
  ASSERT_EQ(all_targets().size(), 1U);
  EXPECT_EQ(all_targets().front().stage, "toy");

  std::filesystem::create_directories(workspace());
  const WorkspaceFigures before = workspace_figures(workspace(), root_.path(), "toy");
  ASSERT_EQ(before.unmeasured.size(), 1U);
  EXPECT_THAT(before.unmeasured[0].why, HasSubstr("run 'atelier toy' first"));

  ASSERT_EQ(run_toy().exit_code, kExitDone);
  const WorkspaceFigures figures = workspace_figures(workspace(), root_.path(), "toy");
  ASSERT_EQ(figures.measures.size(), 1U);
  EXPECT_EQ(figures.measures[0].value, 0.75);
  const std::vector<Judged> accuracy = judged(figures, Targets::Accuracy, workspace());
  ASSERT_EQ(accuracy.size(), 1U);
  EXPECT_EQ(accuracy[0].stage, "toy");
  EXPECT_EQ(accuracy[0].verdict, "missed");
  EXPECT_EQ(judged(figures, Targets::Demo, workspace())[0].verdict, "met");
}

TEST_F(AddedStage, Report_ShowsItsPictures) {
  ASSERT_EQ(run_toy().exit_code, kExitDone);
  const std::vector<StageStatus> status = workspace_status(all_stages(), workspace());
  EXPECT_THAT(
      stage_pictures(status, workspace()),
      ElementsAre(std::pair<const std::string, std::string>("toy", "<p>13.000000\n</p>\n")));
}

}  // namespace
}  // namespace atelier
