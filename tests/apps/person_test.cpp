// The stages personalize, track and body on a small synthetic capture, and on what is wrong with
// real ones.
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL_TRACKING)

#include <map>

#include <gmock/gmock.h>

#include "bodymodel/formats/personal_body.h"
#include "core/io/ground_truth_archive.h"
#include "tests/apps/person_fixture.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

/// The scan once more, that far to the side.
void double_scan(Mesh& scan, double metres) {
  const Index count = scan.vertices.rows();
  Mesh both = scan;
  both.vertices.resize(2 * count, 3);
  both.vertices << scan.vertices, scan.vertices.rowwise() + Eigen::RowVector3d(metres, 0, 0);
  both.faces.resize(2 * scan.faces.rows(), 3);
  both.faces << scan.faces, scan.faces.array() + static_cast<int>(count);
  both.labels.insert(both.labels.end(), scan.labels.begin(), scan.labels.end());
  both.normals.resize(0, 3);
  both.colors.resize(0, 3);
  both.confidence.resize(0);
  scan = both;
}

/// What lies above the middle of the scan's height.
void keep_upper_half(Mesh& scan) {
  const double middle = scan.vertices.col(1).mean();
  std::vector<Index> kept;
  for (Index f = 0; f < scan.faces.rows(); ++f) {
    if (scan.vertices(scan.faces(f, 0), 1) > middle) {
      kept.push_back(f);
    }
  }
  scan.faces = Triangles(scan.faces(kept, Eigen::all));
}

/// Keypoints of a file, changed.
void change_keypoints(const fs::path& file, const std::function<void(nlohmann::json&)>& change) {
  nlohmann::json people = nlohmann::json::parse(read_text(file));
  for (nlohmann::json& person : people) {
    for (nlohmann::json& point : person["keypoints3d"]) {
      change(point);
    }
  }
  fs::remove(file);
  std::ofstream(file) << people;
}

void to_millimetres(nlohmann::json& point) {
  for (int axis = 0; axis < 3; ++axis) {
    point[axis] = 1000 * point[axis].get<double>();
  }
}

TEST_F(Person, CapturedPerson_IsTrackedMeasuredAndReported) {
  for (const char* stage : {"track", "body"}) {
    const ChildResult result = run_stage(stage);
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }
  const std::string workspace = workspace_.string();
  const ChildResult figures = run_child(
      {program_path(), "evaluate", workspace, "--ground-truth", capture().string(), "--json"});
  ASSERT_EQ(figures.exit_code, 0) << figures.err;
  for (const char* key : {"personal.mean_mm", "personal.joints_mm", "track.mean_mm",
                          "track.legs_mm", "body.mean_mm", "body.covered_mean_mm",
                          "body.outside_rate", "body.outside_depth_mm", "body.proximity_mm"}) {
    EXPECT_THAT(figures.out, HasSubstr(key));
  }
  const nlohmann::json values = nlohmann::json::parse(figures.out);
  EXPECT_LT(values.at("track.mean_mm"), 60);
  EXPECT_LT(values.at("body.mean_mm"), 30);
  const ChildResult one = run_child({program_path(), "evaluate", workspace, "--ground-truth",
                                     capture().string(), "--stage", "body", "--json"});
  EXPECT_THAT(one.out, HasSubstr("body.mean_mm"));
  EXPECT_THAT(one.out, Not(HasSubstr("track.mean_mm")));
  const ChildResult none = run_child({program_path(), "evaluate", workspace, "--ground-truth",
                                      capture().string(), "--stage", "export"});
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.err, HasSubstr("personalize"));
  ASSERT_EQ(run_child({program_path(), "report", workspace, "--ground-truth", capture().string()})
                .exit_code,
            0);
  const std::string page = read_text(workspace_ / "report" / "index.html");
  for (const char* words : {"Errors against the ground truth", "track.legs_mm", "certificates.png",
                            "pictures/clothed_frames.png"}) {
    EXPECT_THAT(page, HasSubstr(words));
  }
}

