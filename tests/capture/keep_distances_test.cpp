#include "capture/keep_distances.h"

#include <cmath>

#include <gtest/gtest.h>

#include "core/random.h"

namespace atelier {
namespace {

const KeypointSchema& schema() {
  return body_25_schema();
}

std::size_t row(const char* name) {
  return static_cast<std::size_t>(find_keypoint(schema(), name));
}

/// A leg that swings at the knee (thigh and shin 0.4 m), and a neck whose shoulder rises.
struct Figure {
  std::vector<SpacePose> truth, seen;

  Figure(int frames, double noise, std::uint64_t seed) {
    for (int f = 0; f < frames; ++f) {
      const double angle = 0.8 * std::sin(0.7 * f);
      SpacePose pose;
      pose.points.resize(schema().points.size());
      const auto put = [&](const char* name, const Eigen::Vector3d& place) {
        SpacePoint& point = pose.points[row(name)];
        point.place = place;
        point.confidence = 0.8;
        point.covariance = noise * noise * Eigen::Matrix3d::Identity();
      };
      put("left_hip", {0, 1, 0});
      put("left_knee", {0, 1 - 0.4 * std::cos(angle), 0.4 * std::sin(angle)});
      put("left_ankle", {0, 0.6 - 0.4 * std::cos(angle), 0.4 * std::sin(angle)});
      put("neck", {0, 1.5, 0});
      put("left_shoulder", {0.15 + 0.04 * std::sin(0.7 * f), 1.5, 0});
      truth.push_back(pose);
      Random random{seed, static_cast<std::uint64_t>(f)};
      for (SpacePoint& point : pose.points) {
        for (int axis = 0; axis < 3 && point.confidence > 0; ++axis) {
          point.place[axis] += noise * normal(random);
        }
      }
      seen.push_back(pose);
    }
  }
};

double length(const SpacePose& pose, const char* a, const char* b) {
  return (pose.points[row(a)].place - pose.points[row(b)].place).norm();
}

double mean_error(const std::vector<SpacePose>& truth, const std::vector<SpacePose>& found,
                  std::initializer_list<const char*> names) {
  double sum = 0;
  for (std::size_t f = 0; f < truth.size(); ++f) {
    for (const char* name : names) {
      sum += (truth[f].points[row(name)].place - found[f].points[row(name)].place).norm();
    }
  }
  return sum / static_cast<double>(truth.size() * names.size());
}

TEST(KeepDistances, BoneLengths_AreStabilizedAndJointsImprove) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Figure figure(24, 0.01, seed);
    std::vector<SpacePose> found = figure.seen;
    keep_distances(found, schema());
    const auto leg = {"left_hip", "left_knee", "left_ankle"};
    EXPECT_LT(mean_error(figure.truth, found, leg),
              0.95 * mean_error(figure.truth, figure.seen, leg))
        << seed;
    for (const auto& [from, to] :
         {std::pair{"left_hip", "left_knee"}, {"left_knee", "left_ankle"}}) {
      double before = 0;
      double after = 0;
      for (std::size_t f = 0; f < found.size(); ++f) {
        before += std::pow(length(figure.seen[f], from, to) - 0.4, 2);
        after += std::pow(length(found[f], from, to) - 0.4, 2);
      }
      EXPECT_LT(after, 0.4 * before) << seed << " " << from;
    }
    for (const SpacePose& pose : found) {
      EXPECT_LT(pose.points[row("left_knee")].covariance.trace(), 3 * 0.01 * 0.01) << "no surer";
    }
  }
}

// A shoulder that rises by 4 cm is not held at the mean.
TEST(KeepDistances, ChangingDistance_IsNotConstrained) {
  Figure figure(24, 0.002, 3);
  std::vector<SpacePose> found = figure.seen;
  keep_distances(found, schema());
  EXPECT_LT(mean_error(figure.truth, found, {"left_shoulder"}),
            1.2 * mean_error(figure.truth, figure.seen, {"left_shoulder"}));
}

TEST(KeepDistances, FewFrames_ChangeNothing) {
  Figure figure(5, 0.01, 1);
  std::vector<SpacePose> found = figure.seen;
  keep_distances(found, schema());
  EXPECT_EQ(mean_error(figure.seen, found, {"left_hip", "left_knee", "left_ankle"}), 0);
  std::vector<SpacePose> none;
  keep_distances(none, schema());
  EXPECT_TRUE(none.empty());
}

TEST(KeepDistances, MissingOrBridgedPoints_StayUnchanged) {
  Figure figure(12, 0.01, 2);
  SpacePoint& lost = figure.seen[4].points[row("left_knee")];
  lost = SpacePoint{};
  lost.place = {7, 7, 7};
  figure.seen[5].points[row("left_knee")].bridged = true;
  figure.seen[6].points[row("left_knee")].place = figure.seen[6].points[row("left_hip")].place;
  std::vector<SpacePose> found = figure.seen;
  keep_distances(found, schema());
  EXPECT_EQ(found[4].points[row("left_knee")].place, Eigen::Vector3d(7, 7, 7));
  EXPECT_EQ(found[5].points[row("left_knee")].place, figure.seen[5].points[row("left_knee")].place);
  EXPECT_TRUE(found[6].points[row("left_knee")].place.allFinite());
}

}  // namespace
}  // namespace atelier
