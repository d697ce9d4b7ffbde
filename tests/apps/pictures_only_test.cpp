// What a user with nothing but images needs: masks, a network of one's own, cameras put to
// images, as commands; and what they refuse.
#ifdef ATELIER_HAS_CAPTURE

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/capture_info.h"
#include "core/io/cameras_file.h"
#include "core/io/file_bytes.h"
#include "core/io/image_file.h"
#include "tests/capture/small_capture.h"
#include "tests/capture_detection/bright_networks.h"
#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

ChildResult atelier(const std::vector<std::string>& arguments) {
  std::vector<std::string> command = {program_path()};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return run_child(command);
}

/// A capture of three frames: a bright block that walks over grey, no labels, no detections.
void write_walker(const fs::path& folder, bool detections = false) {
  SmallCapture small;
  small.frames = {1, 2, 3, 4, 5, 6};
  small.detections = detections;
  write_small_capture(folder, small);
  fs::remove_all(folder / "labels");
  fs::remove_all(folder / "keypoints2d");
  for (const Camera& camera : small.cameras) {
    for (const int frame : small.frames) {
      ByteImage picture(camera.width, camera.height, 3, 90);
      for (int y = 20; y < 60; ++y) {
        for (int x = 9 * (frame - 1); x < 9 * (frame - 1) + 10; ++x) {
          picture.at(x, y, 0) = 220;
          picture.at(x, y, 1) = 60;
        }
      }
      write_image(folder / "images" / camera.id / (frame_name(frame) + ".png"), picture);
    }
  }
}

TEST(MasksCommand, WalkerMasks_AreFoundByPlatesAndOverTime) {
  const TemporaryDirectory folder;
  write_walker(folder / "capture");
  const std::string capture = (folder / "capture").string();
  const ChildResult time = atelier({"masks", capture});
  ASSERT_EQ(time.exit_code, 0) << time.err;
  const std::string camera = SmallCapture{}.cameras[0].id;
  const ByteImage mask = read_labels(folder / "capture" / "labels" / camera / "000002.png");
  EXPECT_EQ(mask.at(13, 40), 255);
  EXPECT_EQ(mask.at(40, 40), 0);
  const ChildResult again = atelier({"masks", capture});
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, HasSubstr("labels already exists, and no flag replaces it; choose another "
                                   "--out, or remove it first"));
  fs::create_directory(folder / "plates");
  for (const Camera& one : SmallCapture{}.cameras) {
    write_image(folder / "plates" / (one.id + ".png"), ByteImage(one.width, one.height, 3, 90));
  }
  const ChildResult plates = atelier({"masks", capture, "--plates", (folder / "plates").string(),
                                      "--out", (folder / "out").string(), "--json"});
  ASSERT_EQ(plates.exit_code, 0) << plates.err;
  EXPECT_THAT(plates.out, HasSubstr("\"masks\": 6"));
  EXPECT_EQ(read_labels(folder / "out" / "labels" / camera / "000002.png").at(13, 40), 255);
}

TEST(MasksCommand, FailedMasks_LeaveNothing) {
  const TemporaryDirectory folder;
  write_walker(folder / "capture");
  const std::string capture = (folder / "capture").string();
  const std::string out = (folder / "a" / "b").string();
  fs::create_directory(folder / "other");
  const ChildResult truth =
      atelier({"masks", capture, "--out", out, "--ground-truth", (folder / "other").string()});
  EXPECT_EQ(truth.exit_code, 3);
  EXPECT_THAT(truth.err, HasSubstr("no ground-truth labels of an image of CAPTURE"));
  EXPECT_FALSE(fs::exists(folder / "a"));
  fs::create_directory(folder / "plates");
  EXPECT_EQ(
      atelier({"masks", capture, "--out", out, "--plates", (folder / "plates").string()}).exit_code,
      3);
  EXPECT_FALSE(fs::exists(folder / "a"));
  // In the capture itself, too: no half of labels, which a next run would find taken.
  EXPECT_EQ(atelier({"masks", capture, "--plates", (folder / "plates").string()}).exit_code, 3);
  EXPECT_FALSE(fs::exists(folder / "capture" / "labels"));
  EXPECT_FALSE(fs::exists(folder / "capture" / ".labels.unfinished"));
}

