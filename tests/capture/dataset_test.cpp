// What open_dataset settles for all layouts: world, sizes, names, frame rates, broken parts.

#include <algorithm>

#include <gtest/gtest.h>

#include "capture/frame_reader.h"
#include "capture/layouts/frame_files.h"
#include "capture/layouts/open_dataset.h"
#include "capture/layouts/write_layout.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/unknown_value.h"
#include "tests/capture/in_schema.h"
#include "tests/capture/small_capture.h"
#include "tests/support/refusals.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

const Finding* find_finding(const Dataset& dataset, const std::string& code) {
  const auto found = std::find_if(dataset.findings.begin(), dataset.findings.end(),
                                  [&](const Finding& finding) { return finding.code == code; });
  return found == dataset.findings.end() ? nullptr : &*found;
}

class Datasets : public ::testing::Test {
 protected:
  void SetUp() override { fixtures::write_small_capture(capture(), small_); }

  fs::path capture() const { return folder_ / "capture"; }
  /// The capture in another layout.
  fs::path in(const std::string& layout) const {
    return write_layout(capture(), layout, folder_ / layout).folders.front();
  }
  static void replace(const fs::path& file, const std::string& from, const std::string& to) {
    std::string text = read_file_text(file, 1 << 24);
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    write_file_atomically(file, text.replace(at, from.size(), to));
  }

  fixtures::TemporaryDirectory folder_;
  fixtures::SmallCapture small_;
};

TEST_F(Datasets, NativeCapture_OpensWithAllItsFacts) {
  const Dataset dataset = open_dataset(capture());
  EXPECT_EQ(dataset.layout, "native");
  EXPECT_EQ(dataset.info.subject, "somebody");
  DatasetOptions options;
  options.subject = "somebody";
  EXPECT_EQ(open_dataset(capture(), options).info.subject, "somebody");
  options.subject = "nosuch";
  ATELIER_EXPECT_REFUSED(open_dataset(capture(), options), DataError, "'nosuch'");
  EXPECT_EQ(dataset.info.sequences.front().fps, 12);
  EXPECT_EQ(frame_ids(dataset), (std::vector<int>{3, 4}));
  EXPECT_EQ(dataset.frames[0].image_width, 64);
  EXPECT_EQ(camera_index(dataset, "01"), 1);
  EXPECT_EQ(camera_index(dataset, "nobody"), -1);
  EXPECT_TRUE(dataset.findings.empty());
}

TEST_F(Datasets, FolderAboveCapture_IsRefusedWithHint) {
  const std::string words = "did you mean " + capture().string() + "?";
  ATELIER_EXPECT_REFUSED(open_dataset(folder_.path()), DataError, words);
  ATELIER_EXPECT_REFUSED(require_no_folder_above(folder_.path()), DataError, words);
  EXPECT_NO_THROW(require_no_folder_above(capture()));
  EXPECT_NO_THROW(require_no_folder_above(capture() / "images"));  // whatever that is
  EXPECT_NO_THROW(require_no_folder_above(folder_ / "nothing"));
}

TEST_F(Datasets, UnitAndUpOption_OverrideTheLayout) {
  const fs::path folder = in("colmap");
  DatasetOptions options;
  const Dataset plain = open_dataset(folder, options);
  ASSERT_NE(find_finding(plain, "unit-unknown"), nullptr);
  ASSERT_NE(find_finding(plain, "up-unknown"), nullptr);
  options.metres_per_unit = 0.01;
  options.up = "z";
  const Dataset dataset = open_dataset(folder, options);
  EXPECT_EQ(find_finding(dataset, "unit-unknown"), nullptr);
  const Eigen::Vector3d c = camera_center(plain.cameras[0]);
  EXPECT_LT(
      (camera_center(dataset.cameras[0]) - 0.01 * Eigen::Vector3d(c.x(), c.z(), -c.y())).norm(),
      1e-12);
}

TEST_F(Datasets, HalfSizeImages_ScaleTheirCameras) {
  const fs::path folder = in("easymocap");
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder / "images")) {
    if (entry.is_regular_file()) {
      fs::remove(entry.path());
      write_image(entry.path(), ByteImage(32, 40, 3));
    }
  }
  const Dataset dataset = open_dataset(folder);
  ASSERT_NE(find_finding(dataset, "image-scale"), nullptr);
  EXPECT_EQ(dataset.cameras[0].width, 32);
  EXPECT_NEAR(dataset.cameras[0].fx, 0.5 * small_.cameras[0].fx, 1e-12);
  EXPECT_NEAR(dataset.cameras[0].cx, 0.5 * small_.cameras[0].cx, 1e-12);
}