TEST_F(Person, NoMinimalSequence_UsesTheClothedOne) {
  const ChildResult result = run_stage(
      "personalize", {"--sequence", "clothed", "--shape-rounds", "1", "--surface-rounds", "1"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("is not minimally clothed: the shape comes from bare skin"));
  const ChildResult unknown = run_stage("personalize", {"--sequence", "naked"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err,
              HasSubstr("--sequence cannot be 'naked': it takes one of clothed, minimal"));
}

TEST_F(Person, ExclusionByLabelOrRegion_IsShown) {
  const ChildResult labels =
      run_stage("track", {"--exclude", "labels", "--input.excluded", "dress, outer"});
  ASSERT_EQ(labels.exit_code, 0) << labels.err;
  EXPECT_THAT(labels.err, Not(HasSubstr("label-nowhere")));
  EXPECT_THAT(labels.err, Not(HasSubstr("scan-far"))) << "what is left out is nobody else";
  const fs::path result = workspace_ / "track" / "current";
  const auto share = [&] {
    return read_manifest(fs::canonical(result), "track").metrics.at("region_share");
  };
  EXPECT_GT(share(), 0.2);
  EXPECT_LT(share(), 0.9);
  const auto metrics = read_manifest(fs::canonical(result), "track").metrics;
  EXPECT_GT(metrics.at("keypoint_rms_none"), 0) << "what leaving it out changes";
  EXPECT_NE(metrics.at("keypoint_rms_none"), metrics.at("keypoint_rms"));
  EXPECT_GT(metrics.at("scan_rms_none"), 0);
  EXPECT_GT(metrics.at("legs_moved_none"), 0);
  EXPECT_TRUE(fs::exists(result / "pictures" / "clothed_region.png"));
  std::ofstream(own_ / "region.json") << "[0, 1, 2, 3]";
  ASSERT_EQ(run_stage("track", {"--exclude", "region", "--region", (own_ / "region.json").string()})
                .exit_code,
            0);
  EXPECT_EQ(tracked().region, (std::vector<int>{0, 1, 2, 3}));
  const std::vector<std::string> again = {"--exclude", "region", "--region",
                                          (own_ / "region.json").string(), "--dry-run"};
  EXPECT_THAT(run_stage("track", again).out, HasSubstr("would do nothing"));
  std::ofstream(own_ / "region.json") << "[0, 1, 2]";
  EXPECT_THAT(run_stage("track", again).out, HasSubstr("would run")) << "painted anew";
  std::ofstream(own_ / "region.json") << "[0, 1, 2, 3]";
  EXPECT_TRUE(fs::exists(result / "pictures" / "clothed_region.png"));
  const std::string workspace = workspace_.string();
  ASSERT_EQ(run_child({program_path(), "report", workspace, "--ground-truth", capture().string()})
                .exit_code,
            0);
  const std::string page = read_text(workspace_ / "report" / "index.html");
  for (const char* words :
       {"clothed: the part of the body whose clothing does not count", "clothed_region.png",
        "track.legs_none_mm", "keypoint_rms_none", "legs_moved_none", "m, with nothing left out",
        "m, from where nothing is left out"}) {
    EXPECT_THAT(page, HasSubstr(words));
  }
}

TEST_F(Person, BodyUnderARegisteredGarment_IsRefined) {
  for (const char* stage : {"track", "body"}) {
    const ChildResult result = run_stage(stage);
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }
  ASSERT_EQ(evaluate({"--check", "--json"}).out.find("refine."), std::string::npos)
      << "nobody asked for it";
  const GroundTruth truth = read_ground_truth(capture());
  const auto write_garment = [&](const std::string& name, const std::vector<int>& ids, int shift,
                                 bool turned = false) {
    SequenceHeader header;
    header.fps = 12;
    header.shared.faces = truth.garments[0].garment.mesh.faces;
    if (turned) {
      header.shared.faces.col(1).swap(header.shared.faces.col(2));
    }
    fs::create_directories(own_ / name / "frames");
    for (const int id : ids) {
      header.frame_ids.push_back(id + shift);
      Mesh mesh;
      mesh.vertices = read_ground_truth_frame(capture(), truth, id).garments[0];
      write_mesh_archive(own_ / name / sequence_frame_path("", id + shift), mesh);
    }
    write_archive(own_ / name / "sequence.h5", archive_of(header));
    return (own_ / name).string();
  };
  const std::string garment = write_garment("garment", {0, 1}, 0);
  const auto refine = [&](const std::string& input) {
    return run_child({program_path(), "refine", input, workspace_.string()});
  };
  const ChildResult result = refine(garment);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto body = [&](const char* stage, int id) {
    return read_mesh_archive(workspace_ / stage / "current" / sequence_frame_path("", id)).vertices;
  };
  EXPECT_GT((body("refine", 0) - body("body", 0)).norm(), 0.01);
  EXPECT_EQ(body("refine", 2), body("body", 2)) << "without a garment the body stays";
  const nlohmann::json figures =
      nlohmann::json::parse(evaluate({"--check", "--json", "--targets", "accuracy"}).out);
  // No more vertices; the shares are of what is covered, which changes by a few.
  EXPECT_LE(figures.at("refine.outside_rate").get<double>(),
            1.01 * figures.at("body.outside_rate").get<double>());
  EXPECT_THAT(figures.at("check").dump(), HasSubstr("\"refine.outside_depth_mm\""));
  const Points upright = body("refine", 0);
  const ChildResult turned = refine(write_garment("turned", {0, 1}, 0, true));
  ASSERT_EQ(turned.exit_code, 0) << turned.err;
  EXPECT_THAT(turned.err + turned.out, HasSubstr("garment-turned"));
  EXPECT_EQ(body("refine", 0), upright);
  const ChildResult itself = refine((workspace_ / "body" / "current").string());
  EXPECT_EQ(itself.exit_code, 3);
  EXPECT_THAT(itself.err, HasSubstr("the body itself, a result of body"));
  fs::copy(fs::canonical(workspace_ / "body" / "current"), own_ / "copy",
           fs::copy_options::recursive);
  fs::remove(own_ / "copy" / "manifest.json");
  const ChildResult copied = refine((own_ / "copy").string());
  EXPECT_EQ(copied.exit_code, 3);
  EXPECT_THAT(copied.err, HasSubstr("those of the body itself"));
  const ChildResult none = refine((own_ / "nothing").string());
  EXPECT_EQ(none.exit_code, 3);
  EXPECT_THAT(none.err, HasSubstr("nothing there"));
  const std::string late = write_garment("later", {0, 1}, 100);
  const ChildResult later = refine(late);
  EXPECT_EQ(later.exit_code, 3);
  EXPECT_THAT(later.err, HasSubstr("none of the capture's"));
  for (const std::string& input : {capture().string(), (own_ / "copy").string(), late}) {
    const ChildResult dry =
        run_child({program_path(), "refine", input, workspace_.string(), "--dry-run"});
    EXPECT_EQ(dry.exit_code, 3) << input;
    EXPECT_THAT(refine(input).err, HasSubstr(dry.err.substr(0, dry.err.find('\n'))));
  }
}

TEST_F(Person, FrameSeenByNoCamera_IsReportedMissing) {
  const fs::path blind = own_.path() / "blind";
  fs::copy(capture(), blind, fs::copy_options::recursive);
  for (const auto& camera : fs::directory_iterator(blind / "keypoints2d")) {
    const fs::path file = camera.path() / (clothed_frame(1) + ".json");
    nlohmann::json people = nlohmann::json::parse(read_text(file));
    people["people"] = nlohmann::json::array();
    std::ofstream(file) << people;
  }
  fs::remove_all(blind / "labels");  // what keypoints alone show
  const std::string made = (own_.path() / "made").string();
  for (std::vector<std::string> step : std::vector<std::vector<std::string>>{
           {"reconstruct"},
           {"personalize", "--input.scans", "none", "--shape-rounds", "1"},
           {"track", "--input.scans", "none"},
           {"body", "--iterations", "2", "--gap-frames", "1"}}) {
    step.insert(step.begin() + 1, {blind.string(), made});
    step.insert(step.begin(), program_path());
    const ChildResult result = run_child(step);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    if (step[1] != "reconstruct") {
      const fs::path folder = fs::canonical(fs::path(made) / step[1] / "current");
      const auto metrics = read_manifest(folder, step[1]).metrics;
      for (const char* unmeasured : {"scan_rms", "displacement_rms", "outside_rate",
                                     "outside_depth", "proximity", "skin_distance"}) {
        EXPECT_FALSE(metrics.contains(unmeasured)) << step[1] << " " << unmeasured;
      }
    }
    if (step[1] == "body") {
      EXPECT_THAT(result.err, HasSubstr("no-scan [frames "));
      EXPECT_THAT(result.err, Not(HasSubstr("frame 1: ")));
    }
    if (step[1] == "track") {
      EXPECT_THAT(result.err + result.out, HasSubstr("keypoints-bridged"));
      EXPECT_THAT(result.err, HasSubstr("keypoints-missing [frames 1]"));
      EXPECT_THAT(result.err, HasSubstr("frame-untrusted [frames 1]"));
    }
  }
  const TrackedMotion found =
      read_tracked_motion(fs::path(made) / "track" / "current" / "tracked" / "clothed.h5");
  EXPECT_EQ(found.trusted, (std::vector<char>{1, 0, 1}));
  EXPECT_EQ(found.keypoint_rms[1], 0);
  EXPECT_GT(found.deviations.row(1).mean(), found.deviations.row(0).mean());
}

TEST_F(Person, FrameWithoutKeypoints_IsReported) {
  fs::remove(reconstructed("keypoints3d/" + clothed_frame(1) + ".json"));
  const ChildResult result = run_stage("track");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("keypoints-missing"));
  EXPECT_EQ(tracked().keypoint_rms[1], 0);
  EXPECT_GT(tracked().keypoint_rms[0], 0);
}

// Frames of a minimal sequence are a second apart, so that those around say little of a pose, and
// half of a scan is trunk and legs.
TEST_F(Person, MinimalFrameWithoutKeypoints_IsUntrustedIfMoved) {
  const TrackedMotion before =
      read_tracked_motion(workspace_ / "track" / "current" / "tracked" / "minimal.h5");
  fs::remove(reconstructed("keypoints3d/" + clothed_frame(4) + ".json"));
  const ChildResult result = run_stage("track");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const TrackedMotion after =
      read_tracked_motion(workspace_ / "track" / "current" / "tracked" / "minimal.h5");
  ASSERT_EQ(after.motion.frame_ids[1], 4);
  const double moved = (after.joints[1] - before.joints[1]).rowwise().norm().maxCoeff();
  EXPECT_EQ(after.trusted[1], moved < 0.1 ? 1 : 0) << moved;
  if (after.trusted[1] == 0) {
    EXPECT_THAT(result.err, HasSubstr("minimal: warning frame-untrusted [frames 4]"));
    EXPECT_GT(after.deviations.row(1).maxCoeff(), 0.1);
  }
}

// What a dress hides is not judged where it is left out, by label or since it swings, and a scan
// without labels is a garment all over. Scans of cameras this small confirm a pose or do not, by
// the seed: what they confirm is near what keypoints say, and the rest is told. Clean scans confirm
// every pose (scan_agreement_test.cpp, track_test.cpp).
TEST_F(Person, ClothedFrameWithoutKeypoints_IsRightOrUntrusted) {
  std::string said;
  const auto joints = [&](const char* exclude) {
    const ChildResult result = run_stage("track", {"--exclude", exclude, "--compare", "false"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    said = result.err;
    return tracked().joints[1];
  };
  const std::map<std::string, Points> whole = {{"labels", joints("labels")},
                                               {"auto", joints("auto")}};
  fs::remove(reconstructed("keypoints3d/" + clothed_frame(1) + ".json"));
  const auto expect_right_or_untrusted = [&](const char* exclude, double reach) {
    const Points found = joints(exclude);
    const TrackedMotion motion = tracked();
    EXPECT_EQ(motion.keypoint_rms[1], 0);
    const double moved = (found - whole.at(exclude)).rowwise().norm().maxCoeff();
    EXPECT_LT(moved, 2 * reach) << exclude;
    if (motion.trusted[1] != 0) {
      EXPECT_LT(moved, reach) << exclude;
      EXPECT_THAT(said, Not(HasSubstr("frame-untrusted")));
    } else {
      EXPECT_THAT(said, HasSubstr("frame-untrusted [frames 1]"));
      EXPECT_GT(motion.deviations.row(1).maxCoeff(), moved / 3) << exclude;
    }
  };
  expect_right_or_untrusted("labels", 0.1);
  expect_right_or_untrusted("auto", 0.1);
  for (std::size_t f = 0; f < 3; ++f) {
    change_scan(clothed_frame(f),
                [](Mesh& scan) { std::fill(scan.labels.begin(), scan.labels.end(), 0); });
  }
  expect_right_or_untrusted("auto", 0.15);  // clothing, which says less
}

TEST_F(Person, NoKeypointsAtAll_IsRefused) {
  for (std::size_t f = 0; f < 6; ++f) {
    fs::remove(reconstructed("keypoints3d/" + clothed_frame(f) + ".json"));
  }
  const ChildResult result = run_stage("track");
  EXPECT_EQ(result.exit_code, 3) << result.err;
  EXPECT_THAT(result.err, HasSubstr("no frame that shows a person, and no scan of one"));
}

// A thousand frames a second make of every motion one that no motion prior lets through.
TEST_F(Person, WrongFrameRate_IsReportedAndUntrusted) {
  const ChildResult result =
      run_stage("track", {"--input.capture.fps", "1000", "--input.scans", "none"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("keypoints-unmet"));
  EXPECT_THAT(result.err, HasSubstr("check that 1000 frames a second is right"));
  const TrackedMotion found = tracked();
  EXPECT_EQ(found.motion.fps, 1000);
  for (Index f = 0; f < found.deviations.rows(); ++f) {
    if (found.trusted[static_cast<std::size_t>(f)] == 0) {
      EXPECT_GE(found.deviations.row(f).minCoeff(), 0.06);
    }
  }
  EXPECT_THAT(found.trusted, ::testing::Contains(0));
}

TEST_F(Person, ScanInMillimetres_IsLeftOutThenRefused) {
  for (std::size_t f = 0; f < 2; ++f) {
    change_scan(clothed_frame(f), [](Mesh& scan) { scan.vertices *= 1000; });
  }
  const ChildResult result = run_stage("track");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("scan-unit [frames 0, 1]: a scan of "));
  EXPECT_THAT(result.err, HasSubstr("millimetres"));
  const ChildResult body = run_stage("body");
  EXPECT_EQ(body.exit_code, 3);
  EXPECT_THAT(body.err, HasSubstr("0.001"));
}

TEST_F(Person, HalfAScan_IsReportedAndUntrusted) {
  ASSERT_EQ(run_stage("track").exit_code, 0);
  const TrackedMotion whole = tracked();
  const double whole_ankle = whole.deviations(2, find_joint(whole.skeleton, "left_ankle"));
  const double whole_head = whole.deviations(2, find_joint(whole.skeleton, "head"));
  change_scan(clothed_frame(2), keep_upper_half);
  ASSERT_EQ(run_stage("track").exit_code, 0);
  EXPECT_EQ(tracked().trusted[2], 1);
  const auto uncertainty = [&](const char* name) {
    const TrackedMotion motion = tracked();
    return motion.deviations(2, find_joint(motion.skeleton, name));
  };
  EXPECT_GT(uncertainty("left_ankle"), 1.1 * whole_ankle) << "its deviations grow";
  EXPECT_LT(uncertainty("head"), 1.1 * whole_head) << "what is seen is as certain as before";
  const ChildResult body = run_stage("body");
  ASSERT_EQ(body.exit_code, 0) << body.err;
  EXPECT_THAT(body.err, HasSubstr("frame 2: warning little-seen"));
  const nlohmann::json certificate = certificates().at(clothed_frame(2));
  EXPECT_EQ(certificate.at("trusted"), false);
  EXPECT_THAT(certificate.at("findings").dump(), HasSubstr("little-seen"));
}

TEST_F(Person, ScansWithoutLabels_AreTreatedAsClothing) {
  for (std::size_t f = 0; f < 3; ++f) {
    change_scan(clothed_frame(f), [](Mesh& scan) { scan.labels.clear(); });
  }
  const ChildResult result = run_stage("track");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("labels-absent"));
  const ChildResult body = run_stage("body");
  ASSERT_EQ(body.exit_code, 0) << body.err;
  EXPECT_THAT(body.err, HasSubstr("no-skin"));
  EXPECT_THAT(certificates().at(clothed_frame(0)).at("findings").dump(), HasSubstr("no-skin"));
}

TEST_F(Person, AllZeroLabels_CountAsNoLabels) {
  for (std::size_t f = 0; f < 6; ++f) {
    change_scan(clothed_frame(f),
                [](Mesh& scan) { std::fill(scan.labels.begin(), scan.labels.end(), 0); });
  }
  const ChildResult tracked = run_stage("track");
  ASSERT_EQ(tracked.exit_code, 0) << tracked.err;
  EXPECT_THAT(tracked.err, HasSubstr("all is taken as clothing"));
  EXPECT_THAT(tracked.err,
              HasSubstr("minimal: note labels-absent [scans]: no point has a label; every point "
                        "is taken as skin"));
  EXPECT_THAT(tracked.err, Not(HasSubstr("scan-far")));
  const ChildResult person = run_stage(
      "personalize", {"--samples", "800", "--shape-rounds", "1", "--surface-rounds", "1"});
  ASSERT_EQ(person.exit_code, 0) << person.err;
  EXPECT_THAT(person.err, HasSubstr("labels-absent"));
  EXPECT_THAT(person.err, Not(HasSubstr("100% of the surface")));
  const auto metrics =
      read_manifest(fs::canonical(workspace_ / "personalize" / "current"), "personalize").metrics;
  EXPECT_GT(metrics.at("scan_rms"), 0);
  EXPECT_GT(metrics.at("displacement_rms"), 0);
}

TEST_F(Person, ScansOfAnotherPlace_AreReportedAndUnused) {
  for (std::size_t f = 0; f < 6; ++f) {
    change_scan(clothed_frame(f), [](Mesh& scan) { scan.vertices.col(0).array() += 3; });
  }
  const ChildResult person = run_stage("personalize", {"--shape-rounds", "1"});
  ASSERT_EQ(person.exit_code, 0) << person.err;
  EXPECT_THAT(person.err, HasSubstr("scan-far [frames 3, 4, 5]: up to 100%"));
  EXPECT_THAT(person.err, HasSubstr("no-scans"));
  const auto metrics =
      read_manifest(fs::canonical(workspace_ / "personalize" / "current"), "personalize").metrics;
  EXPECT_FALSE(metrics.contains("scan_rms"));
  EXPECT_FALSE(metrics.contains("displacement_rms"));
}

/// `personalize` on what is wrong with the minimal sequence, frames 3 to 5.
class MeasuredPerson : public Person {
 protected:
  ChildResult personalize(std::vector<std::string> more = {}) const {
    return run_stage(
        "personalize",
        with_usual({"--samples", "800", "--shape-rounds", "1", "--surface-rounds", "1"}, more));
  }
  std::map<std::string, double> metrics() const {
    return read_manifest(fs::canonical(workspace_ / "personalize" / "current"), "personalize")
        .metrics;
  }
  /// Mean distance of the person's vertices, m, from those of the person that all tests share.
  double moved() const {
    const auto vertices = [](const fs::path& workspace) {
      return read_personal_body(workspace / "personalize" / "current" / "person.npz")
          .model.mesh.vertices;
    };
    return (vertices(workspace_) - vertices(folder_->path() / "made")).rowwise().norm().mean();
  }
};

TEST_F(MeasuredPerson, ScanInMillimetres_IsLeftOut) {
  const auto to_millimetres = [](Mesh& scan) { scan.vertices *= 1000; };
  change_scan(frame_name(3), to_millimetres);
  const ChildResult one = personalize();
  ASSERT_EQ(one.exit_code, 0) << one.err;
  EXPECT_THAT(one.err, HasSubstr("scan-unit [frames 3]: scans of another size than a person has; "
                                 "left out; look whether they are in millimetres"));
  EXPECT_THAT(one.err, Not(HasSubstr("no-scans")));
  change_scan(frame_name(4), to_millimetres);
  change_scan(frame_name(5), to_millimetres);
  const ChildResult all = personalize();
  ASSERT_EQ(all.exit_code, 0) << all.err;
  EXPECT_THAT(all.err, HasSubstr("scan-unit [frames 3, 4, 5]"));
  EXPECT_THAT(all.err, HasSubstr("no-scans"));
  EXPECT_FALSE(metrics().contains("scan_rms"));
}

TEST_F(MeasuredPerson, HalfScannedBody_IsReportedUnseen) {
  for (int id = 3; id < 6; ++id) {
    change_scan(frame_name(id), keep_upper_half);
  }
  const ChildResult result = personalize();
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("surface-unseen"));
  EXPECT_GT(metrics().at("unseen_share"), 0.25);
  EXPECT_LT(moved(), 0.03);
}

TEST_F(MeasuredPerson, SecondPersonInScans_IsIgnored) {
  for (int id = 3; id < 6; ++id) {
    change_scan(frame_name(id), [](Mesh& scan) { double_scan(scan, 1); });
  }
  const ChildResult result = personalize();
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("scan-far [frames 3, 4, 5]: up to "));
  EXPECT_LT(moved(), 0.02);
}

