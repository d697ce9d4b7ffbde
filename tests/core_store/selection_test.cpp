#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/store/frame_selection.h"
#include "core/store/utc_time.h"

namespace atelier {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::vector<int> frames_of(const std::string& text) {
  FrameSelection selection;
  EXPECT_EQ(set_frames(selection, text), "");
  return selected_frames(selection, {0, 2, 4, 6, 8});
}

TEST(FrameSelection, FrameRange_SelectsFrames) {
  EXPECT_THAT(frames_of("2:6"), ElementsAre(2, 4));
  EXPECT_THAT(frames_of(":5"), ElementsAre(0, 2, 4));
  EXPECT_THAT(frames_of("5:"), ElementsAre(6, 8));
  EXPECT_THAT(frames_of("4"), ElementsAre(4));
  EXPECT_THAT(frames_of("100:200"), ElementsAre());
}

TEST(FrameSelection, Shards_PartitionTheRange) {
  const std::vector<int> all = {0, 2, 4, 6, 8, 10, 12};
  std::vector<int> seen;
  for (int i = 0; i < 3; ++i) {
    FrameSelection selection;
    ASSERT_EQ(set_frames(selection, "2:12"), "");
    ASSERT_EQ(set_shard(selection, std::to_string(i) + "/3"), "");
    for (const int frame_id : selected_frames(selection, all)) {
      seen.push_back(frame_id);
    }
  }
  EXPECT_THAT(seen, testing::UnorderedElementsAre(2, 4, 6, 8, 10));
}

TEST(FrameSelection, RangeWithoutFrames_IsRefusedUnlessInputIsEmpty) {
  FrameSelection selection;
  ASSERT_EQ(set_frames(selection, "4:7"), "");
  EXPECT_THAT(some_selected_frames(selection, {3, 5, 9}, "boxes"), ElementsAre(5));
  EXPECT_THAT(some_selected_frames(selection, {}, "boxes"), ElementsAre());
  try {
    some_selected_frames(selection, {8, 9}, "boxes");
    FAIL() << "it was taken";
  } catch (const DataError& error) {
    EXPECT_STREQ(error.what(),
                 "boxes: frames: '4:7'; expected a range that holds one of 2 frames, 8 to 9");
  }
}

TEST(FrameSelection, Shard_MayBeEmpty) {
  FrameSelection selection;
  ASSERT_EQ(set_shard(selection, "5/100000"), "");
  EXPECT_THAT(some_selected_frames(selection, {3, 5, 9}, "boxes"), ElementsAre());
  ASSERT_EQ(set_frames(selection, "4:5"), "");
  EXPECT_THROW(some_selected_frames(selection, {3, 5, 9}, "boxes"), DataError);
}

TEST(FrameSelection, Selection_IsFormattedAsText) {
  FrameSelection selection;
  EXPECT_TRUE(selection.everything());
  EXPECT_EQ(to_string(selection), "every frame");
  ASSERT_EQ(set_frames(selection, "3:"), "");
  EXPECT_EQ(to_string(selection), "--frames 3:");
  ASSERT_EQ(set_shard(selection, "1/4"), "");
  EXPECT_EQ(to_string(selection), "--frames 3: --shard 1/4");
  EXPECT_FALSE(selection.everything());
}

class BadFrames : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(All, BadFrames,
                         testing::Values("", ":", "a:b", "1:b", "3:3", "5:2", "-1:4", "1:-4",
                                         "1::2", "1:2:3", "1.5:2", " 1:2", "1:99999999999", "0x1:5",
                                         "--", "2147483647"));
TEST_P(BadFrames, WrongFramesText_IsRefused) {
  FrameSelection selection;
  EXPECT_THAT(set_frames(selection, GetParam()), HasSubstr("--frames cannot be '"));
  EXPECT_TRUE(selection.everything());
}

class BadShard : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(All, BadShard,
                         testing::Values("", "/", "1", "1/", "/2", "2/2", "3/2", "-1/2", "0/0",
                                         "0/-1", "a/b", "1/2/3", "0/100001", "1.0/2", " 0/1"));
TEST_P(BadShard, WrongShardText_IsRefused) {
  FrameSelection selection;
  EXPECT_THAT(set_shard(selection, GetParam()), HasSubstr("--shard cannot be '"));
  EXPECT_TRUE(selection.everything());
}

TEST(UtcTime, Timestamp_RoundTrips) {
  EXPECT_EQ(utc_text(0), "1970-01-01T00:00:00Z");
  for (const double seconds : {0.0, 951'782'400.0, 1'709'164'800.0, 4'102'444'799.0}) {
    EXPECT_EQ(seconds_of_utc(utc_text(seconds)), seconds);
  }
  EXPECT_EQ(utc_text(951'782'400), "2000-02-29T00:00:00Z");
}

TEST(UtcTime, OtherTimeFormats_AreRefused) {
  for (const char* text : {"", "2026-11-21", "2026-11-21T10:40:00", "2026-13-21T10:40:00Z",
                           "2026-02-30T10:40:00Z", "2026-11-21T24:00:00Z", "2026-11-21T10:60:00Z",
                           "2026-11-21 10:40:00Z", "2026-11-21T10:40:00+", "x026-11-21T10:40:00Z",
                           "2026-00-01T00:00:00Z", "2026-01-00T00:00:00Z"}) {
    EXPECT_FALSE(seconds_of_utc(text)) << text;
  }
}

}  // namespace
}  // namespace atelier