TEST_F(Datasets, PrincipalPoint_TellsFullSizeWhereLayoutDoesNot) {
  small_.cameras[0].cx = 30.5;
  fs::remove_all(capture());
  fixtures::write_small_capture(capture(), small_);
  const fs::path folder = in("mvhumannet");
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder / "images")) {
    if (entry.is_regular_file()) {
      fs::remove(entry.path());
      write_image(entry.path(), ByteImage(32, 40, 3));
    }
  }
  const Dataset dataset = open_dataset(folder);
  EXPECT_NEAR(dataset.cameras[0].cx, 15.25, 1e-12);
  ASSERT_NE(find_finding(dataset, "image-scale"), nullptr);
}

TEST_F(Datasets, ImagesOfOtherAspect_GiveAFinding) {
  const fs::path folder = in("easymocap");
  const fs::path picture = folder / "images" / "01" / "000000.png";
  fs::remove(picture);
  write_image(picture, ByteImage(60, 80, 3));
  const Dataset dataset = open_dataset(folder);
  const Finding* finding = find_finding(dataset, "image-size");
  ASSERT_NE(finding, nullptr);
  EXPECT_EQ(finding->place, "01");
  EXPECT_NE(finding->what.find("64 x 80, images are 60 x 80"), std::string::npos);
  EXPECT_NE(finding->what.find("4 px"), std::string::npos);
}

TEST_F(Datasets, BadCamera_IsLeftOutWithAnError) {
  const fs::path folder = in("avatarrex");
  const fs::path file = folder / "calibration_full.json";
  const std::string text = read_file_text(file, 1 << 20);
  // The last camera's first K number: a negative focal length.
  const std::size_t at = text.rfind("\"K\": [") + 6;
  std::string broken = text;
  broken.insert(broken.find_first_of("0123456789", at), "-");
  write_file_atomically(file, broken);
  const Dataset dataset = open_dataset(folder);
  EXPECT_EQ(dataset.cameras.size(), 2U);
  const Finding* finding = find_finding(dataset, "camera-left-out");
  ASSERT_NE(finding, nullptr);
  EXPECT_EQ(finding->place, "02");
  EXPECT_EQ(finding->severity, Severity::Error);
}

TEST_F(Datasets, RoundedRotation_IsOrthonormalized) {
  const fs::path folder = in("human36m");
  const fs::path file = folder / "camera-parameters.json";
  std::string text = read_file_text(file, 1 << 20);
  const std::size_t at = text.find("\"R\": [");
  const std::size_t point = text.find('.', at);
  // Three digits of the first number stay.
  const std::size_t end = text.find_first_not_of("0123456789", point + 1);
  text.erase(point + 4, end - point - 4);
  write_file_atomically(file, text);
  const Dataset dataset = open_dataset(folder);
  ASSERT_NE(find_finding(dataset, "camera-rotation"), nullptr);
  EXPECT_EQ(dataset.cameras.size(), 3U);
}

