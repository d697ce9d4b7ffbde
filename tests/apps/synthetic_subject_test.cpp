// How far the subject of a synthetic capture is from what stages assume: the figures that
// docs and issue name, measured on the body itself.
#if defined(ATELIER_HAS_BODYMODEL) && defined(ATELIER_HAS_CAPTURE)

#include "apps/synthetic_subject.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/synthetic_motion.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/skinning.h"
#include "core/error.h"
#include "core/normals.h"

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

TEST_P(DisplacedSubject, LeavesTheShapeSpaceAsFarAsItSays) {
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

TEST_P(DisplacedSubject, HasWeightsOfItsOwn) {
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

TEST(SoftTissue, LagsByAboutTwoMillimetres) {
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

TEST(SoftTissue, RestsOnABodyThatStandsStill) {
  const SyntheticSubject subject = make_subject({}, 1);
  const Points skinned = subject.model.mesh.vertices;
  SoftTissue flesh;
  for (int step = 0; step < 30; ++step) {
    flesh = soft_tissue_step(std::move(flesh), skinned, 1 / 60.0);
  }
  EXPECT_EQ((with_soft_tissue(subject, skinned, flesh, 0.002) - skinned).cwiseAbs().maxCoeff(), 0);
}

TEST(SubjectRefused, FilesThatAreNoBody) {
  EXPECT_THROW(make_subject({.body = "nowhere.npz"}, 1), DataError);
}

}  // namespace
}  // namespace atelier

#endif
