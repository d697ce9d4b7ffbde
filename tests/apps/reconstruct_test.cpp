// The stage `reconstruct` on a small synthetic capture, and on what is left when views fail.
#if defined(ATELIER_HAS_CAPTURE) && defined(ATELIER_HAS_CAPTURE_SURFACE)

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/io/cameras_file.h"
#include "core/io/file_bytes.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/image_file.h"
#include "core/mesh_statistics.h"
#include "core/sequence_archive.h"
#include "tests/apps/synthesized_fixture.h"
#include "tests/support/child_process.h"
#include "tests/support/flags.h"
#include "tests/support/places.h"
#include "tests/support/read_text.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

struct OneFrame {
  static inline const std::vector<std::string> kFlags = {
      "--dome.width",        "180", "--dome.height",     "240", "--frames",        "1",
      "--minimal_frames",    "0",   "--start",           "0",   "--samples",       "2",
      "--held_out_cameras",  "0",   "--held_out_share",  "0",   "--light-samples", "12",
      "--fabric.resolution", "256", "--skin_resolution", "256"};
};

/// On a capture of one frame.
class Reconstruct : public SynthesizedFixture<OneFrame> {
 protected:
  ChildResult reconstruct(const std::vector<std::string>& more = {}) const {
    return stage("reconstruct", with_usual(kQuickReconstruction, more));
  }
  fs::path picture(const std::string& camera) const {
    return capture_ / "images" / camera / "000000.png";
  }
  Mesh scan() const { return read_mesh_archive(result("reconstruct") / "scans" / "000000.h5"); }
};

TEST_F(Reconstruct, FramesThatThereAreNot_AreRefusedWhilePlanning) {
  for (const char* planned : {"--dry-run", "--force"}) {
    const ChildResult result = reconstruct({"--frames", "7:9", planned});
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_THAT(result.err, HasSubstr("--frames cannot be '7:9': of "));
    EXPECT_THAT(result.err, HasSubstr("it takes a range that holds frame 0, the only one"));
  }
}

TEST_F(Reconstruct, FramesThatThereAreNotOfKeypointsAlone_AreRefused) {
  fs::remove_all(capture_ / "labels");
  fs::remove_all(capture_ / "masks");
  ASSERT_EQ(reconstruct({"--frames", "0:1", "--dry-run"}).exit_code, 0);
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"--dry-run"}, std::vector<std::string>{}}) {
    std::vector<std::string> flags = {"--frames", "70:80"};
    flags.insert(flags.end(), more.begin(), more.end());
    const ChildResult result = reconstruct(flags);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_THAT(result.err, HasSubstr("--frames cannot be '70:80': of "));
  }
}

TEST_F(Reconstruct, DamagedCalibration_IsRefusedWhilePlanning) {
  const fs::path cameras = capture_ / "cameras.json";
  fs::resize_file(cameras, fs::file_size(cameras) / 2);
  for (const char* name : {"validate", "reconstruct"}) {
    const ChildResult planned = stage(name, {"--dry-run"});
    EXPECT_EQ(planned.exit_code, 3) << name << planned.err;
    EXPECT_EQ(planned.err, stage(name, {}).err) << name;
    EXPECT_THAT(planned.err, HasSubstr("cameras.json"));
  }
}

