// capture.toml and the schemas of keypoints: what is written reads back, what is malformed is
// refused.

#include <string>

#include <gtest/gtest.h>

#include "capture/capture_info.h"
#include "capture/keypoint_schema.h"
#include "core/error.h"
#include "tests/support/refusals.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

CaptureInfo two_sequences() {
  CaptureInfo info;
  info.subject = "a \"quoted\" name";
  info.sequences = {{"clothed", "clothed", 12, {0, 1, 2, 3}}, {"minimal", "minimal", 0.5, {4, 7}}};
  info.held_out_cameras = {"03"};
  info.held_out_frames = {3};
  info.synthetic = true;
  info.consent = {{"P. Doe", "research", "2030-12-31"}};
  return info;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(CaptureInfo, WrittenInfo_ReadsBackEqual) {
  const CaptureInfo info = two_sequences();
  const CaptureInfo back = parse_capture_toml(capture_toml(info));
  EXPECT_EQ(back.subject, info.subject);
  ASSERT_EQ(back.sequences.size(), 2U);
  EXPECT_EQ(back.sequences[1].frame_ids, info.sequences[1].frame_ids);
  EXPECT_EQ(back.sequences[1].fps, 0.5);
  EXPECT_EQ(back.held_out_cameras, info.held_out_cameras);
  EXPECT_EQ(back.held_out_frames, info.held_out_frames);
  EXPECT_EQ(back.consent, info.consent);
  EXPECT_TRUE(back.synthetic);
}

TEST(CaptureInfo, MalformedFile_IsRefused) {
  const std::string good = capture_toml(two_sequences());
  const auto refused = [&](const std::string& from, const std::string& to, const char* words) {
    ATELIER_EXPECT_REFUSED(parse_capture_toml(replaced(good, from, to), "capture.toml"), DataError,
                           words);
  };
  refused("units = \"m\"", "units = \"mm\"", "units");
  refused("up_axis = \"y\"", "up_axis = \"z\"", "up_axis");
  refused("version = 1", "version = 2", "version");
  refused("schema = \"atelier-capture\"", "schema = \"other\"", "schema");
  refused("fps = 12.0", "fps = 0.0", "fps");
  refused("kind = \"minimal\"", "kind = \"naked\"", "minimal or clothed");
  refused("[0,1,2,3]", "[0,2,1,3]", "frame id");
  refused("[4,7]", "[3,7]", "frame id");
  refused("[4,7]", "[]", "no frames");
  refused("held_out_frames = [3]", "held_out_frames = [99]", "held_out_frames");
  refused("name = \"clothed\"", "name = \"../up\"", "its name");
  refused("synthetic = true", "synthetic = true\nsecret = 1", "secret");
  refused("image_format = \"png\"", "image_format = \"exe\"", "png or jpg");
}

TEST(CaptureInfo, FolderWithoutInfo_IsNoFinishedCapture) {
  const fixtures::TemporaryDirectory folder;
  ATELIER_EXPECT_REFUSED(read_capture_info(folder.path()), DataError, "finished native capture");
}

TEST(KeypointSchema, Schemas_HaveTheirPointsAndMirrors) {
  EXPECT_EQ(body_25_schema().points.size(), 25U);
  EXPECT_EQ(coco_wholebody_schema().points.size(), 133U);
  for (const char* name : {"body_25", "coco_wholebody"}) {
    const KeypointSchema& schema = keypoint_schema(name);
    for (std::size_t i = 0; i < schema.points.size(); ++i) {
      const int mirror = schema.mirror[i];
      ASSERT_GE(mirror, 0) << schema.points[i];
      EXPECT_EQ(schema.mirror[static_cast<std::size_t>(mirror)], static_cast<int>(i));
    }
  }
  EXPECT_EQ(find_keypoint(body_25_schema(), "left_ankle"), 14);
  EXPECT_EQ(find_keypoint(coco_wholebody_schema(), "left_hand_root"), 91);
  ATELIER_EXPECT_REFUSED(keypoint_schema("body_26"), DataError, "body_25");
}

}  // namespace
}  // namespace atelier
