#include "capture/triangulation.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/linear_triangulation.h"
#include "core/error.h"
#include "core/random.h"
#include "tests/capture/circle_of_cameras.h"

namespace atelier::fixtures {
namespace {

using ::testing::IsEmpty;

/// A person of points, left and right apart.
Points person(double shift) {
  const KeypointSchema& schema = body_25_schema();
  Points points(static_cast<Index>(schema.points.size()), 3);
  Random random{17, 0, 0};
  for (Index k = 0; k < points.rows(); ++k) {
    const std::string& name = schema.points[static_cast<std::size_t>(k)];
    const double side = name.starts_with("left") ? 1 : name.starts_with("right") ? -1 : 0;
    points.row(k) << 0.2 * side + 0.05 * uniform(random), 0.3 + 1.3 * uniform(random) + shift,
        0.2 * uniform(random);
  }
  return points;
}

Keypoints2d exact(const Camera& camera, const Points& points) {
  Keypoints2d detections(points.rows(), 3);
  for (Index k = 0; k < points.rows(); ++k) {
    const auto pixel = project(camera, points.row(k).transpose());
    detections.row(k) << pixel->x(), pixel->y(), 0.9;
  }
  return detections;
}

struct Recording {
  std::vector<Camera> cameras = circle_of_cameras({.count = 14});
  std::vector<Points> truth;
  std::vector<std::vector<Keypoints2d>> detections;

