// How far the subject of a synthetic capture is from what stages assume: the figures that
// docs name, measured on the body itself.
#include "pipeline/synthesis/synthetic_subject.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/kinematics.h"
#include "bodymodel/retarget/synthetic_motion.h"
#include "bodymodel/skinning.h"
#include "core/error.h"
#include "core/normals.h"
#include "core/winding_number.h"

namespace atelier {
namespace {

struct Pair {
  SyntheticSubject real, exact;
};

Pair pair_of(std::uint64_t seed) {
  return {make_subject({}, seed), make_subject({.subject = "exact"}, seed)};
}

/// The displacement along the normals, m.
Eigen::VectorXd heights(const Pair& pair) {
  const Points& before = pair.exact.model.mesh.vertices;
  const Points normals = vertex_normals(before, pair.exact.model.mesh.faces);
  return (pair.real.model.mesh.vertices - before).cwiseProduct(normals).rowwise().sum();
}

class DisplacedSubject : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(DisplacedSubject, Displacement_HasTheStatedAmplitudeAndWavelength) {
  const Pair pair = pair_of(GetParam());
  const Points& before = pair.exact.model.mesh.vertices;
  const Triangles& faces = pair.exact.model.mesh.faces;
  const Eigen::VectorXd height = heights(pair);

  const Eigen::VectorXd areas = vertex_areas(before, faces);
  const double rms = std::sqrt(height.cwiseAbs2().dot(areas) / areas.sum());
  EXPECT_GE(rms, 0.0050);
  EXPECT_LE(rms, 0.0100);
  EXPECT_NEAR(rms, pair.real.displacement_rms, 1e-4);
  EXPECT_EQ(pair.exact.displacement_rms, 0);

  // The wave's mean length, by the rms of its slope over the surface.
  double slopes = 0;
  double squares = 0;
  for (Index f = 0; f < faces.rows(); ++f) {
    const Eigen::Vector3d a = before.row(faces(f, 0));
    const Eigen::Vector3d u = before.row(faces(f, 1)).transpose() - a;
    const Eigen::Vector3d v = before.row(faces(f, 2)).transpose() - a;
    const Eigen::Vector3d n = u.cross(v);
    if (n.squaredNorm() < 1e-20) {
      continue;
    }
    const double du = height[faces(f, 1)] - height[faces(f, 0)];
    const double dv = height[faces(f, 2)] - height[faces(f, 0)];
    const Eigen::Vector3d gradient = (du * v.cross(n) + dv * n.cross(u)) / n.squaredNorm();
    const double mean = (3 * height[faces(f, 0)] + du + dv) / 3;
    slopes += gradient.squaredNorm() * n.norm();
    squares += mean * mean * n.norm();
  }
  const double wavelength = 2 * std::numbers::pi * std::sqrt(squares / slopes);
  EXPECT_GE(wavelength, 0.05);
  EXPECT_LE(wavelength, 0.20);

