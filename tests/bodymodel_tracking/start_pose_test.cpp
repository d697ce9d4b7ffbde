// Poses from keypoints alone, and names that detectors mix up: sides exchanged in single frames and
// in whole runs of them, backs taken for fronts.
#include "bodymodel/tracking/start_pose.h"

#include <algorithm>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/rotation.h"
#include "tests/bodymodel_tracking/posed_person.h"

namespace atelier::fixtures {
namespace {

using ::testing::Contains;
using ::testing::Field;

constexpr double kSeenNoise = 0.003;   // m
constexpr double kRunRate = 12;        // frames a second, as captures have
constexpr std::size_t kRunFrames = 9;  // of a run

TEST(StartPose, AnyPose_IsFoundFromItsKeypoints) {
  const FittedPerson& person = fitted_human();
  Random random{11};
  for (int trial = 0; trial < 12; ++trial) {
    Eigen::VectorXd x = walking(person, 0.3 * trial);
    Eigen::Vector3d axis(normal(random), normal(random), normal(random));
    x.segment<3>(3) = 3.0 * axis.normalized();  // lying, upside down, turned round
    x.head<3>() += Eigen::Vector3d(5 * normal(random), normal(random), normal(random));
    const FrameTargets seen = keypoints_of(person, x, 0.003, random);
    const auto starts = start_poses(person, {seen}, {0}, {});
    EXPECT_TRUE(starts[0].trusted);
    EXPECT_EQ(starts[0].reading, SideReading::AsNamed);
    EXPECT_LT(joint_error(person, starts[0].x, x), 0.02) << trial;
  }
}

/// Someone with arms up who goes down on bent knees.
Eigen::VectorXd squatting(const FittedPerson& person, double seconds) {
  Pose pose = rest_pose(person.shaped.skeleton);
  const auto turn = [&](const char* name, double x, double y, double z) {
    pose.rotations.row(find_joint(person.shaped.skeleton, name)) << x, y, z;
  };
  const double down = 0.5 - 0.5 * std::cos(4 * seconds);
  turn("pelvis", 0.2 * down, -0.8, 0);
  for (const char* hip : {"left_hip", "right_hip"}) {
    turn(hip, -1.5 * down, 0, 0);
  }
  for (const char* knee : {"left_knee", "right_knee"}) {
    turn(knee, 1.7 * down, 0, 0);
  }
  turn("left_shoulder", 0, 0, 0.9);
  turn("right_shoulder", 0, 0, -0.6);
  turn("left_elbow", 0, -0.6, 0);
  turn("right_elbow", 0, 0.9, 0);
  pose.root_translation = {0, -0.4 * down, 0};
  return pose_variables(person, pose);
}

/// Someone on the back who pedals.
Eigen::VectorXd lying(const FittedPerson& person, double seconds) {
  Eigen::VectorXd x = walking(person, seconds);
  x.segment<3>(3) = rotation_vector(rotation_matrix(Eigen::Vector3d(-EIGEN_PI / 2, 0, 0)) *
                                    rotation_matrix(Eigen::Vector3d(0, 0.4 * seconds, 0)));
  return x;
}

/// What a detector took for the other side.
struct Exchange {
  const char* name;
  std::vector<std::string> parts;
  SideReading reading;
};

const std::vector<Exchange>& exchanges() {
  static const std::vector<std::string> legs = {"hip",     "knee",      "ankle",
                                                "big_toe", "small_toe", "heel"};
  static const std::vector<std::string> arms = {"shoulder", "elbow", "wrist"};
  static const std::vector<std::string> all = {"hip",       "knee", "ankle",    "big_toe",
                                               "small_toe", "heel", "shoulder", "elbow",
                                               "wrist",     "eye",  "ear"};
  static const std::vector<Exchange> every = {{"legs", legs, SideReading::LegsMirrored},
                                              {"arms", arms, SideReading::ArmsMirrored},
                                              {"back for front", all, SideReading::Mirrored}};
  return every;
}

void exchange(const FittedPerson& person, FrameTargets& targets, const Exchange& exchange) {
  const auto at = [&](const std::string& name) {
    const auto& names = person.places.names;
    return std::find(names.begin(), names.end(), name) - names.begin();
  };
  for (const std::string& part : exchange.parts) {
    targets.keypoints.row(at("left_" + part)).swap(targets.keypoints.row(at("right_" + part)));
  }
}

/// Which frames of a run are read wrongly.
struct Pattern {
  const char* name;
  std::function<bool(std::size_t frame, Random& random)> wrong;
};

const std::vector<Pattern>& patterns() {
  static const std::vector<Pattern> every = {
      {"one", [](std::size_t f, Random&) { return f == 2; }},
      {"all", [](std::size_t, Random&) { return true; }},
      {"a random half", [](std::size_t, Random& random) { return uniform(random) < 0.5; }},
      {"every other", [](std::size_t f, Random&) { return f % 2 == 1; }},
      {"the second half", [](std::size_t f, Random&) { return f >= kRunFrames / 2; }}};
  return every;
}

struct MovingPerson {
  const char* name;
  Eigen::VectorXd (*at)(const FittedPerson& person, double seconds);
};

class ExchangedSides : public ::testing::TestWithParam<MovingPerson> {};

INSTANTIATE_TEST_SUITE_P(StartPose, ExchangedSides,
                         testing::Values(MovingPerson{"walking", walking},
                                         MovingPerson{"squatting", squatting},
                                         MovingPerson{"lying", lying}),
                         [](const auto& motion) { return std::string(motion.param.name); });

TEST_P(ExchangedSides, SwappedSides_AreCorrectedOverRunsOfFrames) {
  const FittedPerson& person = fitted_human();
  Random random{12};
  for (const Exchange& what : exchanges()) {
    for (const Pattern& pattern : patterns()) {
      SCOPED_TRACE(std::string(what.name) + ", " + pattern.name);
      std::vector<FrameTargets> frames;
      std::vector<double> times;
      std::vector<bool> wrong;
      for (std::size_t f = 0; f < kRunFrames; ++f) {
        times.push_back(static_cast<double>(f) / kRunRate);
        frames.push_back(keypoints_of(person, GetParam().at(person, times[f]), kSeenNoise, random));
        wrong.push_back(pattern.wrong(f, random));
        if (wrong[f]) {
          exchange(person, frames[f], what);
        }
      }
      const auto starts = start_poses(person, frames, times, {});
      for (std::size_t f = 0; f < kRunFrames; ++f) {
        EXPECT_EQ(starts[f].reading, wrong[f] ? what.reading : SideReading::AsNamed) << f;
        EXPECT_TRUE(starts[f].trusted) << f;
        EXPECT_LT(joint_error(person, starts[f].x, GetParam().at(person, times[f])), 0.02) << f;
      }
    }
  }
}

TEST_P(ExchangedSides, SwappedSides_AreTrackedAsIfNeverSwapped) {
  const FittedPerson& person = fitted_human();
  Random random{21};
  for (const Exchange& what : exchanges()) {
    SCOPED_TRACE(what.name);
    TrackInput input;
    input.keypoint_names = body_25_names();
    input.fps = kRunRate;
    for (std::size_t f = 0; f < kRunFrames; ++f) {
      const Eigen::VectorXd x = GetParam().at(person, static_cast<double>(f) / kRunRate);
      FrameTargets seen = keypoints_of(person, x, kSeenNoise, random);
      input.frame_ids.push_back(static_cast<int>(f));
      input.frames.push_back({seen.keypoints, seen.deviations, {}});
    }
    const Tracking plain = track(plain_human(), input);
    for (std::size_t f = 0; f < kRunFrames; ++f) {
      FrameTargets seen{input.frames[f].keypoints, input.frames[f].deviations, {}};
      if (f % 4 != 0) {
        exchange(person, seen, what);
      }
      input.frames[f].keypoints = seen.keypoints;
    }
    const Tracking tracking = track(plain_human(), input);
    EXPECT_THAT(tracking.findings, Contains(Field(&Finding::code, "left-right")));
    for (std::size_t f = 0; f < kRunFrames; ++f) {
      EXPECT_EQ(tracking.tracked.trusted[f], 1) << f;
      EXPECT_LT((tracking.tracked.joints[f] - plain.tracked.joints[f]).cwiseAbs().maxCoeff(), 1e-3)
          << f;
    }
  }
}

TEST(StartPose, LegsAndWholePersonSwappedInOneSequence_AreCorrected) {
  const FittedPerson& person = fitted_human();
  Random random{12};
  std::vector<FrameTargets> frames;
  std::vector<double> times;
  for (std::size_t f = 0; f < kRunFrames; ++f) {
    times.push_back(static_cast<double>(f) / 30);
    frames.push_back(keypoints_of(person, walking(person, times[f]), kSeenNoise, random));
  }
  exchange(person, frames[2], exchanges()[0]);
  exchange(person, frames[6], exchanges()[2]);
  const auto starts = start_poses(person, frames, times, {});
  EXPECT_EQ(starts[2].reading, SideReading::LegsMirrored);
  EXPECT_EQ(starts[6].reading, SideReading::Mirrored);
  for (std::size_t f = 0; f < kRunFrames; ++f) {
    EXPECT_LT(joint_error(person, starts[f].x, walking(person, times[f])), 0.02) << f;
  }
}

}  // namespace
}  // namespace atelier::fixtures