TEST(MasksCommand, PlaceInTheCapture_IsRefused) {
  const TemporaryDirectory folder;
  write_walker(folder / "capture");
  const std::string capture = (folder / "capture").string();
  for (const char* inside : {"/labels", "/images/00", "/new/deep"}) {
    const ChildResult refused = atelier({"masks", capture, "--out", capture + inside});
    EXPECT_EQ(refused.exit_code, 2) << inside;
    EXPECT_THAT(refused.err, HasSubstr("--out lies in CAPTURE " + capture));
    const ChildResult detections =
        atelier({"detect", capture, "--model", capture + "/none.onnx", "--out", capture + inside});
    EXPECT_EQ(detections.exit_code, 2) << inside;
    EXPECT_FALSE(fs::exists(capture + "/labels"));
    EXPECT_FALSE(fs::exists(capture + "/new"));
  }
  EXPECT_EQ(atelier({"masks", capture, "--out", capture}).exit_code, 0) << "as without it";
  EXPECT_TRUE(fs::exists(folder / "capture" / "labels"));
}

TEST(MasksCommand, PlatesThatAMethodDoesNotTake_AreRefused) {
  const TemporaryDirectory folder;
  write_walker(folder / "capture");
  fs::create_directory(folder / "plates");
  for (const char* method : {"time", "chroma"}) {
    const ChildResult refused = atelier({"masks", (folder / "capture").string(), "--plates",
                                         (folder / "plates").string(), "--method", method});
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_THAT(refused.err, HasSubstr("--plates goes with --method plates or auto"));
  }
}

TEST(MasksCommand, MissingOrSmallPlatesAndGrayScreens_AreRefused) {
  const TemporaryDirectory folder;
  write_walker(folder / "capture");
  const std::string capture = (folder / "capture").string();
  EXPECT_EQ(atelier({"masks", capture, "--method", "plates"}).exit_code, 2);
  fs::create_directory(folder / "plates");
  const ChildResult none = atelier({"masks", capture, "--plates", (folder / "plates").string(),
                                    "--out", (folder / "a").string()});
  EXPECT_EQ(none.exit_code, 3);
  EXPECT_THAT(none.err, HasSubstr("no plate"));
  for (const Camera& one : SmallCapture{}.cameras) {
    write_image(folder / "plates" / (one.id + ".png"), ByteImage(8, 8, 3, 90));
  }
  const ChildResult small = atelier({"masks", capture, "--plates", (folder / "plates").string(),
                                     "--out", (folder / "b").string()});
  EXPECT_EQ(small.exit_code, 3);
  EXPECT_THAT(small.err, HasSubstr("a background of 8 x 8 pixels"));
  const ChildResult grey = atelier({"masks", capture, "--method", "chroma", "--chroma.key",
                                    "[0, 0, 0]", "--out", (folder / "c").string()});
  EXPECT_EQ(grey.exit_code, 3);
  EXPECT_THAT(grey.err, HasSubstr("nearly grey"));
}

void write_network(const fs::path& file, const SmallNetwork& network) {
  const std::vector<std::byte> bytes = onnx_bytes(network);
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
}

TEST(PicturesOnly, MasksWithoutKeypoints_GiveSurfacesAndSayWhatIsMissing) {
  const TemporaryDirectory folder;
  write_walker(folder / "capture");
  const std::string capture = (folder / "capture").string();
  ASSERT_EQ(atelier({"masks", capture}).exit_code, 0);
  const ChildResult plan =
      atelier({"run", capture, (folder / "work").string(), "--to", "body", "--dry-run"});
  EXPECT_EQ(plan.exit_code, 0) << plan.err;
  EXPECT_THAT(plan.out, HasSubstr("reconstruct  would run"));
  for (const char* stage : {"personalize", "track"}) {
    std::string name = stage;
    name.resize(12, ' ');
    EXPECT_THAT(plan.out,
                HasSubstr(name + " is skipped: no 2D keypoints; atelier detect creates them"));
  }
  EXPECT_THAT(plan.out, HasSubstr("body         is skipped: it reads the result of personalize"));
}