  // Left and right differ: the mirrored body is another one.
  const Index pairs = [&] {
    Index middle = 0;
    while (std::abs(before(middle, 0)) < 1e-9) {
      ++middle;
    }
    return (before.rows() - middle) / 2;
  }();
  const Eigen::VectorXd left = height.segment(before.rows() - 2 * pairs, pairs);
  const Eigen::VectorXd right = height.tail(pairs);
  EXPECT_LT(left.dot(right) / (left.norm() * right.norm()), 0.6);
  RecordProperty("rms_mm", std::to_string(1000 * rms));
  RecordProperty("wavelength_cm", std::to_string(100 * wavelength));
}

TEST_P(DisplacedSubject, DisplacedBody_HasItsOwnSkinWeights) {
  const Pair pair = pair_of(GetParam());
  const auto& real = pair.real.model.skin.weights;
  const auto& exact = pair.exact.model.skin.weights;
  double squares = 0;
  int count = 0;
  for (Index v = 0; v < real.rows(); ++v) {
    EXPECT_NEAR(real.row(v).sum(), 1, 1e-9);
    for (Index k = 0; k < real.cols(); ++k) {
      if (exact(v, k) > 0.05 && exact(v, k) < 0.5) {
        squares += std::pow(real(v, k) / exact(v, k) - 1, 2);
        ++count;
      }
    }
  }
  ASSERT_GT(count, 1000);
  const double jitter = std::sqrt(squares / count);
  EXPECT_GT(jitter, 0.05);
  EXPECT_LT(jitter, 0.15);
  RecordProperty("jitter", std::to_string(jitter));
}

INSTANTIATE_TEST_SUITE_P(Seeds, DisplacedSubject, ::testing::Values(1, 2));

/// Share of points a little off the skin of the left arm, from the middle of the upper arm on, that
/// lie in the rest of the body.
double share_in_body(const BodyModel& model, const Pose& pose) {
  const Points vertices = skin_vertices(model, shape_body(model), pose);
  const Points normals = vertex_normals(vertices, model.mesh.faces);
  const Points joints = rest_positions(model.skeleton);
  const int shoulder = find_joint(model.skeleton, "left_shoulder");
  const int elbow = find_joint(model.skeleton, "left_elbow");
  const Eigen::RowVector3d along = joints.row(elbow) - joints.row(shoulder);
  std::vector<Index> arm;
  for (Index v = 0; v < vertex_count(model); ++v) {
    double share = 0;
    for (Index k = 0; k < model.skin.joints.cols(); ++k) {
      const int joint = model.skin.joints(v, k);
      share += joint == shoulder || joint == elbow ? model.skin.weights(v, k) : 0;
    }
    const double place = (model.mesh.vertices.row(v) - joints.row(shoulder)).dot(along);
    if (share > 0.95 && place > 0.5 * along.squaredNorm()) {
      arm.push_back(v);
    }
  }
  const WindingTree tree = build_winding_tree(vertices, model.mesh.faces);
  int inside = 0;
  for (const Index v : arm) {
    const Eigen::Vector3d off = (vertices.row(v) + 0.008 * normals.row(v)).transpose();
    inside += winding_number(tree, off) > 0.5 ? 1 : 0;
  }
  EXPECT_GT(arm.size(), 100U);
  return static_cast<double>(inside) / static_cast<double>(arm.size());
}

TEST(SyntheticMotion, Arms_StayClearOfTheTrunk) {
  for (const std::uint64_t seed : {1, 2, 201}) {
    const SyntheticSubject subject = make_subject({}, seed);
    for (const char* motion : {"stride", "squat"}) {
      const ContinuousMotion moves = continuous_motion(subject.model, motion, 2, 0);
      for (const double seconds : {0.3, 0.8, 1.3, 1.7}) {
        EXPECT_EQ(share_in_body(subject.model, moves.pose(seconds)), 0)
            << motion << " of seed " << seed << " at " << seconds << " s";
      }
    }
  }
}

/// Distances between flesh and skinned bones, mm, of soft vertices over a motion's second half.
std::vector<double> lags(const SyntheticSubject& subject, const std::string& motion) {
  const ContinuousMotion moves = continuous_motion(subject.model, motion, 2, 0);
  const ShapedBody shape = shape_body(subject.model);
  SoftTissue flesh;
  std::vector<double> result;
  for (int step = 0; step < 120; ++step) {
    const Points skinned = skin_vertices(subject.model, shape, moves.pose(step / 60.0));
    flesh = soft_tissue_step(std::move(flesh), skinned, 1 / 60.0);
    if (step < 60) {
      continue;
    }
    const Points now = with_soft_tissue(subject, skinned, flesh, 0.002);
    for (Index v = 0; v < now.rows(); v += 7) {
      if (subject.softness[v] > 0.9) {
        result.push_back(1000 * (now.row(v) - skinned.row(v)).norm());
      }
    }
  }
  std::sort(result.begin(), result.end());
  return result;
}

TEST(SoftTissue, MovingTissue_LagsByAboutTwoMillimetres) {
  const SyntheticSubject subject = make_subject({}, 1);
  for (const char* motion : {"stride", "spin"}) {
    const std::vector<double> lag = lags(subject, motion);
    ASSERT_GT(lag.size(), 1000U);
    double squares = 0;
    for (const double one : lag) {
      squares += one * one;
    }
    const double rms = std::sqrt(squares / static_cast<double>(lag.size()));
    const double p95 = lag[lag.size() * 95 / 100];
    EXPECT_GT(rms, 0.5) << motion;
    EXPECT_LT(rms, 3.0) << motion;
    EXPECT_GT(p95, 1.0) << motion;
    EXPECT_LT(lag.back(), 4.0) << motion;  // it saturates at twice the amplitude
    RecordProperty(std::string(motion) + "_rms_mm", std::to_string(rms));
    RecordProperty(std::string(motion) + "_p95_mm", std::to_string(p95));
  }
}

TEST(SoftTissue, StandingBody_HasNoSoftTissueLag) {
  const SyntheticSubject subject = make_subject({}, 1);
  const Points skinned = subject.model.mesh.vertices;
  SoftTissue flesh;
  for (int step = 0; step < 30; ++step) {
    flesh = soft_tissue_step(std::move(flesh), skinned, 1 / 60.0);
  }
  EXPECT_EQ((with_soft_tissue(subject, skinned, flesh, 0.002) - skinned).cwiseAbs().maxCoeff(), 0);
}

TEST(SubjectRefused, NonBodyFile_Throws) {
  EXPECT_THROW(make_subject({.body = "nowhere.npz"}, 1), DataError);
}

TEST(MotionsOfFiles, MotionEnteredAnywhere_BeginsFacingAsAtRest) {
  const SyntheticSubject subject = make_subject({.subject = "exact"}, 1);
  const Skeleton& skeleton = subject.model.skeleton;
  // Somebody who walks in a circle about (3, 0, -2), two metres off it, from a recording.
  const ContinuousMotion circling{[&](double seconds) {
                                    Pose pose = rest_pose(skeleton);
                                    pose.rotations.row(0) << 0, 1.3 * seconds, 0;
                                    pose.rotations.row(1) << -0.3 * std::sin(4 * seconds), 0, 0;
                                    pose.root_translation << 3 + 2 * std::cos(1.3 * seconds), 0.05,
                                        -2 - 2 * std::sin(1.3 * seconds);
                                    return pose;
                                  },
                                  10};
  const double entry = 2.2;
  const ContinuousMotion staged = facing_as_at_rest(subject.model, circling, entry);
  EXPECT_EQ(staged.duration, circling.duration);
  const Points rest = rest_positions(skeleton);
  const Points first = forward_kinematics(skeleton, staged.pose(entry)).positions;
  EXPECT_NEAR(first(0, 0), rest(0, 0), 1e-9);
  EXPECT_NEAR(first(0, 2), rest(0, 2), 1e-9);
  const int left = find_joint(skeleton, "left_hip");
  const int right = find_joint(skeleton, "right_hip");
  ASSERT_GE(left, 0);
  const Eigen::RowVector3d across = first.row(left) - first.row(right);
  EXPECT_GT(across.x(), 0.05);
  EXPECT_NEAR(across.z(), (rest.row(left) - rest.row(right)).z(), 1e-6);
  // It is the same motion, moved rigidly about the vertical: heights and distances stay.
  for (const double t : {0.0, 3.7, 9.0}) {
    const Points a = forward_kinematics(skeleton, circling.pose(t)).positions;
    const Points b = forward_kinematics(skeleton, staged.pose(t)).positions;
    EXPECT_LT((a.col(1) - b.col(1)).cwiseAbs().maxCoeff(), 1e-9);
    const Points before = forward_kinematics(skeleton, circling.pose(entry)).positions;
    const Points after = forward_kinematics(skeleton, staged.pose(entry)).positions;
    for (Index j = 0; j < a.rows(); ++j) {
      EXPECT_NEAR((a.row(j) - before.row(0)).norm(), (b.row(j) - after.row(0)).norm(), 1e-9);
    }
  }
}

}  // namespace
}  // namespace atelier