TEST_F(Reconstruct, ScansAndKeypoints_AreMeasuredAgainstGroundTruth) {
  const ChildResult result = reconstruct({"--stereo.iterations", "4", "--stereo.refinements", "3"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err.find("view-"), std::string::npos) << result.err;
  const Mesh found = scan();
  EXPECT_GT(found.faces.rows(), 500);
  EXPECT_EQ(found.colors.rows(), found.vertices.rows());
  EXPECT_EQ(found.labels.size(), static_cast<std::size_t>(found.vertices.rows()));
  const auto holes =
      nlohmann::json::parse(read_text(workspace_ / "reconstruct" / "current" / "holes.json"));
  ASSERT_GT(holes.at("000000").size(), 0U);
  EXPECT_GT(holes["000000"][0]["area"], 0);
  const ChildResult measured = run_child({program_path(), "evaluate", workspace_.string(),
                                          "--ground-truth", capture_.string(), "--json"});
  ASSERT_EQ(measured.exit_code, 0) << measured.err;
  for (const char* key :
       {"surface.chamfer_mm", "surface.completeness", "labels.miou", "keypoints.mean_mm"}) {
    EXPECT_THAT(measured.out, HasSubstr(key));
  }
}

TEST_F(Reconstruct, MasksAndGains_AreMeasuredAgainstGroundTruth) {
  const std::string capture = capture_.string();
  const auto evaluate = [&](const std::string& flag, const fs::path& file) {
    return run_child({program_path(), "evaluate", capture, "--ground-truth", capture, flag,
                      file.string(), "--json"});
  };
  // The true labels are the best masks that there can be, and the true gains have no error.
  const ChildResult masks = evaluate("--masks", capture_ / "truth");
  ASSERT_EQ(masks.exit_code, 0) << masks.err;
  EXPECT_EQ(nlohmann::json::parse(masks.out).at("masks.iou"), 1);
  const TemporaryDirectory folder;
  std::vector<Camera> cameras = read_ground_truth(capture_).cameras;
  std::ofstream(folder / "cameras.json") << cameras_json(cameras);
  const ChildResult gains = evaluate("--cameras", folder / "cameras.json");
  ASSERT_EQ(gains.exit_code, 0) << gains.err;
  EXPECT_LT(nlohmann::json::parse(gains.out).at("calibration.gain_largest"), 1e-12);
  const ChildResult none = evaluate("--masks", folder.path());
  EXPECT_EQ(none.exit_code, 3);
  EXPECT_THAT(none.err, HasSubstr("no mask of an image of the capture"));
  cameras[0].id = "left";
  std::ofstream(folder / "cameras.json") << cameras_json(cameras);
  const ChildResult other = evaluate("--cameras", folder / "cameras.json");
  EXPECT_EQ(other.exit_code, 3);
  EXPECT_THAT(other.err, HasSubstr("'left'"));
}

TEST_F(Reconstruct, TwoMachines_ShareTheDepthMapsOfAFrame) {
  const fs::path maps = own_.path() / "maps";
  const fs::path surface = own_.path() / "scan.ply";
  const auto depth = [&](std::vector<std::string> more) {
    std::vector<std::string> call = {program_path(), "depth", capture_.string(), maps.string()};
    more = fixtures::with_usual(kQuickReconstruction, more);
    call.insert(call.end(), more.begin(), more.end());
    return run_child(call);
  };
  const ChildResult first = depth({"--views", "0/2"});
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const ChildResult early = depth({"--views", "0/2", "--surface", surface.string()});
  EXPECT_EQ(early.exit_code, 3);
  EXPECT_THAT(early.err, HasSubstr("no such map"));
  const ChildResult second = depth({"--views", "1/2", "--surface", surface.string(), "--json"});
  ASSERT_EQ(second.exit_code, 0) << second.err;
  const auto said = nlohmann::json::parse(second.out);
  EXPECT_EQ(said.at("there"), said.at("views"));
  EXPECT_LT(said.at("made"), said.at("views"));
  EXPECT_GE(said.at("computed"), said.at("made"));
  const ChildResult again = depth({"--surface", surface.string()});
  EXPECT_EQ(again.exit_code, 2);  // before any work
  EXPECT_THAT(again.err, HasSubstr("scan.ply already exists"));
  const ChildResult measured =
      run_child({program_path(), "evaluate", capture_.string(), "--ground-truth", capture_.string(),
                 "--surface", surface.string(), "--json"});
  ASSERT_EQ(measured.exit_code, 0) << measured.err;
  EXPECT_THAT(measured.out, HasSubstr("surface.completeness"));
  const ChildResult smaller = depth({"--memory", "0.02"});  // which makes other images
  EXPECT_EQ(smaller.exit_code, 2);
  EXPECT_THAT(smaller.err, AllOf(HasSubstr("1/2 of their size"), HasSubstr("other images"),
                                 HasSubstr("give a new folder")));
  const ChildResult other = depth({"--stereo.seed", "2"});
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.err, HasSubstr("other options"));
  EXPECT_EQ(depth({"--views", "2/2"}).exit_code, 2);
  const ChildResult format = depth({"--surface", (own_.path() / "scan.xyz").string()});
  EXPECT_EQ(format.exit_code, 2);
  EXPECT_THAT(format.err, HasSubstr(".obj, .ply or .glb"));
  const ChildResult nowhere = depth({"--frame", "77"});
  EXPECT_EQ(nowhere.exit_code, 2);
  EXPECT_THAT(nowhere.err, HasSubstr("--frame cannot be '77'"));
  for (const char* broken : {"", "{", "[]", "{\"schema\": 7}", "\"atelier-depth\""}) {
    std::ofstream(maps / "depth.json") << broken;
    const ChildResult refused = depth({});
    EXPECT_EQ(refused.exit_code, 3) << broken;
    EXPECT_THAT(refused.err,
                AllOf(HasSubstr("depth.json"), HasSubstr("what the maps were made from")));
  }
}

TEST_F(Reconstruct, CalibratedColors_AreNotWrittenIntoCapturesOrImages) {
  const auto calibrate = [&](const fs::path& out) {
    return run_child({program_path(), "calibrate-color", capture_.string(), "--out", out.string()});
  };
  const std::string cameras = read_file_text(capture_ / "cameras.json", 1 << 20);
  for (const fs::path& out :
       {capture_ / "cameras.json", capture_ / "new.json", original() / "cameras.json",
        own_.path() / "a.png", capture_ / "images" / "a.json"}) {
    const ChildResult refused = calibrate(out);
    EXPECT_NE(refused.exit_code, 0) << out;
    EXPECT_THAT(refused.err, HasSubstr("--out ")) << out;
  }
  EXPECT_EQ(read_file_text(capture_ / "cameras.json", 1 << 20), cameras);
  EXPECT_FALSE(fs::exists(capture_ / "new.json"));
}

