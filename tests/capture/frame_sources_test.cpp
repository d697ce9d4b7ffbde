// Where images come from: folders, zips, videos; keypoints and labels of every kind.

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include <gtest/gtest.h>

#include "capture/frame_reader.h"
#include "capture/keypoint_schema.h"
#include "capture/keypoints2d.h"
#include "capture/keypoints3d_file.h"
#include "capture/label_taxonomy.h"
#include "capture/layouts/mvhumannet.h"
#include "capture/layouts/open_dataset.h"
#include "capture/layouts/write_layout.h"
#include "capture/video_file.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/json.h"
#include "core/io/zip_archive.h"
#include "core/render/video.h"
#include "tests/capture/small_capture.h"
#include "tests/support/denied_folder.h"
#include "tests/support/refusals.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// A grey video whose frame i has the level 20 + 20 i.
void write_grey_video(const fs::path& path, Index count) {
  write_video(path, count, [](Index i) {
    const auto level = static_cast<std::uint8_t>(20 + 20 * i);
    return linear_from_srgb(ByteImage(64, 80, 3, level));
  });
}

TEST(FrameSources, UnreadableFolder_IsRefused) {
  const fixtures::TemporaryDirectory folder;
  fixtures::write_small_capture(folder / "capture");
  for (const char* part : {"images", "labels", "keypoints2d", "images/01"}) {
    const fs::path denied = folder / "capture" / part;
    const fixtures::DeniedFolder without_rights(denied, folder.path());
    ATELIER_EXPECT_REFUSED(open_dataset(folder / "capture"), EnvironmentError,
                           denied.string() + ": Permission denied");
  }
}

TEST(FrameSources, DanglingFolderLink_IsRefused) {
  const fixtures::TemporaryDirectory folder;
  fixtures::write_small_capture(folder / "capture");
  fs::remove_all(folder / "capture/labels");
  fs::create_directory_symlink("labels", folder / "capture/labels");
  ATELIER_EXPECT_REFUSED(open_dataset(folder / "capture"), EnvironmentError, "capture/labels");
}

TEST(FrameSources, FileInPlaceOfFolder_IsRefused) {
  for (const char* place : {"images", "labels", "keypoints2d", "images/01"}) {
    const fixtures::TemporaryDirectory folder;
    fixtures::write_small_capture(folder / "capture");
    const fs::path file = folder / "capture" / place;
    fs::remove_all(file);
    write_file_atomically(file, "a file");
    ATELIER_EXPECT_REFUSED(open_dataset(folder / "capture"), DataError,
                           file.string() + ": a file; expected a folder");
  }
}

TEST(FrameSources, FolderInPlaceOfImage_IsRefused) {
  const fixtures::TemporaryDirectory folder;
  fixtures::write_small_capture(folder / "capture");
  const fs::path picture = folder / "capture/images/01" / (frame_name(3) + ".png");
  fs::remove(picture);
  fs::create_directory(picture);
  ATELIER_EXPECT_REFUSED(open_dataset(folder / "capture"), DataError,
                         picture.string() + ": a folder; expected a file");
}

TEST(FrameSources, MissingFolders_AreEmpty) {
  const fixtures::TemporaryDirectory folder;
  fixtures::write_small_capture(folder / "capture");
  fs::remove_all(folder / "capture/labels");
  fs::remove_all(folder / "capture/keypoints2d/02");
  const Dataset dataset = open_dataset(folder / "capture");
  EXPECT_TRUE(dataset.frames[0].labels.empty());
  EXPECT_FALSE(dataset.frames[1].keypoints.empty());
  EXPECT_TRUE(dataset.frames[2].keypoints.empty());
}