TEST_F(MeasuredPerson, UnlabelledClothing_GivesNoSurface) {
  for (std::size_t f = 0; f < 3; ++f) {
    change_scan(clothed_frame(f), [](Mesh& scan) { scan.labels.clear(); });
  }
  const ChildResult result = personalize({"--sequence", "clothed"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("surface-unseen"));
  EXPECT_NEAR(metrics().at("unseen_share"), 1, 1e-9);
}

TEST_F(MeasuredPerson, FrameWithoutKeypoints_IsLeftOut) {
  fs::remove(reconstructed("keypoints3d/" + frame_name(4) + ".json"));
  const ChildResult one = personalize();
  ASSERT_EQ(one.exit_code, 0) << one.err;
  EXPECT_THAT(one.err, HasSubstr("frame-untrusted [frames 4]: too few keypoints, or they "
                                 "contradict each other; left out of the person's measures"));
  fs::remove(reconstructed("keypoints3d/" + frame_name(3) + ".json"));
  fs::remove(reconstructed("keypoints3d/" + frame_name(5) + ".json"));
  const ChildResult none = personalize();
  EXPECT_EQ(none.exit_code, 3);
  EXPECT_THAT(none.err, HasSubstr("keypoints"));
}

TEST_F(MeasuredPerson, KeypointsInMillimetres_AreNamedAndLeftOut) {
  const auto keypoints = [&](int id) {
    return reconstructed("keypoints3d/" + frame_name(id) + ".json");
  };
  change_keypoints(keypoints(4), to_millimetres);
  const ChildResult one = personalize();
  ASSERT_EQ(one.exit_code, 0) << one.err;
  EXPECT_THAT(one.err, HasSubstr("keypoint-unit [frames 4]: half of the keypoints are "));
  EXPECT_THAT(one.err, HasSubstr("look whether they are in millimetres"));
  EXPECT_THAT(one.err, Not(HasSubstr("frame-untrusted"))) << "said already";
  EXPECT_LT(moved(), 0.02);
  change_keypoints(keypoints(3), to_millimetres);
  change_keypoints(keypoints(5), to_millimetres);
  const ChildResult all = personalize();
  EXPECT_EQ(all.exit_code, 3);
  EXPECT_THAT(all.err, HasSubstr("keypoint-unit [frames 3, 4, 5]"));
}

TEST_F(MeasuredPerson, KeypointsInKilometres_AreNotCalledMillimetres) {
  change_keypoints(reconstructed("keypoints3d/" + frame_name(4) + ".json"),
                   [](nlohmann::json& point) {
                     for (int axis = 0; axis < 3; ++axis) {
                       point[axis] = point[axis].get<double>() / 1000;
                     }
                   });
  const ChildResult result = personalize();
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("keypoint-unit [frames 4]: half of the keypoints are as little "
                                    "as 0.000"));
  EXPECT_THAT(result.err, HasSubstr("kilometres"));
  EXPECT_THAT(result.err, Not(HasSubstr("millimetres")));
}

