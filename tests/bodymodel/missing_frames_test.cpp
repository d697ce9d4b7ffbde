#include "bodymodel/missing_frames.h"

#include <algorithm>
#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/motion_bvh.h"
#include "bodymodel/formats/motion_file.h"
#include "bodymodel/formats/motion_trc.h"
#include "core/error.h"
#include "tests/bodymodel/synthetic_markers.h"
#include "tests/bodymodel/synthetic_person.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const Finding* finding_in(const std::vector<Finding>& findings, const std::string& code) {
  const auto found = std::find_if(findings.begin(), findings.end(),
                                  [&](const Finding& finding) { return finding.code == code; });
  return found == findings.end() ? nullptr : &*found;
}

TEST(MissingFrames, Gaps_AreFilledBetweenTheirNeighbours) {
  MotionClip clip = fixtures::person_clip();
  clip.motion.frame_ids = {3, 4, 8, 9, 10};
  fill_missing_frames(clip, "a.trc");
  const Motion& whole = clip.motion;
  EXPECT_EQ(whole.frame_ids, (std::vector<int>{3, 4, 5, 6, 7, 8, 9, 10}));
  EXPECT_EQ(whole.fps, 30);
  ASSERT_EQ(whole.poses.size(), 8U);
  EXPECT_NEAR(whole.poses[3].root_translation.z(), 0.03, 1e-12);  // half-way from 0.02 to 0.04
  EXPECT_NEAR(whole.poses[3].rotations(6, 0), 0.15, 1e-12);
  const Finding* said = finding_in(clip.findings, "motion-gaps");
  ASSERT_NE(said, nullptr);
  EXPECT_THAT(said->what,
              HasSubstr("3 frames missing beside 5 that are there, first frames 5 to 7"));
}

TEST(MissingFrames, NumbersOfOneStep_DivideTheRate) {
  MotionClip clip = fixtures::person_clip();
  clip.motion.frame_ids = {10, 15, 20, 25, 30};
  fill_missing_frames(clip, "a.amc");
  EXPECT_EQ(clip.motion.poses.size(), 5U);
  EXPECT_EQ(clip.motion.fps, 6);
  EXPECT_EQ(clip.motion.frame_ids.back(), 14);
}

TEST(MissingFrames, MotionWithoutGaps_StaysTheSame) {
  MotionClip clip = fixtures::person_clip();
  fill_missing_frames(clip, "a.bvh");
  EXPECT_EQ(clip.motion.frame_ids, fixtures::person_clip().motion.frame_ids);
  EXPECT_TRUE(clip.findings.empty());
}

TEST(MissingFrames, HoursThatAreMissing_AreRefused) {
  MotionClip clip = fixtures::person_clip();
  clip.motion.frame_ids = {0, 1, 2, 3, 1'000'000};
  EXPECT_THAT([&] { fill_missing_frames(clip, "a.trc"); },
              ThrowsMessage<DataError>(
                  AllOf(HasSubstr("frames 4 to 999999 missing"), HasSubstr("cut it there"))));
}

TEST(MissingFrames, WrittenBvh_KeepsTheTime) {
  MotionClip clip = fixtures::person_clip();
  clip.motion.frame_ids = {0, 1, 2, 6, 7};
  const std::string text = bvh_text(clip);
  EXPECT_THAT(text, HasSubstr("Frames: 8\n"));
}

// A recording of 30 frames at 60 a second without rows 11 to 20, as TRC.
struct GappedTrc {
  fixtures::MarkedPerson person = fixtures::marked_person(fixtures::joint_centre_names());
  std::string text = trc_text(person.clip);

  // The text with rows left out and, told by `number`, other numbers and times for rows.
  std::string without_rows(bool renumbered) const {
    std::istringstream lines(text);
    std::string result;
    int row = 0;
    int kept = 0;
    for (std::string line; std::getline(lines, line);) {
      const bool is_row = !line.empty() && line[0] >= '1' && line[0] <= '9' && ++header > 1;
      if (!is_row) {
        result += line + "\n";
        continue;
      }
      if (++row > 10 && row <= 20) {
        continue;
      }
      ++kept;
      result += renumbered ? std::to_string(kept) + line.substr(line.find('\t')) : line;
      result += "\n";
    }
    const std::string counts = "\t30\t";
    result.replace(result.find(counts), counts.size(), "\t20\t");
    return result;
  }

  mutable int header = 0;  // lines that begin with a number: the header's values first
};

TEST(MissingFrames, TrcWithoutSomeRows_KeepsItsTimeAsAMotion) {
  const fixtures::TemporaryDirectory folder;
  std::ofstream(folder / "whole.trc") << GappedTrc().text;
  const MotionClip whole = read_motion_file(folder / "whole.trc");
  EXPECT_EQ(finding_in(whole.findings, "motion-gaps"), nullptr);
  ASSERT_EQ(whole.motion.poses.size(), 30U);
  for (const bool renumbered : {false, true}) {
    SCOPED_TRACE(renumbered);
    std::ofstream(folder / "gap.trc") << GappedTrc().without_rows(renumbered);
    const MotionClip gap = read_motion_file(folder / "gap.trc");
    ASSERT_EQ(gap.motion.poses.size(), 30U);
    EXPECT_NEAR(gap.motion.fps, 60, 1e-9);
    const Finding* said = finding_in(gap.findings, "motion-gaps");
    ASSERT_NE(said, nullptr);
    EXPECT_THAT(said->what, HasSubstr("10 frames missing beside 20"));
    for (const std::size_t frame : {0UL, 9UL, 20UL, 29UL}) {
      EXPECT_LT(
          (gap.motion.poses[frame].root_translation - whole.motion.poses[frame].root_translation)
              .norm(),
          0.03);
    }
    write_motion_file(folder / "gap.bvh", gap);
    EXPECT_EQ(read_bvh(folder / "gap.bvh").motion.poses.size(), 30U);
  }
}

TEST(MissingFrames, TrcOfEveryOtherFrame_IsAtHalfTheRate) {
  MarkerClip clip = fixtures::marked_person(fixtures::joint_centre_names()).clip;
  for (std::size_t i = 0; i < clip.frame_ids.size(); ++i) {
    clip.frame_ids[i] = static_cast<int>(2 * i) + 1;
  }
  const std::string text = trc_text(clip);  // times go on by 2/60 s
  const MarkerClip back = read_trc(std::as_bytes(std::span(text)), "a.trc");
  EXPECT_NEAR(back.fps, 30, 1e-9);
  EXPECT_EQ(back.frame_ids.back(), 30);
}

}  // namespace
}  // namespace atelier
