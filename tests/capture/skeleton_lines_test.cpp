#include "capture/skeleton_lines.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace atelier {
namespace {

using ::testing::Contains;
using ::testing::Not;

using Line = std::array<int, 2>;

TEST(SkeletonLines, LimbsAndFullDetail_DifferByFaceAndHeels) {
  const KeypointSchema& schema = keypoint_schema("body_25");
  const Line heel = {find_keypoint(schema, "left_ankle"), find_keypoint(schema, "left_heel")};
  const Line knee = {find_keypoint(schema, "left_knee"), find_keypoint(schema, "left_ankle")};
  EXPECT_THAT(skeleton_lines(schema, SkeletonDetail::Limbs), Contains(knee));
  EXPECT_THAT(skeleton_lines(schema, SkeletonDetail::Limbs), Not(Contains(heel)));
  EXPECT_THAT(skeleton_lines(schema, SkeletonDetail::Full), Contains(knee));
  EXPECT_THAT(skeleton_lines(schema, SkeletonDetail::Full), Contains(heel));
}

TEST(SkeletonLines, SchemaWithoutAPoint_HasNoLineToIt) {
  const KeypointSchema& coco = keypoint_schema("coco_17");  // without neck, heels and toes
  for (const std::string& name : keypoint_schema_names()) {
    const KeypointSchema& schema = keypoint_schema(name);
    for (const auto& [a, b] : skeleton_lines(schema, SkeletonDetail::Full)) {
      EXPECT_GE(a, 0) << name;
      EXPECT_LT(b, static_cast<int>(schema.points.size())) << name;
      EXPECT_NE(a, b) << name;
    }
  }
  EXPECT_LT(skeleton_lines(coco, SkeletonDetail::Full).size(),
            skeleton_lines(keypoint_schema("body_25"), SkeletonDetail::Full).size());
}

}  // namespace
}  // namespace atelier