TEST_F(Person, KeypointsInMillimetres_AreNamedAndTheScanIsUsed) {
  change_keypoints(reconstructed("keypoints3d/" + clothed_frame(1) + ".json"), to_millimetres);
  const ChildResult one = run_stage("track");
  ASSERT_EQ(one.exit_code, 0) << one.err;
  EXPECT_THAT(one.err, HasSubstr("clothed: warning keypoint-unit [frames 1]: half of the "));
  EXPECT_THAT(one.err, Not(HasSubstr("keypoints-missing"))) << "said already";
  EXPECT_EQ(tracked().keypoint_rms[1], 0);
  EXPECT_GT(tracked().keypoint_rms[0], 0);
  const Points joints = tracked().joints[1];
  EXPECT_LT((joints - tracked().joints[0]).rowwise().norm().mean(), 0.5) << "no kilometre off";
}

TEST_F(Person, SecondPersonInAScan_LeavesTheBodyUnchanged) {
  ASSERT_EQ(run_stage("body").exit_code, 0);
  const auto body = [&](int id) {
    return read_mesh_archive(workspace_ / "body" / "current" / sequence_frame_path("", id))
        .vertices;
  };
  const Points alone = body(1);
  change_scan(clothed_frame(1), [](Mesh& scan) { double_scan(scan, 1.5); });
  const ChildResult result = run_stage("body");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("scan-far [frames 1]: up to "));
  EXPECT_THAT(result.err, HasSubstr("not part of the person and is ignored"));
  EXPECT_LT((body(1) - alone).rowwise().norm().maxCoeff(), 1e-3);
  EXPECT_EQ(certificates().at(clothed_frame(1)).at("trusted"),
            certificates().at(clothed_frame(0)).at("trusted"));
}