TEST(DetectCommand, CustomNetwork_FillsTheCapture) {
  const TemporaryDirectory folder;
  write_walker(folder / "capture");
  const std::string capture = (folder / "capture").string();
  // 17 points, all where the image is reddest.
  write_network(folder / "points.onnx",
                mixing_network(std::vector<std::vector<float>>(17, {1, -1, 0}), 64, 80));
  const ChildResult done =
      atelier({"detect", capture, "--model", (folder / "points.onnx").string(), "--kind", "heatmap",
               "--width", "64", "--height", "80", "--mean", "[0, 0, 0]", "--standard-deviation",
               "[255, 255, 255]"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("18 images, 18 people, points in the order coco_17"));
  EXPECT_EQ(read_capture_info(folder / "capture").keypoint_schema, "coco_17");
  const std::string camera = SmallCapture{}.cameras[0].id;
  const auto people = parse_openpose(
      read_file_text(folder / "capture" / "keypoints2d" / camera / "000003.json", 1 << 20));
  ASSERT_EQ(people.size(), 1U);
  EXPECT_GT(people[0].points(0, 0), 18);
  EXPECT_LT(people[0].points(0, 0), 28);
  const ChildResult again =
      atelier({"detect", capture, "--model", (folder / "points.onnx").string()});
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, HasSubstr("keypoints2d already exists, and no flag replaces it"));
  // Classes: background, and one more where it is red.
  std::vector<std::vector<float>> classes(28, {-1, -1, -1});
  classes[0] = {0.3F, 0.3F, 0.3F};
  classes[22] = {1, -0.5F, 0};
  write_network(folder / "classes.onnx", mixing_network(classes, 64, 80));
  const ChildResult parsed =
      atelier({"detect", capture, "--model", (folder / "classes.onnx").string(), "--kind",
               "parsing", "--width", "64", "--height", "80", "--mean", "[0, 0, 0]",
               "--standard-deviation", "[255, 255, 255]"});
  ASSERT_EQ(parsed.exit_code, 0) << parsed.err;
  EXPECT_THAT(parsed.out, HasSubstr("classes of goliath_28"));
  const ByteImage labels = read_labels(folder / "capture" / "labels" / camera / "000003.png");
  EXPECT_EQ(labels.at(22, 40), 3);  // an upper garment
  EXPECT_EQ(labels.at(5, 5), 0);
}

