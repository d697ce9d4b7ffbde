// The stages personalize, track and body on a small synthetic capture, and on what is wrong with
// real ones.
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL_TRACKING)

#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/tracked_motion.h"
#include "capture/truth_archive.h"
#include "core/sequence_archive.h"
#include "core/sha256.h"
#include "core/store/manifest.h"
#include "core/store/result.h"
#include "tests/support/child_process.h"
#include "tests/support/flags.h"
#include "tests/support/places.h"
#include "tests/support/read_text.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

/// A capture with its scans, keypoints and person for all tests of this file; a copy of the
/// workspace for each.
class Person : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryDirectory;
    const std::string capture = (folder_->path() / "capture").string();
    const std::string made = (folder_->path() / "made").string();
    const std::vector<std::vector<std::string>> steps = {
        {"synthesize",
         capture,
         "--dome.cameras",
         "8",
         "--dome.width",
         "180",
         "--dome.height",
         "240",
         "--frames",
         "3",
         "--minimal_frames",
         "3",
         "--held_out_cameras",
         "0",
         "--held_out_share",
         "0",
         "--edge_length",
         "0.05",
         "--substeps",
         "6",
         "--fabric.resolution",
         "256",
         "--skin_resolution",
         "256",
         "--samples",
         "2"},
        {"reconstruct", capture, made, "--surface.octree_depth", "6", "--surface.edge_length",
         "0.03"},
        {"personalize", capture, made, "--samples", "800", "--shape-rounds", "2",
         "--surface-rounds", "1"}};
    for (std::vector<std::string> step : steps) {
      step.insert(step.begin(), program_path());
      made_ = run_child(step);
      if (made_.exit_code != 0) {
        return;
      }
    }
  }
  static void TearDownTestSuite() { delete folder_; }

  void SetUp() override {
    ASSERT_EQ(made_.exit_code, 0) << made_.err;
    fs::copy(folder_->path() / "made", workspace_,
             fs::copy_options::recursive | fs::copy_options::copy_symlinks);
  }
  static fs::path capture() { return folder_->path() / "capture"; }
  fs::path reconstructed(const std::string& file) const {
    return workspace_ / "reconstruct" / "current" / file;
  }
  /// The manifest says what the changed files of `reconstruct` are now: as if that stage had made
  /// them so.
  void sign_reconstruct() const {
    const fs::path folder = fs::canonical(workspace_ / "reconstruct" / "current");
    Manifest manifest = read_manifest(folder, "reconstruct");
    std::erase_if(manifest.outputs,
                  [&](const ManifestOutput& output) { return !fs::exists(folder / output.path); });
    for (ManifestOutput& output : manifest.outputs) {
      const std::string bytes = read_text(folder / output.path);
      output.size = static_cast<std::int64_t>(bytes.size());
      output.digest = sha256(bytes);
    }
    std::ofstream(folder / "manifest.json") << manifest_text(manifest);
  }
  ChildResult run_stage(const std::string& stage, std::vector<std::string> more = {}) const {
    sign_reconstruct();
    std::vector<std::string> command = {program_path(), stage, capture().string(),
                                        workspace_.string()};
    if (stage == "track") {
      more = fixtures::with_usual({"--samples", "600", "--rounds", "3"}, more);
    }
    if (stage == "body") {
      more = fixtures::with_usual({"--iterations", "2", "--gap-frames", "1"}, more);
    }
    command.insert(command.end(), more.begin(), more.end());
    return run_child(command);
  }
  TrackedMotion tracked() const {
    return read_tracked_motion(workspace_ / "track" / "current" / "tracked" / "clothed.h5");
  }
  nlohmann::json certificates() const {
    return nlohmann::json::parse(read_text(workspace_ / "body" / "current" / "certificates.json"));
  }
  /// A frame of the clothed sequence, as its files are named.
  static std::string clothed_frame(std::size_t f) { return frame_name(static_cast<int>(f)); }
  void change_scan(const std::string& frame, const std::function<void(Mesh&)>& change) const {
    const fs::path file = reconstructed("scans/" + frame + ".h5");
    Mesh scan = read_mesh_archive(file);
    change(scan);
    fs::remove(file);
    write_mesh_archive(file, scan);
  }

  static TemporaryDirectory* folder_;
  static ChildResult made_;
  TemporaryDirectory own_;
  fs::path workspace_ = own_.path() / "workspace";
};