TEST_F(Person, BodyOfAnUnseenFrame_IsUntrusted) {
  fs::remove(reconstructed("keypoints3d/" + clothed_frame(1) + ".json"));
  fs::remove(reconstructed("scans/" + clothed_frame(1) + ".h5"));
  const ChildResult followed = run_stage("track");
  ASSERT_EQ(followed.exit_code, 0) << followed.err;
  EXPECT_THAT(followed.err, HasSubstr("keypoints-missing [frames 1]"));
  EXPECT_THAT(followed.err, HasSubstr("frame-untrusted [frames 1]"));
  const ChildResult result = run_stage("body");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("no-scan [frames 1]: there is no scan"));
  EXPECT_THAT(result.err, HasSubstr("tracking [frames 1]: tracking marked the pose as unreliable"));
  const nlohmann::json certificate = certificates().at(clothed_frame(1));
  EXPECT_EQ(certificate.at("trusted"), false);
  EXPECT_THAT(certificate.at("findings").dump(), HasSubstr("\"tracking\""));
}

TEST_F(Person, LabelExclusionWithoutScans_ExcludesNothing) {
  const ChildResult result = run_stage("track", {"--exclude", "labels", "--input.scans", "none"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err,
              HasSubstr("clothed: warning no-scans [scans]: there are no scans, so clothing cannot "
                        "be left out by its labels; nothing is left out"));
}

TEST_F(Person, TwoPeople_AreToldApart) {
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
    change_scan(clothed_frame(f), [](Mesh& scan) { double_scan(scan, 1); });
  }
  const ChildResult result = run_stage("track");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("scan-far"));
  EXPECT_THAT(result.err, HasSubstr("people-several [frames 0, 1, 2]: keypoints show up to 2"));
  for (std::size_t f = 0; f < 3; ++f) {
    // The other person is a metre off; samples of the scan fall elsewhere, which moves joints too.
    EXPECT_LT((tracked().joints[f] - alone.joints[f]).rowwise().norm().mean(), 0.05);
  }
  ASSERT_EQ(run_stage("track", {"--input.person", "1", "--input.scans", "none"}).exit_code, 0);
  EXPECT_NEAR(tracked().joints[0](0, 0), alone.joints[0](0, 0) + 2, 0.05);
  const ChildResult nobody = run_stage("track", {"--input.person", "5"});
  EXPECT_EQ(nobody.exit_code, 2);
  EXPECT_THAT(nobody.err, HasSubstr("they show 2 people: 0, 1"));
}

