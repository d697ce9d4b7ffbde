#include "bodymodel/check_motion.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/motion_bvh.h"
#include "bodymodel/formats/motion_file.h"
#include "core/quantity_text.h"
#include "tests/bodymodel/synthetic_person.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

using fixtures::person_clip;
using ::testing::HasSubstr;

bool has(const std::vector<Finding>& findings, const std::string& code) {
  return std::any_of(findings.begin(), findings.end(),
                     [&](const Finding& finding) { return finding.code == code; });
}

TEST(DoubtMotion, PersonWhoWalks_IsNotDoubted) {
  EXPECT_TRUE(check_motion(person_clip()).empty());
  MotionClip slow = person_clip();  // a metre a frame, and a frame a second
  slow.motion.fps = 1;
  for (std::size_t i = 0; i < slow.motion.poses.size(); ++i) {
    slow.motion.poses[i].root_translation.x() = 1.2 * static_cast<double>(i);
  }
  EXPECT_TRUE(check_motion(slow).empty());
}

TEST(DoubtMotion, Leaps_AreNamedByTheFirstFrame) {
  MotionClip clip = person_clip();
  clip.motion.poses[2].root_translation.x() += 500;
  const std::vector<Finding> findings = check_motion(clip);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].code, "motion-jump");
  EXPECT_EQ(findings[0].what, "the root leaps 2 times, first by 500 m before frame 2");
  clip.motion.frame_ids = {0, 1, 2000, 4000, 4001};  // in a minute
  EXPECT_TRUE(check_motion(clip).empty());
}

TEST(DoubtMotion, BoneOfNoPerson_IsNamed) {
  MotionClip clip = person_clip();
  clip.skeleton.offsets.row(8) << 50, 0, 0;
  const std::vector<Finding> findings = check_motion(clip);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].code, "motion-bone");
  EXPECT_THAT(findings[0].what, HasSubstr(clip.skeleton.names[8] + " is 50 m from its parent"));
}

// Somebody who walks 1.9 m: each foot stands while the other is ahead.
MotionClip walk() {
  MotionClip clip = person_clip();
  clip.motion.poses.clear();
  clip.motion.frame_ids.clear();
  for (int i = 0; i < 60; ++i) {
    Pose pose = rest_pose(clip.skeleton);
    const double stride = 0.35 * std::sin(2 * std::numbers::pi * i / 30);
    pose.rotations.row(1) << stride, 0, 0;
    pose.rotations.row(5) << -stride, 0, 0;
    // The leg behind swings at the speed of the ground.
    double path = 0;
    for (int k = 1; k <= i; ++k) {
      path += 0.83 * std::abs(0.35 * (std::sin(2 * std::numbers::pi * k / 30) -
                                      std::sin(2 * std::numbers::pi * (k - 1) / 30)));
    }
    pose.root_translation = {0, -0.02, path};
    clip.motion.poses.push_back(pose);
    clip.motion.frame_ids.push_back(i);
  }
  return clip;
}

double travel(const MotionClip& clip) {
  return (clip.motion.poses.back().root_translation - clip.motion.poses.front().root_translation)
      .norm();
}

// The path of a BVH in another unit than its bones.
std::string with_path_times(const std::string& bvh, double factor) {
  const std::size_t begin = bvh.find('\n', bvh.find("Frame Time:")) + 1;
  std::istringstream rows(bvh.substr(begin));
  std::ostringstream text;
  text << bvh.substr(0, begin);
  for (std::string row; std::getline(rows, row);) {
    std::istringstream words(row);
    std::string word;
    for (int column = 0; words >> word; ++column) {
      text << (column > 0 ? " " : "");
      column < 3 ? text << factor * std::stod(word) : text << word;
    }
    text << "\n";
  }
  return text.str();
}

