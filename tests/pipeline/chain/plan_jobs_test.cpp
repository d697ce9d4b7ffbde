#include "pipeline/chain/plan_jobs.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/usage_error.h"
#include "pipeline/chain/run_chain.h"
#include "pipeline/chain/take_facts.h"

namespace atelier {
namespace {

PlannedJob job(const std::string& id, double seconds, const std::vector<std::string>& needs) {
  PlannedJob one;
  one.id = id;
  one.seconds = seconds;
  one.needs = needs;
  return one;
}

TEST(LongestWay, JobsBesideEachOther_TakeAsLongAsTheSlowest) {
  EXPECT_EQ(longest_way({}), 0);
  EXPECT_EQ(longest_way({job("a", 3, {}), job("b", 5, {}), job("c", 1, {})}), 5);
}

TEST(LongestWay, JobBehindOthers_BeginsWhenTheLastOfThemEnds) {
  EXPECT_EQ(longest_way({job("a", 3, {}), job("b", 5, {"a"}), job("c", 4, {"a"}),
                         job("d", 1, {"b", "c"}), job("e", 2, {})}),
            9);
}

TEST(StepNames, OfTheChain_AreInItsOrder) {
  const std::vector<std::string> names = step_names();
  ASSERT_EQ(names.size(), run_steps().size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_EQ(names[i], run_steps()[i]->stage.name);
  }
}

TEST(TakeFacts, CamerasFramesMegapixels_AreReadWithATenthOfFramesMinimal) {
  const CaptureFacts facts = facts_of_take("200x10000x4.5");
  EXPECT_TRUE(facts.calibrated);
  EXPECT_EQ(facts.cameras, 200);
  EXPECT_EQ(facts.frames, 10000);
  EXPECT_EQ(facts.minimal_frames, 1000);
  EXPECT_EQ(facts.clothed_frames, 9000);
  EXPECT_EQ(facts.megapixels, 4.5);
}

TEST(TakeFacts, OtherTexts_AreRefused) {
  for (const char* text : {"", "200", "200x100", "200x100x", "2.5x100x4", "200x0x4", "-1x100x4",
                           "200x100x4x1", "axbxc", "2000000x1x1", "200x100x nan"}) {
    EXPECT_THROW(facts_of_take(text), UsageError) << text;
  }
}

}  // namespace
}  // namespace atelier