TemporaryDirectory* Person::folder_ = nullptr;
ChildResult Person::made_;

TEST_F(Person, IsFollowedMeasuredAndReported) {
  for (const char* stage : {"track", "body"}) {
    const ChildResult result = run_stage(stage);
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }
  const std::string workspace = workspace_.string();
  const ChildResult figures =
      run_child({program_path(), "evaluate", workspace, "--truth", capture().string(), "--json"});
  ASSERT_EQ(figures.exit_code, 0) << figures.err;
  for (const char* key : {"personal.mean_mm", "personal.joints_mm", "track.mean_mm",
                          "track.legs_mm", "body.mean_mm", "body.covered_mean_mm",
                          "body.outside_rate", "body.outside_depth_mm", "body.proximity_mm"}) {
    EXPECT_THAT(figures.out, HasSubstr(key));
  }
  const nlohmann::json values = nlohmann::json::parse(figures.out);
  EXPECT_LT(values.at("track.mean_mm"), 60);
  EXPECT_LT(values.at("body.mean_mm"), 30);
  const ChildResult one = run_child({program_path(), "evaluate", workspace, "--truth",
                                     capture().string(), "--stage", "body", "--json"});
  EXPECT_THAT(one.out, HasSubstr("body.mean_mm"));
  EXPECT_THAT(one.out, Not(HasSubstr("track.mean_mm")));
  const ChildResult none = run_child(
      {program_path(), "evaluate", workspace, "--truth", capture().string(), "--stage", "export"});
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.err, HasSubstr("personalize"));
  ASSERT_EQ(
      run_child({program_path(), "report", workspace, "--truth", capture().string()}).exit_code, 0);
  const std::string page = read_text(workspace_ / "report" / "index.html");
  for (const char* words :
       {"Against the truth", "track.legs_mm", "certificates.png", "pictures/clothed_frames.png"}) {
    EXPECT_THAT(page, HasSubstr(words));
  }
}

TEST_F(Person, WithoutAMinimalSequenceIsMeasuredOnAClothedOne) {
  const ChildResult result = run_stage(
      "personalize", {"--sequence", "clothed", "--shape-rounds", "1", "--surface-rounds", "1"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("not minimally clothed: shape from skin and keypoints"));
  const ChildResult unknown = run_stage("personalize", {"--sequence", "naked"});
  EXPECT_EQ(unknown.exit_code, 3);
  EXPECT_THAT(unknown.err, HasSubstr("one of clothed, minimal"));
}

TEST_F(Person, AFrameWithoutKeypointsIsSaid) {
  fs::remove(reconstructed("keypoints3d/" + clothed_frame(1) + ".json"));
  const ChildResult result = run_stage("track");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("keypoints-missing"));
  EXPECT_EQ(tracked().keypoint_rms[1], 0);
  EXPECT_GT(tracked().keypoint_rms[0], 0);
}

TEST_F(Person, AScanInMillimetresIsLeftOutAndThenRefused) {
  change_scan(clothed_frame(0), [](Mesh& scan) { scan.vertices *= 1000; });
  const ChildResult result = run_stage("track");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("scan-unit"));
  EXPECT_THAT(result.err, HasSubstr("millimetres"));
  const ChildResult body = run_stage("body");
  EXPECT_EQ(body.exit_code, 3);
  EXPECT_THAT(body.err, HasSubstr("0.001"));
}

