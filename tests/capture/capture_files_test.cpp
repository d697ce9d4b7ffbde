// capture.toml, cameras.json, truth: what is written reads back, what is malformed is refused.

#include <string>

#include <gtest/gtest.h>

#include "capture/capture_info.h"
#include "capture/dome.h"
#include "capture/keypoint_schema.h"
#include "core/error.h"
#include "core/io/cameras_file.h"
#include "core/io/ground_truth_archive.h"
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

TEST(CamerasFile, WrittenCameras_ReadBackBitExact) {
  const std::vector<Camera> cameras = dome_cameras({.cameras = 6, .pairs = false}, {1, 1});
  const std::vector<Camera> back = parse_cameras_json(cameras_json(cameras));
  ASSERT_EQ(back.size(), cameras.size());
  for (std::size_t i = 0; i < back.size(); ++i) {
    EXPECT_EQ(back[i].id, cameras[i].id);
    EXPECT_EQ(back[i].fx, cameras[i].fx);
    EXPECT_EQ(back[i].distortion, cameras[i].distortion);
    EXPECT_EQ(back[i].camera_from_world_rotation, cameras[i].camera_from_world_rotation);
    EXPECT_EQ(back[i].camera_from_world_translation, cameras[i].camera_from_world_translation);
    EXPECT_EQ(back[i].gain, cameras[i].gain);
  }
}

TEST(CamerasFile, MalformedFile_IsRefused) {
  const std::string good =
      cameras_json(dome_cameras({.cameras = 2, .pairs = false, .jitter = 0}, {1, 1}));
  const auto refused = [&](const std::string& from, const std::string& to, const char* words) {
    ATELIER_EXPECT_REFUSED(parse_cameras_json(replaced(good, from, to), "cameras.json"), DataError,
                           words);
  };
  refused("\"pixel_origin\": \"corner\"", "\"pixel_origin\": \"centre\"", "pixel_origin");
  refused("\"id\": \"01\"", "\"id\": \"00\"", "each id once");
  refused("\"id\": \"01\"", "\"id\": \"a/b\"", "letters");
  refused("\"brown\"", "\"polynomial\"", "brown");
  refused("\"width\": 800", "\"width\": 0", "width");
  refused("\"fx\":", "\"f\":", "fx");
  ATELIER_EXPECT_REFUSED(parse_cameras_json("[]", "cameras.json"), DataError, "cameras.json");
  ATELIER_EXPECT_REFUSED(cameras_json({}), DataError, "at least one camera");
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

GroundTruth small_truth() {
  GroundTruth truth;
  truth.cameras = dome_cameras({.cameras = 2, .pairs = false}, {1, 1});
  truth.skeleton.names = {"pelvis", "head"};
  truth.skeleton.parents = {-1, 0};
  truth.skeleton.offsets = Points::Constant(2, 3, 0.5);
  truth.body.vertices = Points::Random(4, 3);
  truth.body.faces.resize(2, 3);
  truth.body.faces << 0, 1, 2, 0, 2, 3;
  truth.shape_names = {"stature"};
  truth.shape = Eigen::VectorXd::Constant(1, 1.7);
  truth.keypoint_names = {"nose"};
  GroundTruthGarment garment;
  garment.garment.name = "dress";
  garment.garment.mesh = truth.body;
  garment.garment.rest = Points2::Random(6, 2);
  garment.garment.rest_faces = truth.body.faces;
  garment.seams = {{"side", {0, 1}, {4, 5}}};
  garment.label = Label::Dress;
  truth.garments = {garment};
  truth.lights = {AreaLight{}};
  truth.numbers = {{"seed", 7}};
  truth.texts = {{"motion", "spin"}};
  return truth;
}

TEST(GroundTruthArchive, ReadsBackWhatItWrote) {
  const GroundTruth truth = small_truth();
  const GroundTruth back = truth_of(archive_of(truth));
  EXPECT_EQ(back.cameras.size(), 2U);
  EXPECT_EQ(back.cameras[1].gain, truth.cameras[1].gain);
  EXPECT_EQ(back.skeleton.names, truth.skeleton.names);
  EXPECT_EQ(back.body.vertices, truth.body.vertices);
  EXPECT_EQ(back.shape, truth.shape);
  ASSERT_EQ(back.garments.size(), 1U);
  EXPECT_EQ(back.garments[0].label, Label::Dress);
  EXPECT_EQ(back.garments[0].garment.rest, truth.garments[0].garment.rest);
  EXPECT_EQ(back.garments[0].seams[0].b, truth.garments[0].seams[0].b);
  EXPECT_EQ(back.garments[0].garment.material.bending, truth.garments[0].garment.material.bending);
  EXPECT_EQ(back.lights.size(), 1U);
  EXPECT_EQ(back.numbers.at("seed"), 7);
  EXPECT_EQ(back.texts.at("motion"), "spin");

  GroundTruthFrame frame;
  frame.frame_id = 12;
  frame.joints = Points::Random(2, 3);
  frame.pose.rotations = Points::Random(2, 3);
  frame.keypoints = Points::Random(1, 3);
  frame.body = Points::Random(4, 3);
  frame.garments = {Points::Random(4, 3)};
  frame.body_seen = ByteImage(4, 2, 1, 1);
  frame.garments_seen = {ByteImage(4, 2, 1, 0)};
  const GroundTruthFrame again = ground_truth_frame_of(archive_of(frame, truth), truth);
  EXPECT_EQ(again.frame_id, 12);
  EXPECT_EQ(again.joints, frame.joints);
  EXPECT_EQ(again.pose.rotations, frame.pose.rotations);
  EXPECT_EQ(again.garments[0], frame.garments[0]);
  EXPECT_EQ(again.body_seen.data, frame.body_seen.data);
}

TEST(GroundTruthArchive, RefusesWhatDoesNotFit) {
  const GroundTruth truth = small_truth();
  Archive broken = archive_of(truth);
  broken.texts.erase("cameras");
  ATELIER_EXPECT_REFUSED(truth_of(broken), DataError, "cameras");
  broken = archive_of(truth);
  broken.datasets["garments/dress/pattern/seams"] = tensor_of(std::vector<int>{0, 0, 99}, {1, 3});
  ATELIER_EXPECT_REFUSED(truth_of(broken), DataError, "seams");
  broken = archive_of(truth);
  broken.datasets["garments/dress/material/values"] = tensor_of(std::vector<double>{1, 2});
  ATELIER_EXPECT_REFUSED(truth_of(broken), DataError, "8 numbers");
  broken = archive_of(truth);
  broken.datasets["skeleton/parents"] = tensor_of(std::vector<int>{-1, 5});
  EXPECT_THROW(truth_of(broken), DataError);
  GroundTruthFrame frame;
  frame.keypoints = Points::Random(1, 3);
  frame.body = Points::Random(4, 3);
  frame.garments = {Points(0, 3)};
  Archive other = archive_of(frame, truth);
  other.datasets["body"] = tensor_of(Points(Points::Random(9, 3)));
  ATELIER_EXPECT_REFUSED(ground_truth_frame_of(other, truth), DataError, "9 rows");
  other = archive_of(frame, truth);
  other.numbers["frame_id"] = -3;
  ATELIER_EXPECT_REFUSED(ground_truth_frame_of(other, truth), DataError, "frame_id");
}

}  // namespace
}  // namespace atelier