// What only the keypoints of a capture tell, or its sequences, a dry run says as well.
TEST_F(Person, DryRun_RefusesWhatTheRunWouldRefuse) {
  std::ofstream(own_ / "region.json") << "[0, 99999999]";
  const std::string beyond = (own_ / "region.json").string();
  const std::vector<std::pair<int, std::vector<std::string>>> calls = {
      {2, {"personalize", "--sequence", "naked"}},
      {2, {"personalize", "--input.person", "5"}},
      {3, {"personalize", "--body", "nowhere.npz"}},
      {2, {"track", "--input.person", "5"}},
      {2, {"track", "--exclude", "region", "--region", "tail"}},
      {3, {"track", "--exclude", "region", "--region", beyond}}};
  for (const auto& [code, call] : calls) {
    SCOPED_TRACE(call[0] + " " + call[1] + " " + call.back());
    std::vector<std::string> more(call.begin() + 1, call.end());
    const ChildResult run = run_stage(call[0], more);
    more.emplace_back("--dry-run");
    const ChildResult dry = run_stage(call[0], more);
    EXPECT_EQ(run.exit_code, code);
    EXPECT_EQ(dry.exit_code, run.exit_code);
    EXPECT_THAT(run.err, HasSubstr(dry.err.substr(0, dry.err.find('\n'))));
    EXPECT_THAT(dry.out, Not(HasSubstr("would run")));
  }
  EXPECT_THAT(run_stage("track", {"--input.person", "0", "--samples", "500", "--dry-run"}).out,
              HasSubstr("would run"));
  // Where surfaces and keypoints are recomputed first, nobody knows yet who they show.
  const ChildResult chain =
      run_child({program_path(), "run", capture().string(), workspace_.string(), "--to", "track",
                 "--dry-run", "--track.input.person", "5"});
  EXPECT_EQ(chain.exit_code, 0) << chain.err;
  EXPECT_THAT(chain.out, HasSubstr("would run"));
}