TEST_F(Datasets, BrokenImage_LeavesTheRestReadable) {
  const fs::path folder = in("easymocap");
  const fs::path picture = folder / "images" / "00" / "000000.png";
  EXPECT_EQ(fs::hard_link_count(picture), 1) << "the capture's own is another file";
  EXPECT_EQ(fs::status(picture).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  write_file_atomically(picture, "no image");
  const Dataset dataset = open_dataset(folder);
  EXPECT_EQ(find_finding(dataset, "image-broken"), nullptr) << "the next one tells the size";
  EXPECT_GT(dataset.frames[0].image_width, 0);
  FrameReader reader(dataset);
  EXPECT_THROW(reader.byte_image(0, 0), DataError);
  EXPECT_TRUE(reader.byte_image(0, 1).has_value());
  EXPECT_FALSE(reader.byte_image(0, 7).has_value());
  for (const auto& entry : fs::directory_iterator(folder / "images" / "00")) {
    write_file_atomically(entry.path(), "no image");
  }
  EXPECT_NE(find_finding(open_dataset(folder), "image-broken"), nullptr);
}

TEST_F(Datasets, CameraNames_AreMatchedByNumberThenOrder) {
  const MatchedNames number =
      matched_names({"1", "02", "Camera_B3"}, {"cam_01", "cam_2_json", "x3"});
  EXPECT_EQ(number.names, (std::vector<std::string>{"cam_01", "cam_2_json", "x3"}));
  EXPECT_TRUE(number.by_number);
  EXPECT_FALSE(number.by_order);
  const MatchedNames order = matched_names({"left", "right"}, {"b", "a"});
  EXPECT_EQ(order.names, (std::vector<std::string>{"a", "b"}));
  EXPECT_TRUE(order.by_order);
  const MatchedNames some = matched_names({"left", "right"}, {"left"});
  EXPECT_EQ(some.names, (std::vector<std::string>{"left", ""}));
}

TEST_F(Datasets, FrameNumber_IsTheLastNumberInTheName) {
  EXPECT_EQ(frame_number("cam01.0081.json"), 81);
  EXPECT_EQ(frame_number("000012_keypoints.json"), 12);
  EXPECT_EQ(frame_number("a/Cam001_rgb000003.jpg"), 3);
  EXPECT_EQ(frame_number("nothing.png"), std::nullopt);
  EXPECT_EQ(frame_number("1234567890.png"), std::nullopt);
}

TEST_F(Datasets, TwoImagesOfOneFrame_AreRefused) {
  fs::copy(capture() / "images/00/000003.png", capture() / "images/00/3.png");
  ATELIER_EXPECT_REFUSED(open_dataset(capture()), DataError, "a second image of frame 3");
}

TEST_F(Datasets, PathOutOfTheFolder_IsRefused) {
  for (const char* name : {"../x.png", "/etc/passwd", "a/../../b.png", "", "a//..//b"}) {
    ATELIER_EXPECT_REFUSED(path_under("root", name, "images.txt", "image 1"), DataError,
                           "without '..'");
  }
  const fs::path folder = in("colmap");
  replace(folder / "sparse/0/images.txt", "00/000003.png", "../000003.png");
  ATELIER_EXPECT_REFUSED(open_dataset(folder), DataError, "without '..'");
}

TEST_F(Datasets, UnknownFolder_IsRefusedListingLayouts) {
  fs::create_directory(folder_ / "empty");
  ATELIER_EXPECT_REFUSED(open_dataset(folder_ / "empty"), DataError, "easymocap, goliath");
  ATELIER_EXPECT_REFUSED(open_dataset(folder_ / "nowhere"), DataError, "nothing is there");
}

TEST_F(Datasets, AmbiguousLayout_GivesAFinding) {
  const fs::path folder = in("colmap");
  fs::copy(in("easymocap") / "intri.yml", folder / "intri.yml");
  fs::copy(folder_ / "easymocap" / "clothed" / "extri.yml", folder / "extri.yml");
  const Dataset dataset = open_dataset(folder);
  EXPECT_EQ(dataset.layout, "easymocap");
  const Finding* finding = find_finding(dataset, "layout-ambiguous");
  ASSERT_NE(finding, nullptr);
  EXPECT_NE(finding->setting.find("--capture.layout colmap"), std::string::npos);
  DatasetOptions options;
  options.layout = "colmap";
  EXPECT_EQ(open_dataset(folder, options).layout, "colmap");
}

TEST_F(Datasets, MasksOfEveryKind_BecomeBinary) {
  const fs::path folder = in("easymocap");
  const fs::path mask = folder / "mask/00/000000.png";
  const auto read = [&](const ByteImage& image) {
    fs::remove(mask);
    write_image(mask, image);
    FrameReader reader(open_dataset(folder));
    return *reader.mask(0, 0);
  };
  ByteImage ones(64, 80, 1);
  ones.at(3, 4) = 1;
  EXPECT_EQ(read(ones).at(3, 4), 255);
  ByteImage soft(64, 80, 1, 100);
  soft.at(3, 4) = 200;
  EXPECT_EQ(read(soft).at(3, 4), 255);
  EXPECT_EQ(read(soft).at(4, 3), 0);
  ByteImage color(64, 80, 3);
  color.at(3, 4, 1) = 255;
  EXPECT_EQ(read(color).at(3, 4), 255);
  ByteImage alpha(64, 80, 4, 255);
  alpha.at(3, 4, 3) = 0;
  EXPECT_EQ(read(alpha).at(3, 4), 0);
  EXPECT_EQ(read(alpha).at(4, 3), 255);
}

TEST_F(Datasets, KeypointSchema_IsGuessedFromLimbs) {
  // A standing person in BODY_25B.
  Keypoints2d person = Keypoints2d::Zero(25, 3);
  const KeypointSchema& schema = keypoint_schema("body_25b");
  const auto put = [&](const std::string& name, double x, double y) {
    person.row(find_keypoint(schema, name)) << x, y, 0.9;
  };
  for (const double side : {-1.0, 1.0}) {
    const std::string name = side < 0 ? "left_" : "right_";
    put(name + "eye", 100 + 3 * side, 20);
    put(name + "ear", 100 + 6 * side, 22);
    put(name + "shoulder", 100 + 18 * side, 50);
    put(name + "elbow", 100 + 22 * side, 80);
    put(name + "wrist", 100 + 25 * side, 110);
    put(name + "hip", 100 + 10 * side, 110);
    put(name + "knee", 100 + 11 * side, 155);
    put(name + "ankle", 100 + 12 * side, 200);
    put(name + "heel", 100 + 12 * side, 206);
  }
  put("nose", 100, 23);
  EXPECT_EQ(guess_keypoint_schema(25, {person}), "body_25b");
  const Keypoints2d other = fixtures::in_schema(person, schema, body_25_schema());
  EXPECT_EQ(guess_keypoint_schema(25, {other}), "body_25");
  EXPECT_EQ(other.row(find_keypoint(body_25_schema(), "neck"))[0], 100);
  EXPECT_EQ(guess_keypoint_schema(26, {}), "halpe_26");
  EXPECT_EQ(guess_keypoint_schema(7, {}), "");
}

TEST(RealDatasets, Pose2SimDemo_OpensWithItsFaultsReported) {
  ATELIER_TEST_FILE(folder, "pose2sim_demo/single");
  const Dataset dataset = open_dataset(folder);
  EXPECT_EQ(dataset.layout, "pose2sim");
  ASSERT_EQ(dataset.cameras.size(), 4U);
  EXPECT_EQ(frame_ids(dataset).size(), 100U);
  EXPECT_NEAR(dataset.info.sequences.front().fps, 60, 0.1);
  const Finding* size = find_finding(dataset, "image-size");
  ASSERT_NE(size, nullptr);
  EXPECT_NE(size->what.find("1088 x 1920, images are 1080 x 1920"), std::string::npos);
  const Finding* distortion = find_finding(dataset, "distortion-scaled");
  ASSERT_NE(distortion, nullptr);
  EXPECT_EQ(dataset.frames[0].keypoints.size(), 100U);
  EXPECT_EQ(dataset.info.keypoint_schema, "body_25b");
  EXPECT_NE(find_finding(dataset, "keypoint-schema"), nullptr);
  // Cameras stand round the gymnast, above the ground, a few metres off.
  for (const Camera& camera : dataset.cameras) {
    EXPECT_GT(camera_center(camera).y(), 1);
    EXPECT_LT(camera_center(camera).y(), 3);
  }
  FrameReader reader(dataset);
  EXPECT_TRUE(reader.byte_image(2, 0).has_value());
}

TEST(RealDatasets, QualisysAndPose2Sim_GiveTheSameCameras) {
  ATELIER_TEST_FILE(folder, "pose2sim_demo/single");
  DatasetOptions options;
  const Dataset toml = open_dataset(folder, options);
  options.layout = "qualisys";
  const Dataset qualisys = open_dataset(folder, options);
  ASSERT_EQ(qualisys.cameras.size(), 4U);
  for (std::size_t c = 0; c < 4; ++c) {
    const Camera& a = toml.cameras[c];
    const Camera& b = qualisys.cameras[c];
    EXPECT_LT((camera_center(a) - camera_center(b)).norm(), 1e-12);
    EXPECT_LT((a.camera_from_world_rotation - b.camera_from_world_rotation).norm(), 1e-8);
    EXPECT_NEAR(a.fx, b.fx, 1e-3);
    EXPECT_NEAR(a.cx, b.cx, 1e-3);
    EXPECT_NEAR(64 * a.distortion[0], b.distortion[0], 1e-9);
  }
}

TEST(RealDatasets, CaliscopeArrays_OpenWithVideos) {
  ATELIER_TEST_FILE(folder, "caliscope_calib/charuco_3to4cam_solved");
  const Dataset dataset = open_dataset(folder);
  EXPECT_EQ(dataset.layout, "caliscope");
  ASSERT_EQ(dataset.cameras.size(), 4U);
  EXPECT_NEAR(dataset.cameras[0].fx, 903.550124089999, 1e-9);
  EXPECT_NEAR(dataset.cameras[0].cx, 618.3086297620227 + 0.5, 1e-9);
  ATELIER_TEST_FILE(four, "caliscope_calib/4_cam_recording");
  EXPECT_EQ(open_dataset(four).layout, "caliscope");
}

TEST(RealDatasets, Human36mCalibration_OpensForEverySubject) {
  ATELIER_TEST_FILE(file, "keypoint_annotations/human36m_camera-parameters.json");
  DatasetOptions options;
  options.subject = "S9";
  const Dataset dataset = open_dataset(file, options);
  EXPECT_EQ(dataset.layout, "human36m");
  ASSERT_EQ(dataset.cameras.size(), 4U);
  for (const Camera& camera : dataset.cameras) {
    EXPECT_GT(camera_center(camera).y(), 1);  // on tripods, Y up
    EXPECT_LT(camera_center(camera).y(), 2.2);
    EXPECT_NEAR(camera.width, 1000, 50);
  }
  options.subject = "S99";
  ATELIER_EXPECT_REFUSED(open_dataset(file, options), UnknownValue,
                         "subject: 'S99'; expected one of");
}

}  // namespace
}  // namespace atelier