TEST_F(Person, HalfAScanIsSaidAndNotTrusted) {
  change_scan(clothed_frame(2), [](Mesh& scan) {
    const double middle = scan.vertices.col(1).mean();
    std::vector<Index> kept;
    for (Index f = 0; f < scan.faces.rows(); ++f) {
      if (scan.vertices(scan.faces(f, 0), 1) > middle) {
        kept.push_back(f);
      }
    }
    scan.faces = Triangles(scan.faces(kept, Eigen::all));
  });
  ASSERT_EQ(run_stage("track").exit_code, 0);
  EXPECT_EQ(tracked().trusted[2], 1);
  ASSERT_EQ(run_stage("body").exit_code, 0);
  const nlohmann::json certificate = certificates().at(clothed_frame(2));
  EXPECT_EQ(certificate.at("trusted"), false);
  EXPECT_THAT(certificate.at("findings").dump(), HasSubstr("little-seen"));
}

TEST_F(Person, ScansWithoutLabelsAreClothing) {
  for (std::size_t f = 0; f < 3; ++f) {
    change_scan(clothed_frame(f), [](Mesh& scan) { scan.labels.clear(); });
  }
  const ChildResult result = run_stage("track");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("labels-absent"));
  ASSERT_EQ(run_stage("body").exit_code, 0);
  EXPECT_THAT(certificates().at(clothed_frame(0)).at("findings").dump(), HasSubstr("no-skin"));
}

TEST_F(Person, TwoPeopleAreToldApart) {
  ASSERT_EQ(run_stage("track").exit_code, 0);
  const TrackedMotion alone = tracked();
  for (const auto& entry : fs::directory_iterator(reconstructed("keypoints3d"))) {
    nlohmann::json people = nlohmann::json::parse(read_text(entry.path()));
    nlohmann::json other = people[0];
    other["id"] = 1;
    for (auto& point : other["keypoints3d"]) {
      point[0] = point[0].get<double>() + 2;
    }
    people.push_back(other);
    fs::remove(entry.path());
    std::ofstream(entry.path()) << people;
  }
  for (std::size_t f = 0; f < 3; ++f) {  // and in the scans, a metre beside
    change_scan(clothed_frame(f), [](Mesh& scan) {
      const Index count = scan.vertices.rows();
      Mesh both = scan;
      both.vertices.resize(2 * count, 3);
      both.vertices << scan.vertices, scan.vertices.rowwise() + Eigen::RowVector3d(1, 0, 0);
      both.faces.resize(2 * scan.faces.rows(), 3);
      both.faces << scan.faces, scan.faces.array() + static_cast<int>(count);
      both.labels.insert(both.labels.end(), scan.labels.begin(), scan.labels.end());
      both.normals.resize(0, 3);
      both.colors.resize(0, 3);
      both.confidence.resize(0);
      scan = both;
    });
  }
  const ChildResult result = run_stage("track");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("scan-far"));
  for (std::size_t f = 0; f < 3; ++f) {
    // The other person is a metre off; samples of the scan fall elsewhere, which moves joints too.
    EXPECT_LT((tracked().joints[f] - alone.joints[f]).rowwise().norm().mean(), 0.05);
  }
  ASSERT_EQ(run_stage("track", {"--input.person", "1", "--input.scans", "none"}).exit_code, 0);
  EXPECT_NEAR(tracked().joints[0](0, 0), alone.joints[0](0, 0) + 2, 0.05);
}

TEST_F(Person, WrongCallsAreRefused) {
  const ChildResult region = run_stage("track", {"--exclude", "region", "--region", "tail"});
  EXPECT_EQ(region.exit_code, 3);
  EXPECT_THAT(region.err, HasSubstr("tail"));
  std::ofstream(own_ / "region.json") << "[0, 99999999]";
  const ChildResult beyond =
      run_stage("track", {"--exclude", "region", "--region", (own_ / "region.json").string()});
  EXPECT_EQ(beyond.exit_code, 3);
  EXPECT_THAT(beyond.err, HasSubstr("vertices of the body"));
  const ChildResult label = run_stage("track", {"--exclude", "labels", "--input.excluded", "hat"});
  EXPECT_EQ(label.exit_code, 3);
  EXPECT_THAT(label.err, HasSubstr("names of labels"));
}

}  // namespace
}  // namespace atelier::fixtures

#endif