TEST(DetectCommand, BuiltInDetector_WritesItsOrderIntoTheCapture) {
  const TemporaryDirectory folder;
  write_walker(folder / "capture");
  const PeopleNetworks networks = bright_networks();
  fs::create_directories(folder / "networks");
  const auto write = [&](const char* name, const std::vector<std::byte>& bytes) {
    std::ofstream(folder.path() / "networks" / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
  };
  write("person.onnx", networks.person);
  write("landmarks_lite.onnx", networks.landmarks);
  const std::string capture = (folder / "capture").string();
  const ChildResult done = atelier(
      {"detect", capture, "--networks", (folder / "networks").string(), "--network", "lite"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, AllOf(HasSubstr("18 images, "),
                              HasSubstr(" people, points in the order blazepose_33")));
  EXPECT_EQ(read_capture_info(folder / "capture").keypoint_schema, "blazepose_33");
  const std::string camera = SmallCapture{}.cameras[0].id;
  const auto people = parse_openpose(
      read_file_text(folder / "capture" / "keypoints2d" / camera / "000003.json", 1 << 20));
  ASSERT_EQ(people.size(), 1U);
  EXPECT_NEAR(people[0].points(0, 0), 32, 0.1);  // the middle of 64 x 80
  EXPECT_NEAR(people[0].points(0, 1), 40, 0.1);
  EXPECT_NEAR(people[0].points(0, 2), 0.5, 0.01);
}

TEST(DetectCommand, HostileNetworksAndWrongOrders_AreRefused) {
  const TemporaryDirectory folder;
  write_walker(folder / "capture");
  const std::string capture = (folder / "capture").string();
  const std::string out = (folder / "out").string();
  std::ofstream(folder / "bad.onnx", std::ios::binary) << std::string(4096, '\xFF');
  const ChildResult bad =
      atelier({"detect", capture, "--model", (folder / "bad.onnx").string(), "--out", out});
  EXPECT_EQ(bad.exit_code, 3);
  EXPECT_THAT(bad.err, HasSubstr("bad.onnx"));
  EXPECT_EQ(atelier({"detect", capture, "--model", (folder / "none.onnx").string()}).exit_code, 3);
  const ChildResult missing = atelier({"detect", capture, "--networks", out});
  EXPECT_EQ(missing.exit_code, 5);
  EXPECT_THAT(missing.err, HasSubstr("scripts/detector-networks"));
  EXPECT_EQ(atelier({"detect", capture, "--schema", "body_25", "--networks", out}).exit_code, 2);
  EXPECT_EQ(atelier({"detect", capture, "--kind", "parsing", "--networks", out}).exit_code, 2);
  EXPECT_EQ(atelier({"detect", capture, "--model", "x.onnx", "--networks", out}).exit_code, 2);
  const ChildResult means = atelier({"detect", capture, "--model", (folder / "bad.onnx").string(),
                                     "--out", out, "--mean", "[1, 2]"});
  EXPECT_EQ(means.exit_code, 2);
  EXPECT_THAT(means.err, HasSubstr("--mean and --standard-deviation take three numbers"));
  write_network(folder / "five.onnx",
                mixing_network(std::vector<std::vector<float>>(5, {1, 0, 0}), 64, 80));
  const std::vector<std::string> five = {
      "detect",   capture,   "--model", (folder / "five.onnx").string(),
      "--kind",   "heatmap", "--width", "64",
      "--height", "80",      "--out",   out};
  const ChildResult unknown = atelier(five);
  EXPECT_EQ(unknown.exit_code, 3);
  EXPECT_THAT(unknown.err, HasSubstr("5 points"));
}

TEST(ConvertCaptureCommand, CalibrationCameras_AreAdded) {
  const TemporaryDirectory folder;
  write_walker(folder / "capture");
  fs::create_directories(folder / "pictures");
  fs::copy(folder / "capture" / "images", folder / "pictures" / "images",
           fs::copy_options::recursive);
  const std::string cameras = (folder / "capture" / "cameras.json").string();
  const ChildResult done =
      atelier({"convert-capture", (folder / "pictures").string(), (folder / "out").string(),
               "--cameras", cameras, "--fps", "12"});
  ASSERT_EQ(done.exit_code, 0) << done.err << done.out;
  EXPECT_EQ(read_cameras(folder / "out").size(), 3U);
  EXPECT_EQ(read_cameras(folder / "out")[1].fx, SmallCapture{}.cameras[1].fx);
  fs::remove_all(folder / "pictures" / "images" / SmallCapture{}.cameras[0].id);
  write_image(folder / "pictures" / "images" / SmallCapture{}.cameras[1].id / "000001.png",
              ByteImage(9, 9, 3, 90));
  const ChildResult sizes = atelier({"convert-capture", (folder / "pictures").string(),
                                     (folder / "x").string(), "--cameras", cameras, "--fps", "12"});
  EXPECT_EQ(sizes.exit_code, 3);
  EXPECT_THAT(sizes.err, HasSubstr("the images' 9 x 9"));
}

}  // namespace
}  // namespace atelier::fixtures

#endif