TEST_F(Reconstruct, DepthMapsInTheCapture_AreNotWritten) {
  const auto depth = [&](const fs::path& out, std::vector<std::string> more) {
    std::vector<std::string> call = {program_path(), "depth", capture_.string(), out.string()};
    call.insert(call.end(), more.begin(), more.end());
    return run_child(call);
  };
  const ChildResult inside = depth(capture_ / "maps", {});
  EXPECT_EQ(inside.exit_code, 2);
  EXPECT_THAT(inside.err, HasSubstr("lies in the capture"));
  EXPECT_FALSE(fs::exists(capture_ / "maps"));
  EXPECT_EQ(depth(capture_, {}).exit_code, 2);
  const fs::path maps = own_.path() / "maps";
  const ChildResult nowhere = depth(maps, {"--surface", (own_.path() / "no" / "a.ply").string()});
  EXPECT_EQ(nowhere.exit_code, 5);
  EXPECT_THAT(nowhere.err, HasSubstr("no such folder"));
  fs::create_directory(own_.path() / "folder.ply");
  EXPECT_EQ(depth(maps, {"--surface", (own_.path() / "folder.ply").string()}).exit_code, 2);
  EXPECT_FALSE(fs::exists(maps));  // all of it before the work
}

TEST_F(Reconstruct, HullSupport_ClosesWhatStereoDoesNotSee) {
  ASSERT_EQ(reconstruct().exit_code, 0);
  const Mesh open = scan();
  ASSERT_EQ(reconstruct({"--hull_support", "true"}).exit_code, 0);
  const Mesh closed = scan();
  const auto unseen = [](const Mesh& scan) { return (scan.confidence.array() == 0).count(); };
  EXPECT_GT(unseen(open), 0);  // a little beyond the last points
  EXPECT_GT(unseen(closed), 2 * unseen(open));
  EXPECT_GT(mesh_statistics(closed).area, mesh_statistics(open).area);
}

TEST_F(Reconstruct, LabelImageOfOtherSize_IsRefusedWithItsPlace) {
  write_labels(capture_ / "labels" / "01" / "000000.png", ByteImage(20, 30, 1, 1));
  const ChildResult result = reconstruct();
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, AllOf(HasSubstr("a label image of 20x30"),
                                HasSubstr("camera 01, frame 0"), HasSubstr("as the camera has")));
}

TEST_F(Reconstruct, FrameOfBlackImages_IsNamed) {
  for (const auto& camera : fs::directory_iterator(capture_ / "images")) {
    ByteImage image = read_byte_image(camera.path() / "000000.png");
    std::fill(image.data.begin(), image.data.end(), std::uint8_t{0});
    write_image(camera.path() / "000000.png", image);
  }
  const ChildResult result = reconstruct();
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, AllOf(HasSubstr("frame 0, views"), HasSubstr("with a subject in them")));
}

TEST_F(Reconstruct, LittleMemory_HalvesTheImages) {
  const ChildResult result = reconstruct({"--memory", "0.02"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("1/2 of their size"));
  EXPECT_GT(scan().faces.rows(), 100);
  EXPECT_EQ(reconstruct({"--memory", "0"}).exit_code, 2);
}

TEST_F(Reconstruct, BlackView_IsNamedAndLeftOut) {
  ByteImage image = read_byte_image(picture("02"));
  std::fill(image.data.begin(), image.data.end(), std::uint8_t{0});
  write_image(picture("02"), image);
  const ChildResult result = reconstruct();
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("view-black [02]"));
  EXPECT_GT(scan().faces.rows(), 500);
}

TEST_F(Reconstruct, MissingImage_LeavesTheOtherViews) {
  fs::remove(picture("05"));
  const ChildResult result = reconstruct();
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, AllOf(HasSubstr("view-missing [05]: no image of any of the 1 frames"),
                                HasSubstr("it is not used")));
  EXPECT_GT(scan().faces.rows(), 500);
}

TEST_F(Reconstruct, MissingMask_LeavesTheOtherViews) {
  fs::remove(capture_ / "labels" / "03" / "000000.png");
  const ChildResult result = reconstruct();
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("view-missing [03]: no mask and no labels of any"));
  EXPECT_GT(scan().faces.rows(), 500);
}

TEST_F(Reconstruct, TruncatedImage_IsRefused) {
  fs::resize_file(picture("01"), fs::file_size(picture("01")) / 2);
  const ChildResult result = reconstruct();
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("000000.png"));
  EXPECT_FALSE(fs::exists(workspace_ / "reconstruct" / "current"));
}

TEST_F(Reconstruct, SingleCameraOrNoMasks_IsRefused) {
  const ChildResult one = reconstruct({"--capture.leave_out", "00,01,02,03,04,05,06"});
  EXPECT_EQ(one.exit_code, 3);
  EXPECT_THAT(one.err, HasSubstr("at least two"));
  fs::remove_all(capture_ / "labels");
  fs::remove_all(capture_ / "keypoints2d");
  const ChildResult nothing = reconstruct();
  EXPECT_EQ(nothing.exit_code, 3);
  EXPECT_THAT(nothing.err, HasSubstr("neither masks nor labels"));
}

}  // namespace
}  // namespace atelier::fixtures

#endif