TEST(FrameSources, ZipOfImages_IsACamera) {
  const fixtures::TemporaryDirectory folder;
  fixtures::write_small_capture(folder / "capture");
  std::vector<std::pair<std::string, std::vector<std::byte>>> members = {{"00/", {}},
                                                                         {"00/notes.txt", {}}};
  for (const int frame : {3, 4}) {
    const std::string name = frame_name(frame) + ".png";
    members.emplace_back("00/" + name,
                         read_file_bytes(folder / "capture/images/00" / name, 1 << 20));
  }
  make_private_directory(folder / "zips/images");
  AtomicFile file(folder / "zips/images/cam00.zip");
  file.write(zip_bytes(members, true));
  file.commit();
  const Dataset dataset = open_dataset(folder / "zips");
  EXPECT_EQ(dataset.layout, "images");
  EXPECT_FALSE(dataset.calibrated);
  ASSERT_EQ(dataset.cameras.size(), 1U);
  EXPECT_EQ(dataset.cameras[0].id, "cam00");
  EXPECT_EQ(dataset.cameras[0].width, 64);
  FrameReader reader(dataset);
  EXPECT_EQ(reader.byte_image(0, 4)->at(7, 9, 1), 4);
  EXPECT_EQ(reader.encoded_image(0, 3)->extension, ".png");
}

TEST(FrameSources, Video_IsReadInAnyOrder) {
  const fixtures::TemporaryDirectory folder;
  make_private_directory(folder / "videos");
  write_grey_video(folder / "videos/a.mp4", 6);
  const Dataset dataset = open_dataset(folder.path());
  ASSERT_EQ(dataset.cameras.size(), 1U);
  EXPECT_EQ(frame_ids(dataset).size(), 6U);
  EXPECT_GT(dataset.info.sequences.front().fps, 0);
  FrameReader reader(dataset);
  for (const int frame : {0, 3, 5, 1, 1}) {
    EXPECT_NEAR(reader.byte_image(0, frame)->at(20, 20, 1), 20 + 20 * frame, 6) << frame;
  }
  const std::optional<EncodedImage> png = reader.encoded_image(0, 2);
  EXPECT_EQ(png->extension, ".png");
  EXPECT_NEAR(read_byte_image(png->bytes, "png").at(5, 5, 0), 60, 6);
}

// GX010001.MP4, and archives of Windows.
TEST(FrameSources, ExtensionsInCapitals_AreReadAsOthers) {
  const fixtures::TemporaryDirectory folder;
  make_private_directory(folder / "videos");
  write_grey_video(folder / "b.mp4", 3);
  fs::rename(folder / "b.mp4", folder / "videos/GX010001.MP4");
  write_grey_video(folder / "b.mp4", 4);
  fs::rename(folder / "b.mp4", folder / "videos/phone.M4V");
  fixtures::write_small_capture(folder / "capture");
  const std::vector<std::byte> png =
      read_file_bytes(folder / "capture/images/00/000003.png", 1 << 20);
  AtomicFile file(folder / "videos/zipped.ZIP");
  file.write(zip_bytes({{"000003.PNG", png}}, true));
  file.commit();
  DatasetOptions options;
  options.layout = "images";
  const Dataset dataset = open_dataset(folder / "videos", options);
  ASSERT_EQ(dataset.cameras.size(), 3U);
  EXPECT_EQ(dataset.cameras[0].id, "GX010001");
  EXPECT_EQ(dataset.frames[0].images.size(), 3U);
  EXPECT_EQ(dataset.frames[1].images.size(), 4U);
  EXPECT_EQ(dataset.frames[2].images.size(), 1U);
}

TEST(FrameSources, ImagesOfKindsThatAreNotRead_AreNamed) {
  const fixtures::TemporaryDirectory folder;
  for (const char* name : {"left/IMG_0001.HEIC", "right/IMG_0001.HEIC"}) {
    make_private_directory((folder / name).parent_path());
    write_file_atomically(folder / name, "....ftypheic");
  }
  ATELIER_EXPECT_REFUSED(open_dataset(folder.path()), DataError, "of a kind that is not read");
}

