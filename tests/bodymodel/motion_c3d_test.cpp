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
#include "core/unknown_value.h"
#include "tests/bodymodel/c3d_writer.h"
#include "tests/bodymodel/synthetic_markers.h"
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
  EXPECT_THAT(clip.markers, ElementsAre("S:LFWT", "S:RFWT", "S:LKNE"));  // "*4" has none
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

bool has_finding(const std::vector<Finding>& findings, const std::string& code) {
  return std::any_of(findings.begin(), findings.end(),
                     [&](const Finding& one) { return one.code == code; });
}

// One marker that goes along x, 1 mm a frame.
MarkerClip long_trial(int frames) {
  MarkerClip clip;
  clip.fps = 200;
  clip.markers = {"LASI"};
  for (int i = 0; i < frames; ++i) {
    clip.frame_ids.push_back(i + 1);
    clip.positions.push_back(Points::Constant(1, 3, 0.001 * (i + 1)));
    clip.seen.push_back({true});
  }
  return clip;
}

MarkerClip written_c3d(const MarkerClip& clip, const fixtures::C3dWriteOptions& options = {}) {
  return read_c3d(fixtures::C3dWriter(options).file(clip), "a.c3d");
}

TEST(C3d, NumbersOfEveryProcessor_ReadAlike) {
  MarkerClip clip = fixtures::marked_person(fixtures::plug_in_gait_names()).clip;
  clip.seen[3][5] = false;
  for (const int processor : {84, 85, 86}) {
    for (const bool real : {true, false}) {
      SCOPED_TRACE(std::to_string(processor) + (real ? " real" : " whole"));
      fixtures::C3dWriteOptions options;
      options.processor = processor;
      options.real = real;
      const MarkerClip back = written_c3d(clip, options);
      EXPECT_EQ(back.markers, clip.markers);
      EXPECT_EQ(back.fps, 60);
      EXPECT_FALSE(back.seen[3][5]);
      ASSERT_EQ(back.positions.size(), clip.positions.size());
      EXPECT_LT((back.positions[20] - clip.positions[20]).cwiseAbs().maxCoeff(),
                real ? 1e-6 : 5.1e-5);
    }
  }
}

TEST(C3d, MoreThan255Names_AreRead) {
  MarkerClip clip = long_trial(2);
  clip.markers.clear();
  for (int i = 0; i < 270; ++i) {
    clip.markers.push_back("M" + std::to_string(i));
  }
  clip.positions.assign(2, Points::Ones(270, 3));
  clip.seen.assign(2, std::vector<bool>(270, true));
  EXPECT_EQ(written_c3d(clip).markers, clip.markers);
}

// Angles have names of joints in some laboratories.
TEST(C3d, ModelledOutputs_AreNoMarkers) {
  MarkerClip clip = fixtures::marked_person(fixtures::plug_in_gait_names()).clip;
  const auto markers = static_cast<Index>(clip.markers.size());
  clip.markers.insert(clip.markers.end(), {"LAnkle", "RAnkle", "LKneeAngles"});
  for (std::size_t f = 0; f < clip.positions.size(); ++f) {
    clip.positions[f].conservativeResize(markers + 3, 3);
    clip.positions[f].bottomRows(3).setConstant(0.02);  // degrees taken for millimetres
    clip.seen[f].insert(clip.seen[f].end(), 3, true);
  }
  fixtures::C3dWriteOptions options;
  options.angles = {"LAnkle", "RAnkle", "LKneeAngles"};
  const MarkerClip back = written_c3d(clip, options);
  EXPECT_EQ(back.markers, fixtures::plug_in_gait_names());
  EXPECT_TRUE(has_finding(back.findings, "motion-markers-outputs"));
  const MarkerFit fit = fit_markers(back);
  EXPECT_LT(*std::max_element(fit.rms.begin(), fit.rms.end()), 0.003);
}

TEST(C3d, NanCoordinates_AreUnseen) {
  MarkerClip clip = fixtures::marked_person(fixtures::plug_in_gait_names()).clip;
  clip.seen[4][7] = false;
  fixtures::C3dWriteOptions options;
  options.nan = true;
  const MarkerClip back = written_c3d(clip, options);
  EXPECT_EQ(back.seen, clip.seen);
  EXPECT_TRUE(back.positions[4].row(7).isZero(0));
}

TEST(C3d, MarkerAtExactlyZero_IsUnseenWhereItIsElsewhereLater) {
  MarkerClip clip = long_trial(3);
  clip.positions[1].setZero();
  const MarkerClip back = written_c3d(clip);
  EXPECT_EQ(back.seen, (std::vector<std::vector<bool>>{{true}, {false}, {true}}));
  EXPECT_TRUE(has_finding(back.findings, "motion-markers-zero"));
  clip.positions.assign(3, Points::Zero(1, 3));  // the origin that others are relative to
  EXPECT_EQ(written_c3d(clip).seen, (std::vector<std::vector<bool>>{{true}, {true}, {true}}));
}