TEST_F(Person, WrongCalls_AreRefused) {
  const ChildResult region = run_stage("track", {"--exclude", "region", "--region", "tail"});
  EXPECT_EQ(region.exit_code, 2);
  EXPECT_THAT(region.err, HasSubstr("tail"));
  EXPECT_THAT(region.err, HasSubstr("one of the body's groups: "));
  const ChildResult person = run_stage("personalize", {"--input.person", "5"});
  EXPECT_EQ(person.exit_code, 2);
  EXPECT_THAT(person.err, HasSubstr("they show 1 person: 0"));
  const ChildResult facts = run_child(
      {program_path(), "inspect", (workspace_ / "personalize/current/person.npz").string()});
  EXPECT_THAT(facts.out, HasSubstr("vertex groups"));
  std::ofstream(own_ / "region.json") << "[0, 99999999]";
  const ChildResult beyond =
      run_stage("track", {"--exclude", "region", "--region", (own_ / "region.json").string()});
  EXPECT_EQ(beyond.exit_code, 3);
  EXPECT_THAT(beyond.err, HasSubstr("region: 99999999; expected vertices of the body"));
  std::ofstream(own_ / "region.json") << "[]";
  const ChildResult empty =
      run_stage("track", {"--exclude", "region", "--region", (own_ / "region.json").string()});
  EXPECT_EQ(empty.exit_code, 3);
  EXPECT_THAT(empty.err, HasSubstr("region: no vertex"));
  for (const char* name : {"hat", "skin", "dress, hair"}) {
    const ChildResult label = run_stage("track", {"--exclude", "labels", "--input.excluded", name});
    EXPECT_EQ(label.exit_code, 2) << name;
    EXPECT_THAT(label.err, HasSubstr("names of labels"));
  }
  const ChildResult nothing = run_stage("track", {"--exclude", "labels", "--input.excluded", ""});
  EXPECT_EQ(nothing.exit_code, 2);
  EXPECT_THAT(nothing.err, HasSubstr("exclude labels takes --input.excluded"));
  const ChildResult unsaid = run_stage("track", {"--exclude", "region"});
  EXPECT_EQ(unsaid.exit_code, 2);
  EXPECT_THAT(unsaid.err, HasSubstr("exclude region takes --region"));
  const ChildResult idle = run_stage("track", {"--region", "tail"});
  EXPECT_EQ(idle.exit_code, 2);
  EXPECT_THAT(idle.err, HasSubstr("region does nothing with exclude auto"));
  const ChildResult idler =
      run_stage("track", {"--exclude", "none", "--dynamic.swing", "0.02", "--compare", "false"});
  EXPECT_EQ(idler.exit_code, 2);
  EXPECT_THAT(idler.err, HasSubstr("--dynamic.swing does nothing with --exclude none"));
  EXPECT_THAT(idler.err, HasSubstr("--compare does nothing with --exclude none"));
}

}  // namespace
}  // namespace atelier::fixtures

#endif
