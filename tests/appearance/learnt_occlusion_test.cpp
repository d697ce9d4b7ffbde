#include "appearance/learnt_occlusion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/support/refusals.h"

namespace atelier {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using LightTexts = std::map<std::string, std::string>;

bool same_light(const OcclusionOptions& one, const OcclusionOptions& other) {
  return one.strata == other.strata && one.reach == other.reach && one.offset == other.offset;
}

TEST(LearntOcclusion, OptionsInTexts_RoundTripBitExact) {
  const OcclusionOptions odd = {5, 1.0 / 3, 0.1 + 0.2 - 0.3};
  LightTexts texts = {{"name", "dress"}};
  put_occlusion(texts, odd);
  EXPECT_EQ(texts.size(), 4U);
  const auto back = occlusion_at(texts);
  ASSERT_TRUE(back.has_value());
  EXPECT_TRUE(same_light(*back, odd));
}

TEST(LearntOcclusion, FileOfOlderVersion_HasNoOcclusionOptions) {
  LightTexts texts = {{"name", "dress"}};
  put_occlusion(texts, std::nullopt);
  EXPECT_EQ(texts.size(), 1U);
  EXPECT_FALSE(occlusion_at(texts).has_value());
}

TEST(LearntOcclusion, RenderingOcclusion_IsTheOneOfTraining) {
  const OcclusionOptions learnt = {3, 0.5, 0.01};
  const OcclusionOptions usual;
  EXPECT_TRUE(same_light(drawn_occlusion(kOpenOcclusion, {{"dress", learnt}}), learnt));
  EXPECT_TRUE(
      same_light(drawn_occlusion(kOpenOcclusion, {{"old", {}}, {"dress", learnt}}), learnt));
  EXPECT_TRUE(same_light(drawn_occlusion(learnt, {{"dress", learnt}, {"body", learnt}}), learnt));
  // Where nobody says how, as asked, and the rest as it comes.
  EXPECT_TRUE(same_light(drawn_occlusion(kOpenOcclusion, {}), usual));
  EXPECT_TRUE(
      same_light(drawn_occlusion({4, 0, -1}, {{"old", {}}}), {4, usual.reach, usual.offset}));
}

TEST(LearntOcclusionRefused, OcclusionOtherThanInTraining_IsRefused) {
  const LearntOcclusion dress = {"dress", OcclusionOptions{8, 1, 0}};
  EXPECT_THAT(occlusion_problem({4, 0, -1}, dress),
              HasSubstr("occlusion.strata cannot be 4: dress learnt with 8"));
  EXPECT_THAT(occlusion_problem({0, 2, -1}, dress), HasSubstr("occlusion.reach cannot be 2"));
  EXPECT_THAT(occlusion_problem({0, 0, 0.001}, dress), HasSubstr("occlusion.offset cannot be"));
  EXPECT_THAT(occlusion_problem({8, 1, 0}, dress), IsEmpty());
  EXPECT_THAT(occlusion_problem({4, 0, -1}, {"old", {}}), IsEmpty());
  ATELIER_EXPECT_REFUSED(drawn_occlusion({4, 0, -1}, {dress}), DataError, "dress learnt with 8");
  const LearntOcclusion body = {"body", OcclusionOptions{3, 1, 0}};
  ATELIER_EXPECT_REFUSED(drawn_occlusion(kOpenOcclusion, {dress, body}), DataError,
                         "occlusion.strata cannot be 8: body learnt with 3");
}

TEST(LearntOcclusionRefused, IncompleteOrOutOfRangeTexts_AreRefused) {
  LightTexts whole;
  put_occlusion(whole, OcclusionOptions{});
  for (const auto& [name, text] : whole) {
    LightTexts some = whole;
    some.erase(name);
    ATELIER_EXPECT_REFUSED(occlusion_at(some, "x"), DataError, name + ": nothing");
    for (const char* wrong : {"", "-1", "nan", "1e9", "many"}) {
      some[name] = wrong;
      ATELIER_EXPECT_REFUSED(occlusion_at(some, "x"), DataError, name);
    }
  }
}

}  // namespace
}  // namespace atelier