TEST(FrameSources, BadVideos_AreRefused) {
  const fixtures::TemporaryDirectory folder;
  write_grey_video(folder / "good.mp4", 3);
  std::vector<std::byte> bytes = read_file_bytes(folder / "good.mp4", 1 << 24);
  const auto refused = [&](const char* name, const std::string& content, const char* words) {
    std::ofstream(folder / name, std::ios::binary) << content;
    ATELIER_EXPECT_REFUSED(VideoFile(folder / name), DataError, words);
  };
  refused("list.mp4", "#EXTM3U\n#EXTINF:1,\nfile:///etc/passwd\n", "no video that is read");
  refused("concat.mp4", "ffconcat version 1.0\nfile /etc/passwd\n", "no video that is read");
  refused("empty.mp4", "", "no video that is read");
  refused("head.mp4", std::string(reinterpret_cast<const char*>(bytes.data()), 40), "cannot open");
  ATELIER_EXPECT_REFUSED(VideoFile(folder / "none.mp4"), DataError, "none.mp4");
  VideoFile good(folder / "good.mp4");
  ATELIER_EXPECT_REFUSED(good.frame(3), LogicError, "does not have");
  ATELIER_EXPECT_REFUSED(VideoFile(folder / "good.mp4", Limits{.image_side = 32}), DataError,
                         "beyond the limits");
  ATELIER_EXPECT_REFUSED(VideoFile(folder / "good.mp4", Limits{.frames = 2}), DataError,
                         "no number of frames");
}

TEST(FrameSources, DamagedZip_IsRefused) {
  const fixtures::TemporaryDirectory folder;
  make_private_directory(folder / "images");
  write_file_atomically(folder / "images/a.zip", "no zip at all");
  ATELIER_EXPECT_REFUSED(open_dataset(folder.path()), DataError, "no readable zip");
}

