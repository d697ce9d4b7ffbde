#include "bodymodel/skinning.h"

#include <algorithm>
#include <numbers>
#include <numeric>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/rotation.h"
#include "bodymodel/skin_points.h"
#include "bodymodel/skinning_device.h"
#include "core/error.h"
#include "core/parallel.h"
#include "tests/bodymodel/synthetic_body.h"
#include "tests/support/finite_differences.h"

namespace atelier {
namespace {

/// Dense Jacobian of one vertex, [3, 3 + 3J + S]: translation, rotations, shape.
Eigen::MatrixXd vertex_jacobian(const BodyModel& model, const ShapedBody& body,
                                const PosedBody& posed, const SkinChains& chains, int vertex) {
  const std::vector<int> vertices(3, vertex);
  const Points directions = Eigen::Matrix3d::Identity();
  const SkinRows rows = skin_jacobian_rows(model, posed, chains, vertices, directions);
  const Index pose_columns = pose_parameter_count(model.skeleton);
  Eigen::MatrixXd jacobian =
      Eigen::MatrixXd::Zero(3, pose_columns + static_cast<Index>(model.shape.size()));
  jacobian.leftCols<3>().setIdentity();
  for (Index i = 0; i < 3; ++i) {
    for (int e = rows.begin[static_cast<std::size_t>(i)];
         e < rows.begin[static_cast<std::size_t>(i) + 1]; ++e) {
      jacobian.block<1, 3>(i, 3 + 3 * rows.joints[static_cast<std::size_t>(e)]) =
          rows.values.row(e);
    }
  }
  jacobian.rightCols(static_cast<Index>(model.shape.size())) =
      skin_shape_rows(model, body, posed, vertices, directions);
  return jacobian;
}

using fixtures::finite_difference_jacobian;
using fixtures::jacobian_error;
using fixtures::random_pose;
using fixtures::synthetic_body;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(Skinning, RestPose_GivesTheTemplate) {
  const BodyModel model = synthetic_body();
  for (const SkinMethod method : {SkinMethod::Linear, SkinMethod::DualQuaternion}) {
    SkinOptions options;
    options.method = method;
    const Points posed = skin_vertices(model, rest_pose(model.skeleton), {}, options);
    EXPECT_LT((posed - model.mesh.vertices).norm(), 1e-13);
  }
}

TEST(Skinning, RootRotation_MovesTheBodyRigidly) {
  BodyModel model = synthetic_body();
  model.correctives.clear();
  Pose pose = rest_pose(model.skeleton);
  pose.root_translation = {1, 2, 3};
  pose.rotations.row(0) << 0.3, -0.4, 1.2;
  const ShapedBody body = shape_body(model);
  const Eigen::Matrix3d turn = body.rest_rotations[0] * rotation_matrix(pose.rotations.row(0)) *
                               body.rest_rotations[0].transpose();
  Points expected = (body.vertices.rowwise() - body.joints.row(0)) * turn.transpose();
  expected.rowwise() += body.joints.row(0) + pose.root_translation.transpose();
  for (const SkinMethod method : {SkinMethod::Linear, SkinMethod::DualQuaternion}) {
    SkinOptions options;
    options.method = method;
    EXPECT_LT((skin_vertices(model, body, pose, options) - expected).norm(), 1e-12);
  }
}

TEST(Skinning, LinearBlending_IsTheWeightedMeanOfRigidMotions) {
  const BodyModel model = synthetic_body();
  const Pose pose = random_pose(model.skeleton, 9);
  const ShapedBody body = shape_body(model, Eigen::Vector2d(1.8, -1));
  const JointFrames frames = forward_kinematics(body.skeleton, pose);
  const Points rest = corrected_rest(model, body, pose);
  const Points posed = skin_vertices(model, body, pose);
  for (Index v = 0; v < vertex_count(model); ++v) {
    Eigen::Vector3d expected = Eigen::Vector3d::Zero();
    for (Index k = 0; k < model.skin.weights.cols(); ++k) {
      const int j = model.skin.joints(v, k);
      const Eigen::Vector3d local =
          body.rest_rotations[j].transpose() * (rest.row(v) - body.joints.row(j)).transpose();
      expected += model.skin.weights(v, k) *
                  (frames.rotations[j] * local + frames.positions.row(j).transpose());
    }
    EXPECT_LT((posed.row(v).transpose() - expected).norm(), 1e-13);
  }
}

TEST(Skinning, Shape_IsLinearInPhysicalValues) {
  const BodyModel model = synthetic_body();
  const Eigen::Vector2d tall(1.9, 0);
  const Points moved = shape_body(model, tall).vertices - model.mesh.vertices;
  EXPECT_LT((moved - 0.2 * model.shape[0].surface.offsets).norm(), 1e-14);
}

TEST(Skinning, ModelAtAShape_HasTheSameShapesFromThere) {
  const BodyModel model = fixtures::synthetic_body();
  const Eigen::Vector2d here(1.9, 0.7);
  const BodyModel moved = at_shape(model, here);
  EXPECT_EQ(neutral_shape(moved), here);
  const Pose pose = fixtures::random_pose(model.skeleton, 5);
  EXPECT_LT((skin_vertices(moved, pose) - skin_vertices(model, pose, here)).norm(), 1e-12);
  const Eigen::Vector2d other(1.6, -0.2);
  EXPECT_LT((skin_vertices(moved, pose, other) - skin_vertices(model, pose, other)).norm(), 1e-12);
  const Eigen::Vector2d far(2.5, 0);  // beyond the plausible range: it widens
  check_body_model(at_shape(model, far));
  EXPECT_THROW(at_shape(model, Eigen::Vector3d(1, 2, 3)), LogicError);
}

TEST(Skinning, SparseDirections_MoveOnlyTheirVertices) {
  const BodyModel model = synthetic_body();
  const Points moved = shape_body(model, Eigen::Vector2d(1.7, 2)).vertices - model.mesh.vertices;
  EXPECT_LT((moved.row(17) - 2 * model.shape[1].surface.offsets.row(3)).norm(), 1e-15);
  EXPECT_EQ(moved.row(16).norm(), 0);
}

TEST(Skinning, BendFeature_IsOneAtARightAngleAndZeroBehind) {
  BodyModel model = synthetic_body();
  Pose pose = rest_pose(model.skeleton);
  const Eigen::Vector3d axis = model.correctives.back().axis;
  const auto feature = [&](double angle) {
    pose.rotations.row(4) = angle * axis.transpose();
    return pose_features(model, pose).tail<1>()[0];
  };
  EXPECT_NEAR(feature(std::numbers::pi / 2), 1, 1e-14);
  EXPECT_NEAR(feature(std::numbers::pi / 3), 0.5, 1e-14);
  EXPECT_EQ(feature(0), 0);
  EXPECT_EQ(feature(-1), 0);
}

TEST(Skinning, PoseFeatureGradient_MatchesFiniteDifferences) {
  const BodyModel model = synthetic_body();
  const Pose pose = random_pose(model.skeleton, 10);
  const Points analytic = pose_features_gradient(model, pose);
  const Eigen::MatrixXd numeric = finite_difference_jacobian(
      [&](const Eigen::VectorXd& x) { return pose_features(model, pose_of_vector(x)); },
      pose_vector(pose));
  for (Index c = 0; c < analytic.rows(); ++c) {
    const int joint = model.correctives[static_cast<std::size_t>(c)].joint;
    EXPECT_LT((analytic.row(c) - numeric.block(c, 3 + 3 * joint, 1, 3)).norm(), 1e-8) << c;
  }
}

TEST(Skinning, VertexJacobian_MatchesFiniteDifferences) {
  const BodyModel model = synthetic_body(60, 8);
  const SkinChains chains = skin_chains(model);
  double worst = 0;
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    const Pose pose = random_pose(model.skeleton, seed, seed == 0 ? 0 : 0.8);
    const Eigen::Vector2d shape(1.62, 0.8);
    const ShapedBody body = shape_body(model, shape);
    const PosedBody posed = pose_body(model, body, pose);
    Eigen::VectorXd x(pose_parameter_count(model.skeleton) + 2);
    x << pose_vector(pose), shape;
    for (int vertex = 0; vertex < 60; vertex += 7) {
      const Eigen::MatrixXd numeric = finite_difference_jacobian(
          [&](const Eigen::VectorXd& p) {
            const Points moved = skin_vertices(model, pose_of_vector(p.head(p.size() - 2)),
                                               Eigen::VectorXd(p.tail(2)));
            return Eigen::VectorXd(moved.row(vertex).transpose());
          },
          x);
      worst = std::max(
          worst, jacobian_error(vertex_jacobian(model, body, posed, chains, vertex), numeric));
    }
  }
  RecordProperty("worst_error", ::testing::PrintToString(worst));
  std::printf(
      "derivatives of vertices by translation, rotations and shape: %.1e from finite ones\n",
      worst);
  EXPECT_LT(worst, 1e-6);
}

TEST(Skinning, PosedBody_AgreesWithForwardSkinning) {
  const BodyModel model = synthetic_body();
  const Pose pose = random_pose(model.skeleton, 11);
  const ShapedBody body = shape_body(model);
  EXPECT_EQ(pose_body(model, body, pose).vertices, skin_vertices(model, body, pose));
}

TEST(Skinning, RowsWithoutCorrectives_HoldOnlyTheChain) {
  const BodyModel model = synthetic_body();
  const SkinChains chains = skin_chains(model, false);
  const Pose pose = random_pose(model.skeleton, 12);
  const ShapedBody body = shape_body(model);
  const PosedBody posed = pose_body(model, body, pose, false);
  const SkinRows rows = skin_jacobian_rows(model, posed, chains, {3, 20}, Points::Identity(2, 3));
  for (std::size_t i = 0; i < 2; ++i) {
    const int vertex = i == 0 ? 3 : 20;
    for (int e = rows.begin[i]; e < rows.begin[i + 1]; ++e) {
      bool on_chain = false;
      for (Index k = 0; k < model.skin.weights.cols(); ++k) {
        for (int j = model.skin.weights(vertex, k) > 0 ? model.skin.joints(vertex, k) : -1; j >= 0;
             j = model.skeleton.parents[j]) {
          on_chain = on_chain || j == rows.joints[e];
        }
      }
      EXPECT_TRUE(on_chain);
    }
  }
}

TEST(Skinning, DualQuaternions_KeepTheRadiusOfATwistedTube) {
  // A vertex half-way between two joints, the second twisted by 150 degrees: linear blending pulls
  // it towards the axis, dual quaternions do not.
  BodyModel model;
  model.skeleton.names = {"a", "b"};
  model.skeleton.parents = {-1, 0};
  model.skeleton.offsets.resize(2, 3);
  model.skeleton.offsets << 0, 0, 0, 0, 1, 0;
  model.mesh.vertices = Eigen::RowVector3d(0.1, 0.5, 0);
  model.skin.joints.resize(1, 2);
  model.skin.joints << 0, 1;
  model.skin.weights.resize(1, 2);
  model.skin.weights << 0.5, 0.5;
  Pose pose = rest_pose(model.skeleton);
  pose.rotations.row(1) << 0, 150 * std::numbers::pi / 180, 0;
  SkinOptions options;
  EXPECT_LT(skin_vertices(model, pose, {}, options)(0, 0), 0.03);
  options.method = SkinMethod::DualQuaternion;
  const Points posed = skin_vertices(model, pose, {}, options);
  EXPECT_NEAR(std::hypot(posed(0, 0), posed(0, 2)), 0.1, 1e-12);
  EXPECT_NEAR(posed(0, 1), 0.5, 1e-12);
}

TEST(Skinning, AnyThreadCount_GivesTheSameBits) {
  const BodyModel model = synthetic_body(10'000, 4);
  const Pose pose = random_pose(model.skeleton, 13);
  const int before = thread_count();
  set_thread_count(1);
  const Points one = skin_vertices(model, pose);
  set_thread_count(7);
  const Points seven = skin_vertices(model, pose);
  set_thread_count(before);
  EXPECT_EQ(one, seven);
}

TEST(Skinning, VectorAndScalarCode_Agree) {
  for (const int slots : {2, 3, 4, 8}) {
    for (const Index vertices : {3, 40, 9'001}) {
      const BodyModel model = synthetic_body(vertices, slots);
      const Pose pose = random_pose(model.skeleton, 15);
      SkinOptions options;
      options.correctives = false;
      const Points fast = skin_vertices(model, pose, {}, options);
      options.vectors = false;
      const Points scalar = skin_vertices(model, pose, {}, options);
      EXPECT_LT((fast - scalar).cwiseAbs().maxCoeff(), 1e-14 * (1 + scalar.cwiseAbs().maxCoeff()))
          << slots << " slots, " << vertices << " vertices";
    }
  }
}

TEST(Skinning, CudaSkinning_TakesTimeProportionalToBytes) {
#ifdef ATELIER_HAS_CUDA
  if (cuda_available()) {
    for (const Index vertices : {20'000, 2'000'000}) {
      const BodyModel model = synthetic_body(vertices, 4);
      const ShapedBody body = shape_body(model);
      const double seconds = linear_kernel_seconds(
          body.vertices, model.skin,
          skin_transforms(body, forward_kinematics(body.skeleton, random_pose(model.skeleton, 3))),
          50);
      const double bytes = static_cast<double>(vertices) * (48 + 4 * 12);
      std::printf("linear kernel, %td vertices: %.2f us, %.0f GB/s\n", vertices, 1e6 * seconds,
                  1e-9 * bytes / seconds);
      EXPECT_GT(seconds, 0);
    }
    return;
  }
#endif
  GTEST_SKIP() << "no CUDA device answers";
}

TEST(Skinning, CudaAndCpu_Agree) {
  if (!cuda_available()) {
    GTEST_SKIP() << "no CUDA device answers";
  }
  const BodyModel model = synthetic_body(5'000, 6);
  const Pose pose = random_pose(model.skeleton, 14);
  for (const SkinMethod method : {SkinMethod::Linear, SkinMethod::DualQuaternion}) {
    SkinOptions options;
    options.method = method;
    options.vectors = false;
    const Points cpu = skin_vertices(model, pose, {}, options);
    options.device = Device::Cuda;
    const Points cuda = skin_vertices(model, pose, {}, options);
    EXPECT_LT((cuda - cpu).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_EQ(cuda, skin_vertices(model, pose, {}, options));  // the same bits again
  }
}

TEST(Skinning, MissingGpu_IsRefused) {
  if (cuda_available()) {
    GTEST_SKIP() << "there is a CUDA device";
  }
  SkinOptions options;
  options.device = Device::Cuda;
  const BodyModel model = synthetic_body();
  EXPECT_THROW(skin_vertices(model, rest_pose(model.skeleton), {}, options), EnvironmentError);
}

TEST(Skinning, PoseOfOtherModel_IsRefused) {
  const BodyModel model = synthetic_body();
  Pose pose = rest_pose(model.skeleton);
  pose.rotations.conservativeResize(3, 3);
  EXPECT_THAT([&] { skin_vertices(model, pose); },
              ThrowsMessage<LogicError>(HasSubstr("pose has 3 rotations")));
  EXPECT_THAT([&] { pose_features(model, pose); },
              ThrowsMessage<LogicError>(HasSubstr("body model has 7 joints")));
}

TEST(Skinning, ShapedBodyOfOtherModel_IsRefused) {
  const BodyModel model = synthetic_body();
  const ShapedBody other = shape_body(synthetic_body(50));
  EXPECT_THAT([&] { skin_vertices(model, other, rest_pose(model.skeleton)); },
              ThrowsMessage<LogicError>(HasSubstr("shaped body of another model")));
}

// Also where a corner counts nothing, where all three are one vertex, and where joints are held.
TEST(Skinning, FacePointsAndRows_AreCombinedFromTheirCorners) {
  const BodyModel model = synthetic_body();
  const ShapedBody body = shape_body(model);
  const Pose pose = random_pose(model.skeleton, 13);
  const PosedBody posed = pose_body(model, body, pose);
  const SkinChains chains = skin_chains(model);
  FacePoints points;
  points.vertices = {{3, 20, 31}, {7, 7, 7}, {5, 12, 30}, {3, 20, 31}};
  points.barycentric.resize(4, 3);
  points.barycentric << 0.2, 0.5, 0.3, 1, 0, 0, 0.6, 0.4, 0, 0.7, 0.1, 0.2;
  Points directions(4, 3);
  directions << 0.6, 0.8, 0, 0, 0, 1, 1, 0, 0, 0, 0.8, 0.6;
  for (const int held : {-1, 2}) {
    std::vector<int> slots;
    int sought = 0;
    for (int j = 0; j < joint_count(model); ++j) {
      slots.push_back(j == held ? -1 : sought++);
    }
    const SkinPoints ready = skin_points(model, chains, slots, points);
    std::vector<int> met;
    visit_skin_points(
        body, pose_joints(model, body, pose), ready, directions, [&](const ChainRows& chain) {
          ASSERT_EQ(chain.places.rows(), static_cast<Index>(chain.points.size()));
          for (std::size_t m = 0; m < chain.points.size(); ++m) {
            const int i = chain.points[m];
            met.push_back(i);
            Eigen::RowVector3d place = Eigen::RowVector3d::Zero();
            Eigen::RowVectorXd expected = Eigen::RowVectorXd::Zero(3 + 3 * sought);
            expected.head<3>() = directions.row(i);
            for (std::size_t c = 0; c < 3; ++c) {
              const int vertex = points.vertices[static_cast<std::size_t>(i)][c];
              const double share = points.barycentric(i, static_cast<Index>(c));
              place += share * posed.vertices.row(vertex);
              const Points scaled = share * directions.row(i);
              const SkinRows corner = skin_jacobian_rows(model, posed, chains, {vertex}, scaled);
              for (int e = corner.begin[0]; e < corner.begin[1]; ++e) {
                const int slot =
                    slots[static_cast<std::size_t>(corner.joints[static_cast<std::size_t>(e)])];
                if (slot >= 0) {
                  expected.segment<3>(3 + 3 * slot) += corner.values.row(e);
                }
              }
            }
            Eigen::RowVectorXd found = Eigen::RowVectorXd::Zero(3 + 3 * sought);
            found.head<3>() = chain.rows.row(static_cast<Index>(m)).head<3>();
            for (std::size_t l = 0; l < chain.chain.slots.size(); ++l) {
              found.segment<3>(3 + 3 * chain.chain.slots[l]) =
                  chain.rows.row(static_cast<Index>(m)).segment<3>(3 + 3 * static_cast<Index>(l));
            }
            EXPECT_LT((chain.places.row(static_cast<Index>(m)) - place).norm(), 1e-12) << i;
            EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-12) << i << ", held " << held;
          }
        });
    std::sort(met.begin(), met.end());
    EXPECT_EQ(met, (std::vector<int>{0, 1, 2, 3}));
  }
}

TEST(Skinning, PointsOnTheSameFace_ShareAChain) {
  const BodyModel model = synthetic_body();
  const ShapedBody body = shape_body(model);
  FacePoints points;
  points.vertices = {{3, 20, 31}, {31, 3, 20}};
  points.barycentric = Points::Constant(2, 3, 1.0 / 3);
  std::vector<int> slots(static_cast<std::size_t>(joint_count(model)));
  std::iota(slots.begin(), slots.end(), 0);
  const SkinPoints ready = skin_points(model, skin_chains(model), slots, points);
  ASSERT_EQ(ready.chains.size(), 1u);
  visit_skin_points(body, pose_joints(model, body, random_pose(model.skeleton, 3)), ready, {},
                    [&](const ChainRows& chain) {
                      EXPECT_EQ(chain.rows.rows(), 0);
                      EXPECT_LT((chain.places.row(0) - chain.places.row(1)).norm(), 1e-12);
                    });
}

TEST(Skinning, PointsOutOfRange_AreRefused) {
  const BodyModel model = synthetic_body();
  const ShapedBody body = shape_body(model);
  const SkinChains chains = skin_chains(model);
  std::vector<int> slots(static_cast<std::size_t>(joint_count(model)));
  std::iota(slots.begin(), slots.end(), 0);
  FacePoints points;
  points.vertices = {{1, 2, 40}};
  points.barycentric = Points::Constant(1, 3, 1.0 / 3);
  EXPECT_THAT([&] { skin_points(model, chains, slots, points); },
              ThrowsMessage<LogicError>(HasSubstr("vertex 40 out of range")));
  EXPECT_THAT([&] { skin_points(model, SkinChains{}, slots, points); },
              ThrowsMessage<LogicError>(HasSubstr("chains of another model")));
  EXPECT_THAT([&] { skin_points(model, chains, {0}, points); },
              ThrowsMessage<LogicError>(HasSubstr("a slot for each joint")));
  points.vertices = {{1, 2, 3}};
  std::vector<int> mixed = slots;
  std::reverse(mixed.begin(), mixed.end());
  EXPECT_THAT([&] { skin_points(model, chains, mixed, points); },
              ThrowsMessage<LogicError>(HasSubstr("slots increase with joints")));
  const SkinPoints ready = skin_points(model, chains, slots, points);
  const PosedBody posed = pose_joints(model, body, rest_pose(model.skeleton));
  EXPECT_THAT(
      [&] { visit_skin_points(body, posed, ready, Points::Identity(2, 3), [](const auto&) {}); },
      ThrowsMessage<LogicError>(HasSubstr("one direction for each point")));
}

TEST(Skinning, RowsOutOfRange_AreRefused) {
  const BodyModel model = synthetic_body();
  const ShapedBody body = shape_body(model);
  const PosedBody posed = pose_body(model, body, rest_pose(model.skeleton));
  const SkinChains chains = skin_chains(model);
  EXPECT_THAT([&] { skin_jacobian_rows(model, posed, chains, {40}, Points::Identity(1, 3)); },
              ThrowsMessage<LogicError>(HasSubstr("vertex 40 out of range")));
  EXPECT_THAT([&] { skin_jacobian_rows(model, posed, chains, {1}, Points::Identity(2, 3)); },
              ThrowsMessage<LogicError>(HasSubstr("one direction for each vertex")));
  EXPECT_THAT([&] { skin_shape_rows(model, body, posed, {-1}, Points::Identity(1, 3)); },
              ThrowsMessage<LogicError>(HasSubstr("vertex -1 out of range")));
}

}  // namespace
}  // namespace atelier
