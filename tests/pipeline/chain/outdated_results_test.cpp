#include "pipeline/chain/outdated_results.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

using ::testing::HasSubstr;

std::vector<StageStatus> statuses_without_results() {
  std::vector<StageStatus> all;
  for (const Stage& stage : all_stages()) {
    StageStatus status;
    status.stage = std::string(stage.name);
    status.row = &stage;
    all.push_back(status);
  }
  return all;
}

StageStatus& status_of(std::vector<StageStatus>& all, const std::string& stage) {
  return *std::find_if(all.begin(), all.end(),
                       [&](const StageStatus& status) { return status.stage == stage; });
}

/// An outdated result that was made of those of other stages.
void make_outdated(StageStatus& status, const std::vector<std::string>& made_of) {
  status.state = StageStatus::State::Outdated;
  status.manifest.emplace();
  for (const std::string& stage : made_of) {
    ManifestInput input;
    input.stage = stage;
    status.manifest->inputs.push_back(input);
  }
}

// After `run --replace` the results behind are not there: a run of the stage alone could not begin.
TEST(MendingCommand, ResultsBehindThatAreNotThere_AreMadeFirst) {
  std::vector<StageStatus> all = statuses_without_results();
  StageStatus& simulate = status_of(all, "simulate");
  make_outdated(simulate, {"body", "register"});
  EXPECT_THAT(mending_command(all, simulate, "work", "capture"),
              HasSubstr("atelier run capture work --from reconstruct --to simulate"));
}

TEST(MendingCommand, ResultsBehindThatAreThere_AreLeft) {
  std::vector<StageStatus> all = statuses_without_results();
  StageStatus& simulate = status_of(all, "simulate");
  make_outdated(simulate, {"body", "register"});
  for (const char* stage : {"body", "register"}) {
    status_of(all, stage).state = StageStatus::State::Done;
    status_of(all, stage).manifest.emplace();
  }
  EXPECT_THAT(mending_command(all, simulate, "work", "capture"),
              HasSubstr("atelier run capture work --from simulate --to simulate"));
}

}  // namespace
}  // namespace atelier
