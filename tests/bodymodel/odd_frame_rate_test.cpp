#include "bodymodel/odd_frame_rate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/motion_file.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/text_scanner.h"
#include "tests/bodymodel/c3d_writer.h"
#include "tests/bodymodel/synthetic_markers.h"
#include "tests/bodymodel/synthetic_person.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const Finding* odd_rate_of(const MotionClip& clip) {
  for (const Finding& finding : clip.findings) {
    if (finding.code == "fps-odd") {
      return &finding;
    }
  }
  return nullptr;
}

TEST(OddFrameRate, RatesOfRecordings_AreNotDoubted) {
  for (const double fps : {1.0, 12.0, 23.976, 29.97, 30.0, 120.0, 1000.0}) {
    EXPECT_FALSE(odd_frame_rate(fps, RateStated::Rate, "a")) << fps;
    EXPECT_FALSE(odd_frame_rate(fps, RateStated::Time, "a")) << fps;
  }
}

TEST(OddFrameRate, LikelyCause_IsSaidWithTheSetting) {
  const auto said = [](double fps, RateStated stated) {
    const auto finding = odd_frame_rate(fps, stated, "a");
    return finding ? to_string(*finding) : "";
  };
  EXPECT_THAT(said(1 / 33.3, RateStated::Time),
              AllOf(HasSubstr("milliseconds"), HasSubstr("--motion.fps 30 ")));
  EXPECT_THAT(said(1 / 8.333, RateStated::Time), HasSubstr("--motion.fps 120 "));
  EXPECT_THAT(
      said(1 / 60.0, RateStated::Time),
      AllOf(HasSubstr("frames a second in the place of a time"), HasSubstr("--motion.fps 60 ")));
  EXPECT_THAT(said(1 / 29.97, RateStated::Rate),
              AllOf(HasSubstr("seconds of a frame"), HasSubstr("--motion.fps 30 ")));
  EXPECT_THAT(said(33333, RateStated::Rate), HasSubstr("--motion.fps 30 "));
  EXPECT_THAT(said(120000 / 2.0, RateStated::Rate), HasSubstr("--motion.fps 60 "));
  EXPECT_THAT(said(0.777, RateStated::Rate), HasSubstr("--motion.fps RATE"));
  EXPECT_THAT(said(1 / 33.3, RateStated::Keys), HasSubstr("times in seconds"));
}

TEST(OddFrameRate, RateThatNoMotionHas_IsRefusedWithTheReason) {
  for (const double fps : {1e-12, 0.001, 2e5, 1e300}) {
    EXPECT_THAT([&] { odd_frame_rate(fps, RateStated::Rate, "a.npz"); },
                ThrowsMessage<DataError>(AllOf(HasSubstr("a.npz"),
                                               HasSubstr("0.01 to 100,000 frames a second"),
                                               HasSubstr("--motion.fps"))))
        << fps;
  }
}

// Every reader of motions, and the option that sets the rate.
TEST(OddFrameRate, FilesOfEveryFormat_AreDoubted) {
  const fixtures::TemporaryDirectory folder;
  MotionClip clip = fixtures::person_clip();
  while (clip.motion.poses.size() < 10) {
    clip.motion.poses.push_back(clip.motion.poses.back());
    clip.motion.frame_ids.push_back(clip.motion.frame_ids.back() + 1);
  }
  MotionFileOptions set;
  set.motion.fps = 30;
  const auto expect_doubt = [&](const std::string& name) {
    SCOPED_TRACE(name);
    const MotionClip read = read_motion_file(folder / name);
    ASSERT_NE(odd_rate_of(read), nullptr);
    EXPECT_THAT(odd_rate_of(read)->what, HasSubstr("0.03"));
  };
  clip.motion.fps = 1 / 33.3;
  for (const char* name : {"a.bvh", "a.npz", "a.glb"}) {
    write_motion_file(folder / name, clip);
    expect_doubt(name);
  }
  for (const char* name : {"a.bvh", "a.npz"}) {
    const MotionClip read = read_motion_file(folder / name, set);
    EXPECT_EQ(odd_rate_of(read), nullptr) << name;
    EXPECT_EQ(read.motion.fps, 30) << name;
  }
  clip.motion.fps = 1e-12;
  write_motion_file(folder / "slow.npz", clip);
  EXPECT_THAT([&] { read_motion_file(folder / "slow.npz"); },
              ThrowsMessage<DataError>(HasSubstr("1e-12 frames a second")));
  EXPECT_EQ(read_motion_file(folder / "slow.npz", set).motion.fps, 30);
  MarkerClip markers = fixtures::marked_person(fixtures::joint_centre_names(), 0, 0, 4).clip;
  markers.fps = 0.03;
  write_file_atomically(folder / "a.trc", fixtures::trc_text(markers));
  expect_doubt("a.trc");
  fixtures::C3dWriter writer({});
  write_file_atomically(folder / "a.c3d", as_text(writer.file(markers)));
  expect_doubt("a.c3d");
}

}  // namespace
}  // namespace atelier
