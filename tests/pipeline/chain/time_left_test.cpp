#include "pipeline/chain/time_left.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "capture/layouts/capture_facts.h"
#include "pipeline/chain/run_chain.h"

namespace atelier::fixtures {
namespace {

double pace_of(const std::vector<StageTime>& stages) {
  return run_pace(stages);
}

TEST(TimeLeft, NoTimes_AreAsExpected) {
  EXPECT_EQ(pace_of({}), 1);
  EXPECT_EQ(pace_of({{0, 5}, {5, 0}}), 1);
}

TEST(TimeLeft, LongStage_SaysNearlyAll) {
  EXPECT_NEAR(pace_of({{200, 600}}), 3, 0.7);
  EXPECT_NEAR(pace_of({{200, 600}, {50, 150}, {30, 90}}), 3, 0.4);
  EXPECT_NEAR(pace_of({{300, 100}}), 1.0 / 3, 0.1);
}

TEST(TimeLeft, StageOfASecond_SaysLittle) {
  EXPECT_LT(pace_of({{1, 10}}), 2.6);
  EXPECT_NEAR(pace_of({{1, 10}, {300, 300}}), 1, 0.4);
}

TEST(TimeLeft, Pace_IsBounded) {
  EXPECT_EQ(pace_of({{1000, 1e9}, {1000, 1e9}}), 10);
  EXPECT_EQ(pace_of({{1e9, 1}, {1e9, 1}}), 0.1);
}

// Times of a run on a loaded machine, beside what was expected of an idle one.
TEST(TimeLeft, SlowMachine_IsLearntFromTheFirstStages) {
  const std::vector<StageTime> stages = {{0.6, 0.6},   {28.8, 69.7}, {1.6, 3.6}, {2.2, 3.2},
                                         {18.6, 47.5}, {11, 31.2},   {22, 60.6}, {27, 54.1}};
  double left = 0;
  for (const StageTime& one : stages) {
    left += one.expected;
  }
  double taken_left = 0;
  for (const StageTime& one : stages) {
    taken_left += one.taken;
  }
  std::vector<StageTime> ended;
  for (const StageTime& one : stages) {
    ended.push_back(one);
    left -= one.expected;
    taken_left -= one.taken;
    if (ended.size() >= 2 && ended.size() < stages.size()) {
      const double ratio = pace_of(ended) * left / taken_left;
      EXPECT_GT(ratio, 1 / 1.5) << ended.size();
      EXPECT_LT(ratio, 1.5) << ended.size();
    }
  }
}

TEST(TimeLeft, MachinePace_IsWithinItsBounds) {
  const double pace = machine_pace();
  EXPECT_GE(pace, 0.25);
  EXPECT_LE(pace, 8);
}

TEST(ReportTime, ReportOfMoreResults_TakesLonger) {
  CaptureFacts facts;
  facts.cameras = 10;
  facts.frames = facts.masked_frames = facts.pictured_frames = 16;
  facts.clothed_frames = 12;
  facts.megapixels = 0.2;
  std::vector<std::string> stages;
  double before = expected_report_seconds(facts, stages);
  EXPECT_LT(before, 1) << "of nothing";
  for (const StageRow* step : run_steps()) {
    stages.emplace_back(step->stage.name);
    const double now = expected_report_seconds(facts, stages);
    EXPECT_GT(now, before) << stages.back();
    if (stages.back() == "validate") {
      EXPECT_LT(now, 1) << "its page is linked, not drawn again";
    }
    before = now;
  }
  EXPECT_GT(before, 5);
  facts.synthetic = true;
  EXPECT_GT(expected_report_seconds(facts, stages), 2 * before) << "with figures of the truth";
}

}  // namespace
}  // namespace atelier::fixtures