TEST(DoubtMotion, BvhWhosePathIsInAnotherUnit_IsDoubtedAndMendedByTheAdvice) {
  const fixtures::TemporaryDirectory folder;
  const MotionClip truth = walk();
  const std::string text = bvh_text(truth);
  for (const double factor : {0.01, 100.0}) {
    SCOPED_TRACE(factor);
    std::ofstream(folder / "walk.bvh") << with_path_times(text, factor);
    const MotionClip wrong = read_motion_file(folder / "walk.bvh");
    ASSERT_TRUE(has(wrong.findings, "motion-path-unit"));
    EXPECT_NEAR(travel(wrong), factor * travel(truth), 1e-2 * factor * travel(truth));
    MotionFileOptions options;
    options.motion.path_scale = 1 / factor;
    const auto said = std::find_if(wrong.findings.begin(), wrong.findings.end(),
                                   [](const auto& one) { return one.code == "motion-path-unit"; });
    EXPECT_THAT(said->advice,
                HasSubstr(factor < 1 ? "--motion.path-scale 100 " : "--motion.path-scale 0.01 "));
    const MotionClip mended = read_motion_file(folder / "walk.bvh", options);
    EXPECT_FALSE(has(mended.findings, "motion-path-unit"));
    EXPECT_NEAR(travel(mended), travel(truth), 1e-3);
    EXPECT_NEAR(mended.skeleton.offsets(0, 1) + mended.motion.poses[0].root_translation.y(), 0.95,
                1e-3);
  }
}

// Origins elsewhere than on the floor: steps alone say it.
TEST(DoubtMotion, PathTooShortForItsSteps_IsDoubtedWithoutAFloor) {
  MotionClip clip = walk();
  for (Pose& pose : clip.motion.poses) {
    pose.root_translation.y() -= 0.95;
  }
  EXPECT_FALSE(has(check_motion(clip), "motion-path-unit"));
  for (Pose& pose : clip.motion.poses) {
    pose.root_translation.z() /= 100;
  }
  EXPECT_TRUE(has(check_motion(clip), "motion-path-unit"));
}

TEST(DoubtMotion, PersonWhoWalksOnTheSpot_IsNotDoubted) {
  for (const double height : {0.0, -0.97}) {
    MotionClip clip = walk();
    for (std::size_t i = 0; i < clip.motion.poses.size(); ++i) {
      clip.motion.poses[i].root_translation =
          Eigen::Vector3d(0.01 * std::sin(0.2 * static_cast<double>(i)),
                          height + 0.015 * std::sin(0.42 * static_cast<double>(i)), 0);
    }
    EXPECT_FALSE(has(check_motion(clip), "motion-path-unit")) << height;
  }
}

TEST(DoubtMotion, RealMotions_HaveOneUnit) {
  const std::filesystem::path root = fixtures::test_data_root() / "mocap_bvh";
  if (!std::filesystem::is_directory(root)) {
    GTEST_SKIP() << "no test data at " << root;
  }
  for (const auto& file : std::filesystem::recursive_directory_iterator(root)) {
    if (file.path().extension() == ".bvh") {
      EXPECT_FALSE(has(read_motion_file(file.path()).findings, "motion-path-unit")) << file.path();
    }
  }
}

TEST(DoubtMotion, RealMotionsWithAPathInAnotherUnit_AreDoubted) {
  const std::filesystem::path root = fixtures::test_data_root() / "mocap_bvh";
  if (!std::filesystem::is_directory(root)) {
    GTEST_SKIP() << "no test data at " << root;
  }
  int tried = 0;
  int right = 0;
  for (const auto& file : std::filesystem::recursive_directory_iterator(root)) {
    if (file.path().extension() != ".bvh") {
      continue;
    }
    const MotionClip truth = read_motion_file(file.path());
    for (const double factor : {0.001, 0.01, 100.0}) {
      MotionClip clip = truth;
      for (Pose& pose : clip.motion.poses) {
        pose.root_translation *= factor;
      }
      ++tried;
      for (const Finding& finding : check_motion(clip)) {
        right += finding.code == "motion-path-unit" &&
                 finding.advice.find("--motion.path-scale " + short_number(1 / factor) + " ") !=
                     std::string::npos;
      }
    }
  }
  // Some stand as high by their offsets alone, or hardly go anywhere.
  EXPECT_GE(5 * right, 4 * tried) << right << " of " << tried;
}

TEST(DoubtMotion, BvhInRadians_IsDoubted) {
  const fixtures::TemporaryDirectory folder;
  write_bvh(folder / "degrees.bvh", person_clip());
  EXPECT_FALSE(has(read_motion_file(folder / "degrees.bvh").findings, "motion-radians"));
  MotionClip clip = person_clip();
  for (Pose& pose : clip.motion.poses) {
    pose.rotations *= std::numbers::pi / 180;  // small ones are their Euler angles
  }
  write_bvh(folder / "radians.bvh", clip);
  EXPECT_TRUE(has(read_motion_file(folder / "radians.bvh").findings, "motion-radians"));
}

}  // namespace
}  // namespace atelier
