#include "bodymodel/kinematics.h"

#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/rotation.h"
#include "core/error.h"
#include "tests/bodymodel/synthetic_body.h"
#include "tests/support/finite_differences.h"
#include "tests/support/joint_positions_jacobian.h"

namespace atelier {
namespace {

using fixtures::finite_difference_jacobian;
using fixtures::jacobian_error;
using fixtures::random_pose;
using fixtures::synthetic_body;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

Eigen::VectorXd flat(const Points& points) {
  return Eigen::Map<const Eigen::VectorXd>(points.data(), points.size());
}

TEST(Kinematics, TwoBoneArm_BendsAtItsElbow) {
  Skeleton arm;
  arm.names = {"shoulder", "elbow", "wrist"};
  arm.parents = {-1, 0, 1};
  arm.offsets.resize(3, 3);
  arm.offsets << 0, 1, 0, 0.3, 0, 0, 0.25, 0, 0;
  Pose pose = rest_pose(arm);
  pose.root_translation = {0, 0, 2};
  pose.rotations.row(1) << 0, 0, std::numbers::pi / 2;
  const JointFrames frames = forward_kinematics(arm, pose);
  Points expected(3, 3);
  expected << 0, 1, 2, 0.3, 1, 2, 0.3, 1.25, 2;
  EXPECT_LT((frames.positions - expected).norm(), 1e-15);
}

TEST(Kinematics, RestRotations_ComeBeforeThePose) {
  const BodyModel model = synthetic_body();
  const JointFrames rest = forward_kinematics(model.skeleton, rest_pose(model.skeleton));
  const Pose pose = random_pose(model.skeleton, 3);
  const JointFrames posed = forward_kinematics(model.skeleton, pose);
  // A child's frame is its parent's, then its rest rotation, then its own.
  const Eigen::Matrix3d expected = posed.rotations[1] *
                                   rotation_matrix(model.skeleton.rest_rotations.row(3)) *
                                   rotation_matrix(pose.rotations.row(3));
  EXPECT_LT((posed.rotations[3] - expected).norm(), 1e-14);
  EXPECT_LT((rest.positions - rest_positions(model.skeleton)).norm(), 1e-15);
}

TEST(Kinematics, EveryPose_KeepsBoneLengths) {
  const BodyModel model = synthetic_body();
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const JointFrames frames =
        forward_kinematics(model.skeleton, random_pose(model.skeleton, seed));
    for (Index j = 1; j < joint_count(model); ++j) {
      const int parent = model.skeleton.parents[static_cast<std::size_t>(j)];
      EXPECT_NEAR((frames.positions.row(j) - frames.positions.row(parent)).norm(),
                  model.skeleton.offsets.row(j).norm(), 1e-13);
    }
  }
}

TEST(Kinematics, PoseVector_RoundTrips) {
  const Pose pose = random_pose(synthetic_body().skeleton, 5);
  const Pose back = pose_of_vector(pose_vector(pose));
  EXPECT_EQ(back.root_translation, pose.root_translation);
  EXPECT_EQ(back.rotations, pose.rotations);
}

TEST(Kinematics, JointJacobian_MatchesFiniteDifferences) {
  const BodyModel model = synthetic_body();
  for (const double scale : {0.0, 0.7, 2.0}) {
    const Pose pose = random_pose(model.skeleton, 6, scale);
    const Eigen::MatrixXd numeric = finite_difference_jacobian(
        [&](const Eigen::VectorXd& x) {
          return flat(forward_kinematics(model.skeleton, pose_of_vector(x)).positions);
        },
        pose_vector(pose));
    const double error =
        jacobian_error(fixtures::joint_positions_jacobian(model.skeleton, pose), numeric);
    std::printf("derivatives of joints by the pose, rotations of %.1f rad: %.1e from finite ones\n",
                scale, error);
    EXPECT_LT(error, 1e-8);
  }
}

TEST(Kinematics, ShapedSkeleton_HasTheJointsOfTheShape) {
  const BodyModel model = synthetic_body();
  const Eigen::Vector2d shape(1.9, 0.5);
  const Points expected = rest_positions(model.skeleton) + 0.2 * model.shape[0].joints;
  EXPECT_LT((rest_positions(shaped_skeleton(model, shape)) - expected).norm(), 1e-13);
}

TEST(Kinematics, ShapeJacobian_MatchesFiniteDifferences) {
  const BodyModel model = synthetic_body();
  const Pose pose = random_pose(model.skeleton, 8);
  const Eigen::MatrixXd numeric = finite_difference_jacobian(
      [&](const Eigen::VectorXd& x) {
        return flat(forward_kinematics(shaped_skeleton(model, x), pose).positions);
      },
      neutral_shape(model));
  const Eigen::MatrixXd analytic =
      joint_positions_shape_jacobian(model, forward_kinematics(model.skeleton, pose));
  std::printf("derivatives of joints by the shape: %.1e from finite ones\n",
              jacobian_error(analytic, numeric));
  EXPECT_LT(jacobian_error(analytic, numeric), 1e-8);
}

TEST(Kinematics, PoseOfOtherSkeleton_IsRefused) {
  const BodyModel model = synthetic_body();
  Pose pose = rest_pose(model.skeleton);
  pose.rotations.conservativeResize(6, 3);
  EXPECT_THAT([&] { forward_kinematics(model.skeleton, pose); },
              ThrowsMessage<LogicError>(HasSubstr("pose has 6 rotations, skeleton has 7 joints")));
}

TEST(Kinematics, ShapeOfOtherModel_IsRefused) {
  const BodyModel model = synthetic_body();
  EXPECT_THAT([&] { shaped_skeleton(model, Eigen::VectorXd::Zero(5)); },
              ThrowsMessage<LogicError>(HasSubstr("shape has 5 values")));
  EXPECT_THAT([&] { shaped_skeleton(model, Eigen::Vector2d(NAN, 0)); },
              ThrowsMessage<LogicError>(HasSubstr("not finite")));
}

TEST(Kinematics, PoseVectorOfOddSize_IsRefused) {
  EXPECT_THAT([] { pose_of_vector(Eigen::VectorXd::Zero(4)); },
              ThrowsMessage<LogicError>(HasSubstr("3 + 3J values, not 4")));
}

}  // namespace
}  // namespace atelier
