#include "bodymodel/formats/motion_c3d.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/marker_fit.h"
#include "bodymodel/formats/motion_file.h"
#include "bodymodel/human/default_human.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/retarget/retarget.h"
#include "bodymodel/skinning.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "tests/support/places.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

std::filesystem::path corpus(const char* name) {
  return fixtures::source_directory() / "fuzz/corpus/c3d" / name;
}

TEST(C3d, LittleEndianReals_AreRead) {
  const MarkerClip clip = read_c3d(corpus("small.c3d"));
  EXPECT_EQ(clip.name, "small");
  EXPECT_THAT(clip.markers, ElementsAre("LFWT", "RFWT", "LKNE"));  // "*4" has no name
  EXPECT_EQ(clip.fps, 100);
  EXPECT_EQ(clip.metres_per_unit, 0.001);
  EXPECT_THAT(clip.frame_ids, ElementsAre(1, 2, 3));
  EXPECT_NEAR(clip.positions[2](2, 0), 0.2, 1e-9);
  EXPECT_NEAR(clip.positions[2](2, 1), 0.1, 1e-9);
  EXPECT_NEAR(clip.positions[2](2, 2), 0.98, 1e-9);
  EXPECT_THAT(clip.seen[1], ElementsAre(true, false, true));
  EXPECT_TRUE(clip.positions[1].row(1).isZero(0));
}

TEST(C3d, BigEndianIntegers_AreRead) {
  const MarkerClip clip = read_c3d(corpus("whole_big.c3d"));
  EXPECT_EQ(clip.metres_per_unit, 1);
  EXPECT_NEAR(clip.positions[1](2, 0), 200, 1e-4);
  EXPECT_NEAR(clip.positions[1](2, 1), 50, 1e-4);
  EXPECT_NEAR(clip.positions[1](2, 2), 980, 1e-4);
}

TEST(C3d, TruncatedFile_IsRefused) {
  std::vector<std::byte> bytes = read_file_bytes(corpus("small.c3d"), 1 << 20);
  bytes.resize(bytes.size() - 1);
  EXPECT_THAT([&] { read_c3d(bytes, "cut.c3d"); }, ThrowsMessage<DataError>(HasSubstr("cut.c3d")));
  EXPECT_THAT([] { read_c3d(std::span<const std::byte>(), "none.c3d"); },
              ThrowsMessage<DataError>(HasSubstr("none.c3d")));
}

// CMU 02_01, "walk", as it was recorded.
TEST(C3d, CmuWalk_MovesTheDefaultHuman) {
  ATELIER_TEST_FILE(path, "mocap_bvh/momentum_c3d/02_01.c3d");
  const MarkerFit fit = fit_markers(read_c3d(path));
  EXPECT_EQ(fit.used.size() + fit.unknown.size(), 41u);
  EXPECT_TRUE(fit.unknown.empty()) << fit.unknown[0];
  double mean = 0;
  for (const double rms : fit.rms) {
    mean += rms / static_cast<double>(fit.rms.size());
  }
  std::printf("%zu frames at %g per second, %.1f mm rms\n", fit.rms.size(), fit.clip.motion.fps,
              1e3 * mean);
  EXPECT_LT(mean, 0.01);
  // The band on this head sits low at the back.
  EXPECT_TRUE(std::any_of(fit.clip.findings.begin(), fit.clip.findings.end(),
                          [](const Finding& one) { return one.code == "motion-markers-head"; }));
  DefaultHumanOptions options = male_human();
  options.shape_basis = false;
  const BodyModel model = default_human(options);
  RetargetOptions retargeting;
  retargeting.fps = 30;
  const Retargeted moved = retarget(fit.clip, model, {}, retargeting);
  const std::vector<Pose>& poses = moved.motion.poses;
  Eigen::Vector3d way = poses.back().root_translation - poses.front().root_translation;
  way.y() = 0;
  const double seconds = static_cast<double>(poses.size() - 1) / 30;
  EXPECT_GT(way.norm() / seconds, 0.8);  // metres a second: a walk
  EXPECT_LT(way.norm() / seconds, 2);
  int left = 0;
  int right = 0;
  for (const auto& standing : moved.contacts) {
    left += standing[0] && !standing[1];
    right += standing[1] && !standing[0];
  }
  EXPECT_GT(left, 5);
  EXPECT_GT(right, 5);
  for (const Pose& pose : {poses.front(), poses[poses.size() / 2], poses.back()}) {
    const Points posed = skin_vertices(model, pose);
    EXPECT_NEAR(posed.col(1).minCoeff(), 0, 0.04);
    EXPECT_NEAR(posed.col(1).maxCoeff(), 1.72, 0.1);
  }
}

}  // namespace
}  // namespace atelier