  Recording(int frames, const DetectorOptions& options, std::uint64_t seed = 1) {
    for (int f = 0; f < frames; ++f) {
      truth.push_back(person(0.01 * f));
      std::vector<Keypoints2d> views;
      for (std::size_t i = 0; i < cameras.size(); ++i) {
        views.push_back(detected_keypoints(
            cameras[i], body_25_schema(), truth.back(),
            std::vector<KeypointSight>(static_cast<std::size_t>(truth.back().rows())), options,
            Random{seed, static_cast<std::uint64_t>(f) * 100 + i, 0}));
      }
      detections.push_back(views);
    }
  }
  Triangulation triangulated(const TriangulationOptions& options = {}) const {
    return triangulate(cameras, detections, body_25_schema(), 12, options);
  }
  double mean_error(const Triangulation& found) const {
    double sum = 0;
    int count = 0;
    for (std::size_t f = 0; f < truth.size(); ++f) {
      for (Index k = 0; k < truth[f].rows(); ++k) {
        const SpacePoint& point = found.frames[f].points[static_cast<std::size_t>(k)];
        EXPECT_GT(point.confidence, 0);
        sum += (point.place - truth[f].row(k).transpose()).norm();
        ++count;
      }
    }
    return sum / count;
  }
};

TEST(TriangulatePoint, ExactDetections_GiveTheExactPoint) {
  const std::vector<Camera> cameras = circle_of_cameras({.count = 5});
  const Points truth = person(0);
  Keypoints2d rows(5, 3);
  for (Index i = 0; i < 5; ++i) {
    rows.row(i) = exact(cameras[static_cast<std::size_t>(i)], truth).row(3);
  }
  const SpacePoint point = triangulate_point(cameras, rows);
  EXPECT_LT((point.place - truth.row(3).transpose()).norm(), 1e-7);
  EXPECT_EQ(point.views, 5);
  EXPECT_LT(point.error, 1e-4);
}

TEST(TriangulatePoint, Outliers_DoNotMoveThePoint) {
  const std::vector<Camera> cameras = circle_of_cameras({.count = 8});
  const Points truth = person(0);
  Keypoints2d rows(8, 3);
  for (Index i = 0; i < 8; ++i) {
    rows.row(i) = exact(cameras[static_cast<std::size_t>(i)], truth).row(3);
  }
  rows(1, 0) += 200;
  rows(4, 1) -= 90;
  rows(5, 0) -= 300;
  const SpacePoint point = triangulate_point(cameras, rows);
  EXPECT_LT((point.place - truth.row(3).transpose()).norm(), 0.0005);
  EXPECT_EQ(point.views, 5);
}

TEST(TriangulatePoint, Covariance_MatchesTheScatter) {
  const std::vector<Camera> cameras = circle_of_cameras({.count = 6});
  const Points truth = person(0);
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d said = Eigen::Matrix3d::Zero();
  constexpr int kTrials = 1000;
  Random random{4, 0, 0};
  for (int trial = 0; trial < kTrials; ++trial) {
    Keypoints2d rows(6, 3);
    for (Index i = 0; i < 6; ++i) {
      rows.row(i) = exact(cameras[static_cast<std::size_t>(i)], truth).row(7);
      rows(i, 0) += 3 / std::sqrt(0.9) * normal(random);
      rows(i, 1) += 3 / std::sqrt(0.9) * normal(random);
    }
    const SpacePoint point = triangulate_point(cameras, rows);
    const Eigen::Vector3d off = point.place - truth.row(7).transpose();
    spread += off * off.transpose() / kTrials;
    said += point.covariance / kTrials;
  }
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(std::sqrt(said(i, i) / spread(i, i)), 1.1, 0.2);
  }
}

TEST(TriangulatePoint, OneViewOrParallelRays_GiveNoPoint) {
  const std::vector<Camera> cameras = circle_of_cameras({.count = 4});
  Keypoints2d rows = Keypoints2d::Zero(4, 3);
  rows.row(2) << 400, 500, 1;
  EXPECT_EQ(triangulate_point(cameras, rows).confidence, 0);
  const std::vector<Camera> twins(2, cameras[0]);
  Keypoints2d same(2, 3);
  same << 400, 500, 1, 400, 500, 1;
  EXPECT_EQ(triangulate_point(twins, same).confidence, 0);
}

TEST(LinearPoints, ExactDetections_GiveTheExactPoints) {
  std::vector<Camera> cameras = circle_of_cameras({.count = 5});
  cameras[1].distortion_model = Distortion::Brown;
  cameras[1].distortion = {-0.1, 0.02, 0.001, -0.002};
  cameras[2].distortion_model = Distortion::Fisheye;
  cameras[2].distortion = {0.05, -0.01};
  const Points truth = person(0);
  std::vector<Keypoints2d> detections;
  for (const Camera& camera : cameras) {
    detections.push_back(exact(camera, truth));
  }
  detections[0](3, 2) = 0;
  detections[0].row(3).head<2>().setConstant(-1e6);  // not seen, so of no account
  EXPECT_LT((linear_points(cameras, detections) - truth).rowwise().norm().maxCoeff(), 1e-9);
}

TEST(LinearPoints, NoisyDetections_HaveTheLeastSquaresOfPixels) {
  const std::vector<Camera> cameras = circle_of_cameras({.count = 6});
  const Points truth = person(0);
  Random random{5, 0, 0};
  std::vector<Keypoints2d> detections;
  for (const Camera& camera : cameras) {
    detections.push_back(exact(camera, truth));
    for (Index k = 0; k < truth.rows(); ++k) {
      detections.back().row(k) << detections.back()(k, 0) + normal(random),
          detections.back()(k, 1) + normal(random), uniform(random, 0.2, 1);
    }
  }
  const auto squares = [&](Index k, const Eigen::Vector3d& point) {
    double sum = 0;
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      const Eigen::RowVector2d off =
          project(cameras[c], point)->transpose() - detections[c].row(k).head<2>();
      sum += detections[c](k, 2) * detections[c](k, 2) * off.squaredNorm();
    }
    return sum;
  };
  const Points found = linear_points(cameras, detections);
  for (Index k = 0; k < truth.rows(); ++k) {
    const double least = squares(k, found.row(k).transpose());
    for (int axis = 0; axis < 3; ++axis) {
      for (const double step : {-1e-3, 1e-3}) {
        const Eigen::Vector3d beside =
            found.row(k).transpose() + step * Eigen::Vector3d::Unit(axis);
        EXPECT_LT(least, squares(k, beside)) << k;
      }
    }
  }
}

