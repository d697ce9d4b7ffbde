#include "bodymodel/formats/skin_weights.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/bodymodel/synthetic_body.h"

namespace atelier {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(SkinWeights, PackedWeights_AreSortedAndMerged) {
  const PackedSkin packed = pack_skin_weights({{{0, 0.2}, {2, 0.5}, {0, 0.3}}, {{1, 1}}}, 3);
  ASSERT_EQ(packed.skin.joints.cols(), 2);
  EXPECT_TRUE(packed.findings.empty());
  EXPECT_EQ(packed.skin.joints(0, 0), 0);
  EXPECT_DOUBLE_EQ(packed.skin.weights(0, 0), 0.5);
  EXPECT_EQ(packed.skin.joints(0, 1), 2);
  EXPECT_DOUBLE_EQ(packed.skin.weights(1, 0), 1);
  EXPECT_DOUBLE_EQ(packed.skin.weights(1, 1), 0);
}

TEST(SkinWeights, SumsOtherThanOne_AreNormalizedAndReported) {
  const PackedSkin packed = pack_skin_weights({{{0, 0.6}, {1, 0.36}}, {{1, 1.06}}}, 2);
  EXPECT_DOUBLE_EQ(packed.skin.weights(0, 0), 0.6 / 0.96);
  EXPECT_DOUBLE_EQ(packed.skin.weights(1, 0), 1);
  ASSERT_EQ(packed.findings.size(), 1u);
  EXPECT_EQ(packed.findings[0].code, "skin-weights-sum");
  EXPECT_THAT(packed.findings[0].what, HasSubstr("2 vertices had weights that sum to 0.96"));
}

TEST(SkinWeights, NegativeWeights_BecomeZeroAndAreReported) {
  const PackedSkin packed = pack_skin_weights({{{0, 1.25}, {1, -0.25}}}, 2);
  EXPECT_DOUBLE_EQ(packed.skin.weights(0, 0), 1);
  ASSERT_EQ(packed.findings.size(), 1u);
  EXPECT_EQ(packed.findings[0].code, "skin-weights-negative");
}

TEST(SkinWeights, LightestWeights_ArePrunedAndReported) {
  SkinPackOptions options;
  options.max_slots = 2;
  const PackedSkin packed = pack_skin_weights({{{0, 0.5}, {1, 0.2}, {2, 0.3}}}, 3, options);
  EXPECT_EQ(packed.skin.joints.cols(), 2);
  EXPECT_EQ(packed.skin.joints(0, 1), 2);
  EXPECT_DOUBLE_EQ(packed.skin.weights(0, 1), 0.375);
  EXPECT_EQ(packed.findings.at(0).code, "skin-weights-pruned");
}

TEST(SkinWeights, RepairedModel_PassesItsCheck) {
  BodyModel model = fixtures::synthetic_body();
  model.skin.weights *= 0.9;
  model.skin.weights(3, 0) = -0.01;
  EXPECT_THROW(check_body_model(model), DataError);
  const PackedSkin repaired = repair_skin_weights(model.skin, joint_count(model));
  EXPECT_EQ(repaired.findings.size(), 2u);
  model.skin = repaired.skin;
  EXPECT_NO_THROW(check_body_model(model));
}

TEST(SkinWeights, UnrepairableWeights_AreRefused) {
  EXPECT_THAT(
      [] {
        pack_skin_weights({{{0, 1}}, {}}, 2, {}, "a.json");
      },
      ThrowsMessage<DataError>(
          AllOf(HasSubstr("a.json"), HasSubstr("vertex 1"), HasSubstr("no joint that moves it"))));
  EXPECT_THAT(
      [] {
        pack_skin_weights({{{0, NAN}}}, 2);
      },
      ThrowsMessage<DataError>(HasSubstr("not finite")));
  EXPECT_THAT(
      [] {
        pack_skin_weights({{{2, 1}}}, 2);
      },
      ThrowsMessage<DataError>(HasSubstr("a joint in [0, 2)")));
  EXPECT_THAT(
      [] {
        pack_skin_weights({{{0, 1e308}, {1, 1e308}}}, 2);
      },
      ThrowsMessage<DataError>(HasSubstr("no joint that moves it")));
}

}  // namespace
}  // namespace atelier