TEST(Keypoints, SeveralPeople_RoundTrip) {
  const std::vector<PersonKeypoints> people = fixtures::small_people(1);
  const std::vector<PersonKeypoints> back =
      parse_openpose(openpose_json(people, 0.5), "people.json", 0.5);
  ASSERT_EQ(back.size(), 2U);
  EXPECT_EQ(back[1].id, 1);
  EXPECT_TRUE(back[1].points.row(24).isZero(0));  // not found stays so
  EXPECT_LT((back[1].points - people[1].points).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_TRUE(parse_openpose(R"({"people":[]})").empty());
  EXPECT_TRUE(parse_openpose(R"({"people":[{"pose_keypoints_2d":[]}]})").empty());
}

TEST(Keypoints, Schemas_HaveTheirPointCountAndMirrors) {
  const std::map<std::string, std::size_t> sizes = {
      {"body_25", 25},  {"body_25b", 25},        {"coco_17", 17}, {"coco_18", 18},
      {"halpe_26", 26}, {"coco_wholebody", 133}, {"coco_19", 19}, {"blazepose_33", 33}};
  EXPECT_EQ(keypoint_schema_names().size(), sizes.size());
  for (const auto& [name, size] : sizes) {
    const KeypointSchema& schema = keypoint_schema(name);
    EXPECT_EQ(schema.points.size(), size) << name;
    for (std::size_t i = 0; i < size; ++i) {
      ASSERT_GE(schema.mirror[i], 0) << name << " " << schema.points[i];
      EXPECT_EQ(schema.mirror[static_cast<std::size_t>(schema.mirror[i])], static_cast<int>(i));
    }
  }
  ATELIER_EXPECT_REFUSED(keypoint_schema("halpe"), DataError, "halpe_26");
  EXPECT_EQ(find_keypoint(keypoint_schema("body_25b"), "right_heel"), 24);
  EXPECT_EQ(find_keypoint(keypoint_schema("halpe_26"), "right_big_toe"), 21);
  EXPECT_EQ(find_keypoint(keypoint_schema("coco_19"), "left_eye"), 15);
  EXPECT_EQ(find_keypoint(keypoint_schema("blazepose_33"), "right_foot_index"), 32);
  EXPECT_EQ(find_keypoint(keypoint_schema("blazepose_33"), "right_ear"), 8);
}

TEST(Keypoints, Points3d_ReadBackInDatasetFrame) {
  PersonPoints person;
  person.id = 4;
  person.points = Keypoints3d::Zero(2, 4);
  person.points.row(0) << 0.1, 0.2, 1.7, 0.9;
  const std::vector<PersonPoints> back =
      parse_keypoints3d(keypoints3d_json(std::vector<PersonPoints>{person}));
  ASSERT_EQ(back.size(), 1U);
  EXPECT_EQ(back[0].id, 4);
  EXPECT_EQ(back[0].points, person.points);
  // In a data set they are metres, Y up: EasyMocap has Z up.
  const fixtures::TemporaryDirectory folder;
  fixtures::write_small_capture(folder / "capture");
  const fs::path out =
      write_layout(folder / "capture", "easymocap", folder / "out").folders.front();
  make_private_directory(out / "keypoints3d");
  write_file_atomically(out / "keypoints3d/000000.json",
                        keypoints3d_json(std::vector<PersonPoints>{person}));
  FrameReader reader(open_dataset(out));
  ASSERT_EQ(reader.keypoints3d(0).size(), 1U);
  EXPECT_TRUE(reader.keypoints3d(0)[0].points.row(0).isApprox(
      Eigen::RowVector4d(0.1, 1.7, -0.2, 0.9), 1e-12));
  EXPECT_TRUE(reader.keypoints3d(1).empty());
}

TEST(Keypoints, StandardDeviationsAndBridgedPoints_RoundTrip) {
  PersonPose person;
  person.id = 1;
  person.pose.points.resize(3);
  person.pose.points[0].place = {0.1, 0.2, 0.3};
  person.pose.points[0].confidence = 0.9;
  person.pose.points[0].covariance = Eigen::Vector3d(1e-4, 1e-4, 4e-4).asDiagonal();
  person.pose.points[1].place = {7, 7, 7};  // not found
  person.pose.points[2].place = {0.4, 0.5, 0.6};
  person.pose.points[2].confidence = 0.05;
  person.pose.points[2].covariance = 0.0025 * Eigen::Matrix3d::Identity();
  person.pose.points[2].bridged = true;
  const std::string text = keypoints3d_json(std::vector<PersonPose>{person});
  const nlohmann::json root = parse_json(text);
  EXPECT_EQ(root[0]["bridged"], nlohmann::json({2}));
  EXPECT_NEAR(root[0]["deviations"][0].get<double>(), std::sqrt(2e-4), 1e-12);
  EXPECT_EQ(root[0]["deviations"][1], 0.0);
  EXPECT_NEAR(root[0]["deviations"][2].get<double>(), 0.05, 1e-12);
  EXPECT_EQ(parse_bridged_keypoints(text), (std::map<int, std::vector<int>>{{1, {2}}}));
  EXPECT_TRUE(parse_bridged_keypoints(keypoints3d_json(std::vector<PersonPoints>{})).empty());
  EXPECT_THROW(parse_bridged_keypoints(R"([{"id": 1, "bridged": [1], "keypoints3d": [[1]]}])"),
               DataError);
  const std::vector<PersonPoints> back = parse_keypoints3d(text);
  ASSERT_EQ(back.size(), 1U);
  EXPECT_TRUE(back[0].points.row(1).isZero(0));
  EXPECT_EQ(back[0].points.row(2), Eigen::RowVector4d(0.4, 0.5, 0.6, 0.05));
}

TEST(Labels, EveryTaxonomy_MapsToOurLabels) {
  const auto one = [](const std::string& name, int number) {
    return static_cast<Label>(
        to_atelier_labels(ByteImage(1, 1, 1, static_cast<std::uint8_t>(number)),
                          label_taxonomy(name))
            .at(0, 0));
  };
  for (const std::string& name : label_taxonomy_names()) {
    EXPECT_EQ(label_taxonomy(name).names.size(), label_taxonomy(name).labels.size()) << name;
    EXPECT_EQ(one(name, 255), Label::Unknown);
  }
  EXPECT_EQ(one("lip", 10), Label::Dress);  // jumpsuits
  EXPECT_EQ(one("cihp", 10), Label::Skin);  // the torso's
  EXPECT_EQ(one("lip", 7), Label::Outer);
  EXPECT_EQ(one("lip", 19), Label::Shoes);
  EXPECT_EQ(one("atr", 5), Label::Lower);  // skirt
  EXPECT_EQ(one("atr", 11), Label::Skin);  // face
  EXPECT_EQ(one("goliath_28", 12), Label::Lower);
  EXPECT_EQ(one("goliath_28", 22), Label::Upper);
  EXPECT_EQ(one("goliath_28", 27), Label::Skin);
  EXPECT_EQ(one("4d_dress", 0), Label::Skin);
  EXPECT_EQ(label_taxonomy("goliath_28").labels.size(), 28U);
  EXPECT_EQ(label_taxonomy("atr").labels.size(), 18U);
  ByteImage color(3, 1, 3, 255);
  color.data = {180, 50, 50, 255, 255, 255, 1, 2, 3};
  const ByteImage labels = to_atelier_labels(color, label_taxonomy("4d_dress"));
  EXPECT_EQ(labels.data, (std::vector<std::uint8_t>{3, 0, 255}));
}

TEST(Labels, UnknownLabelOrTaxonomy_IsRefused) {
  ByteImage labels(4, 2, 1);
  labels.at(3, 1) = 20;
  ATELIER_EXPECT_REFUSED(to_atelier_labels(labels, label_taxonomy("lip"), "a.png"), DataError,
                         "pixel (3, 1)");
  ATELIER_EXPECT_REFUSED(label_taxonomy("chip"), DataError, "cihp");
  ATELIER_EXPECT_REFUSED(to_atelier_labels(ByteImage(1, 1, 3), label_taxonomy("lip")), DataError,
                         "3 channels");
}

TEST(Labels, RealLabelImages_MapConsistently) {
  ATELIER_TEST_FILE(lip, "human_parsing_labels/demo_lip.png");
  ATELIER_TEST_FILE(atr, "human_parsing_labels/demo_atr.png");
  // The same person by two networks: skin and hair must cover about the same pixels.
  std::map<std::string, std::map<int, int>> counts;
  for (const auto& [path, taxonomy] : {std::pair{lip, "lip"}, {atr, "atr"}}) {
    const ByteImage labels =
        to_atelier_labels(read_labels(path), label_taxonomy(taxonomy), path.string());
    for (const std::uint8_t label : labels.data) {
      ++counts[taxonomy][label];
    }
  }
  for (const Label label : {Label::Skin, Label::Hair}) {
    const double a = counts["lip"][static_cast<int>(label)];
    const double b = counts["atr"][static_cast<int>(label)];
    EXPECT_GT(a, 1000);
    EXPECT_NEAR(a / b, 1, 0.15) << label_name(label);
  }
}

TEST(Pickles, SinglePlainNumber_IsAllThatIsRead) {
  const auto read = [](const std::string& text) {
    return pickled_number(std::as_bytes(std::span(text)));
  };
  using namespace std::string_literals;
  EXPECT_EQ(read("\x80\x02G\x3f\xf0\0\0\0\0\0\0."s), 1.0);
  EXPECT_EQ(read("\x80\x04\x95\x0a\0\0\0\0\0\0\0G\x40\0\0\0\0\0\0\0."s), 2.0);
  EXPECT_EQ(read("\x80\x02"s
                 "cos\nsystem\n(S'true'\ntR."s),
            std::nullopt);
  EXPECT_EQ(read("\x80\x02G\x7f\xf0\0\0\0\0\0\0."s), std::nullopt);  // infinity
  EXPECT_EQ(read("\x80\x02G\x3f\xf0"s), std::nullopt);
  EXPECT_EQ(read(""s), std::nullopt);
}

}  // namespace
}  // namespace atelier
