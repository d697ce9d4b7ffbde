#include "appearance/body_pose.h"

#include <Eigen/Geometry>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/support/refusals.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

/// Two boxes of points, the second hanging on the first.
BodyParts two_boxes() {
  BodyParts parts;
  parts.rest.resize(16, 3);
  for (int i = 0; i < 16; ++i) {
    parts.rest.row(i) << static_cast<float>(i & 1), static_cast<float>((i >> 1) & 1) * 0.5F,
        static_cast<float>((i >> 2) & 1) * 0.7F + (i < 8 ? 0.0F : 2.0F);
    parts.part.push_back(i < 8 ? 0 : 1);
  }
  parts.parents = {0, 0};
  return parts;
}

TEST(PoseCode, RestPose_IsZero) {
  const BodyParts parts = two_boxes();
  for (const float number : pose_code(parts, parts.rest)) {
    EXPECT_NEAR(number, 0, 1e-6F);
  }
}

TEST(PoseCode, BentPart_HasItsTurnWhereverTheBodyIs) {
  const BodyParts parts = two_boxes();
  const Eigen::Vector3f bend(0.3F, -0.8F, 0.4F);
  const Eigen::Matrix3f own = Eigen::AngleAxisf(bend.norm(), bend.normalized()).toRotationMatrix();
  const Eigen::Matrix3f whole =
      Eigen::AngleAxisf(2.5F, Eigen::Vector3f(1, 2, 0).normalized()).toRotationMatrix();
  FloatRows position = parts.rest;
  for (Index v = 0; v < position.rows(); ++v) {
    const Eigen::Vector3f rest = parts.rest.row(v);
    position.row(v) =
        whole * (v < 8 ? rest : Eigen::Vector3f(own * rest)) + Eigen::Vector3f(3, -1, 20);
  }
  const std::vector<float> code = pose_code(parts, position);
  ASSERT_EQ(code.size(), 6U);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(code[static_cast<std::size_t>(k)], 0, 1e-4F) << "the root hangs on nothing";
    EXPECT_NEAR(code[static_cast<std::size_t>(3 + k)], bend[k], 1e-4F);
  }
}

TEST(PoseCode, PartOnALine_SaysNothing) {
  BodyParts parts = two_boxes();
  for (Index v = 8; v < 16; ++v) {
    parts.rest.row(v) << static_cast<float>(v), 0, 0;
  }
  FloatRows position = parts.rest;
  position.rightCols<1>().array() += position.leftCols<1>().array();
  EXPECT_THAT(pose_code(parts, position), ::testing::Each(::testing::FloatNear(0, 1e-6F)));
}

TEST(BodyParts, JointOfFewVertices_IsPartOfItsParent) {
  const Mesh mesh = fixtures::grid(7, 7);
  std::vector<int> joints(64, 0);
  std::fill(joints.begin() + 20, joints.begin() + 24, 1);  // 4 vertices
  std::fill(joints.begin() + 40, joints.end(), 2);         // hangs on the small one
  const BodyParts parts = body_parts(mesh.vertices, joints, {-1, 0, 1});
  EXPECT_THAT(parts.parents, ::testing::ElementsAre(0, 0));
  EXPECT_EQ(parts.part[21], 0);
  EXPECT_EQ(parts.part[50], 1);
}

TEST(PoseMasks, TurnedPart_IsInTheMasksOfItselfAndItsParent) {
  const Mesh mesh = fixtures::grid(20, 1);  // a strip of 21 x 2
  std::vector<int> joints;
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    joints.push_back(std::min(2, static_cast<int>(3 * mesh.vertices(v, 0))));
  }
  BodyParts parts;
  parts.rest = mesh.vertices.cast<float>();
  parts.part = joints;
  parts.parents = {0, 0, 1};
  const Eigen::MatrixXf masks = pose_masks(parts, mesh.faces, 2);
  for (Index v = 0; v < masks.rows(); ++v) {
    EXPECT_GE(masks.row(v).minCoeff(), 0);
    EXPECT_LE(masks.row(v).maxCoeff(), 1 + 1e-6F);
    if (mesh.vertices(v, 0) < 0.15) {
      EXPECT_EQ(masks(v, 2), 0) << "two parts away";
      EXPECT_NEAR(masks(v, 1), 1, 1e-6F) << "its child";
    }
    if (mesh.vertices(v, 0) > 0.85) {
      EXPECT_NEAR(masks(v, 2), 1, 1e-6F);
      EXPECT_EQ(masks(v, 1), 0) << "its parent's turn is felt on parent and grandparent";
    }
  }
}

TEST(BodyParts, ArraysThatDoNotAgree_AreRefused) {
  BodyParts parts = two_boxes();
  parts.part[3] = 2;
  ATELIER_EXPECT_REFUSED(check_body_parts(parts, "a.h5"), DataError, "a.h5");
  parts = two_boxes();
  parts.parents[0] = 1;
  ATELIER_EXPECT_REFUSED(check_body_parts(parts), DataError, "parent of part 0");
  parts = two_boxes();
  parts.part.pop_back();
  ATELIER_EXPECT_REFUSED(check_body_parts(parts), DataError, "15 vertices");
  parts = two_boxes();
  parts.rest(0, 0) = std::numeric_limits<float>::quiet_NaN();
  ATELIER_EXPECT_REFUSED(check_body_parts(parts), DataError, "finite");
}

}  // namespace
}  // namespace atelier