TEST(LinearPoints, OneViewOrParallelRays_GiveNoPoint) {
  std::vector<Camera> cameras = circle_of_cameras({.count = 2});
  const Points truth = person(0);
  std::vector<Keypoints2d> detections = {exact(cameras[0], truth), exact(cameras[1], truth)};
  detections[1](4, 2) = 0;
  const Points found = linear_points(cameras, detections);
  EXPECT_TRUE(found.row(4).array().isNaN().all());
  EXPECT_TRUE(found.row(5).allFinite());
  cameras[1] = cameras[0];
  detections[1] = detections[0];
  EXPECT_TRUE(linear_points(cameras, detections).array().isNaN().all());
  detections.pop_back();
  EXPECT_THROW(linear_points(cameras, detections), LogicError);
}

TEST(Triangulate, NoisyDetections_StayWithinTarget) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const Recording recording(4, {.noise = 3, .outliers = 0.1}, seed);
    EXPECT_LT(recording.mean_error(recording.triangulated()), 0.005);
  }
}

TEST(Triangulate, MiscalibratedCamera_IsNamedAndDownweighted) {
  Recording recording(4, {.noise = 3, .outliers = 0.1});
  for (auto& frame : recording.detections) {
    frame[5].col(0).array() += 12;
  }
  const Triangulation found = recording.triangulated();
  ASSERT_EQ(found.findings.size(), 1u);
  EXPECT_EQ(found.findings[0].code, "camera-off");
  EXPECT_EQ(found.findings[0].place, "cam5");
  EXPECT_LT(recording.mean_error(found), 0.005);
}

TEST(Triangulate, GoodCameras_AreNotNamed) {
  const Recording recording(4, {.noise = 3, .outliers = 0.1});
  EXPECT_THAT(recording.triangulated().findings, IsEmpty());
}

TEST(Triangulate, SwappedLimbs_AreSwappedBack) {
  Recording recording(2, {.perfect = true});
  const KeypointSchema& schema = body_25_schema();
  Keypoints2d& view = recording.detections[1][3];
  for (const char* name : {"hip", "knee", "ankle", "heel", "big_toe", "small_toe"}) {
    view.row(find_keypoint(schema, std::string("left_") + name))
        .swap(view.row(find_keypoint(schema, std::string("right_") + name)));
  }
  const Triangulation found = recording.triangulated();
  EXPECT_THAT(found.frames[0].swapped, IsEmpty());
  EXPECT_THAT(found.frames[1].swapped, ::testing::ElementsAre(3));
  EXPECT_EQ(
      found.frames[1].points[static_cast<std::size_t>(find_keypoint(schema, "left_knee"))].views,
      14);
}

TEST(Triangulate, ShortGaps_AreBridgedAndLongOnesStay) {
  Recording recording(8, {.perfect = true});
  for (std::size_t i = 0; i < recording.cameras.size(); ++i) {
    recording.detections[2][i].row(4).setZero();
    for (int f = 1; f < 7; ++f) {
      recording.detections[static_cast<std::size_t>(f)][i].row(9).setZero();
    }
  }
  const Triangulation found = recording.triangulated();
  const SpacePoint& bridged = found.frames[2].points[4];
  EXPECT_TRUE(bridged.bridged);
  EXPECT_LT(bridged.confidence, 0.2);
  EXPECT_LT((bridged.place - recording.truth[2].row(4).transpose()).norm(), 0.01);
  EXPECT_GT(bridged.covariance(0, 0), found.frames[1].points[4].covariance(0, 0));
  EXPECT_EQ(found.frames[3].points[9].confidence, 0);
}

TEST(Triangulate, MismatchedSizes_AreRefused) {
  const Recording recording(1, {.perfect = true});
  auto detections = recording.detections;
  detections[0].pop_back();
  EXPECT_THROW(triangulate(recording.cameras, detections, body_25_schema(), 12), LogicError);
  detections = recording.detections;
  detections[0][0].conservativeResize(7, 3);
  EXPECT_THROW(triangulate(recording.cameras, detections, body_25_schema(), 12), LogicError);
  EXPECT_THROW(triangulate(recording.cameras, recording.detections, body_25_schema(), 0),
               LogicError);
  EXPECT_THROW(triangulate_point(recording.cameras, Keypoints2d::Zero(3, 3)), LogicError);
}

}  // namespace
}  // namespace atelier::fixtures