TEST(C3d, MoreFramesThan16BitsHold_AreAllRead) {
  const MarkerClip clip = long_trial(70'000);
  using Numbers = fixtures::C3dWriteOptions::Numbers;
  const std::vector<std::vector<Numbers>> cases = {
      {{"TRIAL", "ACTUAL_START_FIELD", 2, {1, 0}}, {"TRIAL", "ACTUAL_END_FIELD", 2, {4464, 1}}},
      {{"POINT", "LONG_FRAMES", 4, {70'000}}},
      {{"POINT", "FRAMES", 4, {70'000}}},
      {{"POINT", "FRAMES", 2, {4464}}}};  // the file says how many there are
  for (const std::vector<Numbers>& numbers : cases) {
    SCOPED_TRACE(numbers[0].name);
    fixtures::C3dWriteOptions options;
    options.numbers = numbers;
    const MarkerClip back = written_c3d(clip, options);
    ASSERT_EQ(back.positions.size(), 70'000u);
    EXPECT_EQ(back.frame_ids.back(), 70'000);
    EXPECT_NEAR(back.positions.back()(0, 0), 70, 1e-4);
  }
}

TEST(C3d, FieldsOfAnotherTrial_GiveWayToTheHeader) {
  fixtures::C3dWriteOptions options;
  options.numbers = {{"TRIAL", "ACTUAL_START_FIELD", 2, {1, 0}},
                     {"TRIAL", "ACTUAL_END_FIELD", 2, {900, 0}}};
  EXPECT_EQ(written_c3d(long_trial(60), options).positions.size(), 60u);
}

TEST(C3d, LastOffsetWithSwappedBytes_DoesNotLeadIntoTheData) {
  const MarkerClip clip = fixtures::marked_person(fixtures::plug_in_gait_names()).clip;
  fixtures::C3dWriteOptions options;
  options.swap_last_offset = true;
  const MarkerClip back = written_c3d(clip, options);
  EXPECT_EQ(back.markers, clip.markers);
  EXPECT_TRUE(has_finding(back.findings, "c3d-parameters"));
}

TEST(C3d, RepeatedNames_AreNumberedAndReported) {
  MarkerClip clip = long_trial(2);
  clip.markers = {"RKNE", "RKNE"};
  clip.positions.assign(2, Points::Ones(2, 3));
  clip.seen.assign(2, {true, true});
  const MarkerClip back = written_c3d(clip);
  EXPECT_THAT(back.markers, ElementsAre("RKNE", "RKNE_2"));
  EXPECT_TRUE(has_finding(back.findings, "motion-markers-names"));
}

TEST(C3d, UnitsInOtherSpellings_AreUnderstood) {
  for (const char* unit : {"M", "meters", "Metre", "[m]", "mete"}) {
    fixtures::C3dWriteOptions options;
    options.unit = unit;
    EXPECT_EQ(written_c3d(long_trial(2), options).metres_per_unit, 1) << unit;
  }
}

// Two people of one recording, and a thing that one of them carries.
MarkerClip two_subjects(const char* second) {
  MarkerClip clip = fixtures::marked_person(fixtures::plug_in_gait_names()).clip;
  const std::size_t count = clip.markers.size();
  const bool person = std::string(second) != "Ball";
  for (std::size_t m = 0; m < count; ++m) {
    const std::string name = clip.markers[m];
    clip.markers[m] = "Ada:" + name;
    clip.markers.push_back(std::string(second) + ":" + (person ? name : std::to_string(m)));
  }
  for (std::size_t f = 0; f < clip.positions.size(); ++f) {
    Points both(static_cast<Index>(2 * count), 3);
    both << clip.positions[f], clip.positions[f].rowwise() + Eigen::RowVector3d(1.5, 0, 0);
    clip.positions[f] = both;
    clip.seen[f].assign(2 * count, true);
  }
  return clip;
}

TEST(C3d, TwoPeople_AreRefusedUnlessOneIsChosen) {
  const MarkerClip both = written_c3d(two_subjects("Ben"));
  EXPECT_THAT([&] { fit_markers(both); },
              ThrowsMessage<DataError>(
                  ::testing::AllOf(HasSubstr("Ada, Ben"), HasSubstr("--markers.subject 'Ada'"))));
  const MotionClip alone =
      fit_markers(fixtures::marked_person(fixtures::plug_in_gait_names()).clip).clip;
  MarkerFitOptions options;
  for (const char* subject : {"Ada", "Ben"}) {
    options.subject = subject;
    const MotionClip one = fit_markers(both, {}, options).clip;
    const double x =
        one.motion.poses[9].root_translation.x() - alone.motion.poses[9].root_translation.x();
    EXPECT_NEAR(x, std::string(subject) == "Ben" ? 1.5 : 0, 1e-3);
    EXPECT_LT((one.motion.poses[9].rotations - alone.motion.poses[9].rotations).norm(), 1e-2);
  }
  options.subject = "Eve";
  EXPECT_THAT([&] { fit_markers(both, {}, options); },
              ThrowsMessage<UnknownValue>(HasSubstr("subject: 'Eve'; expected one of ")));
}

TEST(C3d, SubjectThatIsNoPerson_IsLeftOut) {
  const MarkerFit fit = fit_markers(written_c3d(two_subjects("Ball")));
  EXPECT_EQ(fit.used.size(), fixtures::plug_in_gait_names().size());
  EXPECT_TRUE(fit.unknown.empty());
  EXPECT_TRUE(has_finding(fit.clip.findings, "motion-subjects"));
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
