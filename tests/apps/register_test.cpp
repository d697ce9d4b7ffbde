// The stage `register` on three frames of a trunk in a skirt, what is missing of them, and how its
// result and that of `flatten` are measured against the truth.
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL)

#include <cmath>
#include <csignal>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/io/file_bytes.h"
#include "core/io/mesh_file.h"
#include "core/io/mesh_obj.h"
#include "core/store/write_text.h"
#include "registration/tracking/followed_frame.h"
#include "tests/apps/dressed_workspace.h"
#include "tests/apps/program_versions.h"
#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

/// The frames that stages before leave out, since a stage is a plain function.
struct Missing {
  int scan = -1;
  bool last_body = false;
  bool labels = false;
};
Missing missing;

/// Skin and skirt of a frame as one labelled surface.
Mesh labelled_scan(std::size_t frame) {
  const Mesh trunk = trunk_body().mesh;
  const Mesh skirt = tube_skirt().mesh;
  const Points body = walking_trunk()[frame];
  const Points cloth = walking_skirt()[frame];
  Mesh scan;
  scan.vertices.resize(body.rows() + cloth.rows(), 3);
  scan.vertices << body, cloth;
  scan.faces.resize(trunk.faces.rows() + skirt.faces.rows(), 3);
  scan.faces << trunk.faces, (skirt.faces.array() + static_cast<int>(body.rows())).matrix();
  scan.labels.assign(static_cast<std::size_t>(body.rows()), static_cast<std::uint8_t>(Label::Skin));
  scan.labels.resize(static_cast<std::size_t>(scan.vertices.rows()),
                     static_cast<std::uint8_t>(missing.labels ? Label::Skin : Label::Lower));
  return scan;
}

const Stage& dressed_stage(const std::string& name) {
  return *std::find_if(kDressedStages.begin(), kDressedStages.end(),
                       [&](const Stage& stage) { return stage.name == name; });
}

const std::array<Stage, 3> kBeforeRegister = {
    Stage{.name = "reconstruct",
          .summary = "labelled scans",
          .inputs = {"capture"},
          .outputs = {"scans"},
          .options = option_set<NoOptions>,
          .run =
              [](StageRun& run) {
                for (int id = 0; id < 3; ++id) {
                  if (id != missing.scan) {
                    run.output("scans/" + frame_name(id) + ".h5", [&](const auto& file) {
                      write_mesh_archive(file, labelled_scan(static_cast<std::size_t>(id)));
                    });
                  }
                }
              }},
    Stage{.name = "body",
          .summary = "the trunk",
          .inputs = {"capture"},
          .outputs = {"bodies"},
          .options = option_set<NoOptions>,
          .run =
              [](StageRun& run) {
                std::vector<Points> bodies = walking_trunk();
                bodies.resize(missing.last_body ? 2 : 3);
                write_meshes(run, "", trunk_body().mesh.faces, bodies);
              }},
    dressed_stage("template"),
};

/// A tube sewn along one line, whose flat panel is a rectangle.
GroundTruthGarment sewn_tube(const std::string& name, Label label, double height) {
  constexpr int kRound = 12;
  constexpr int kRings = 4;
  constexpr double kRadius = 0.2;
  const double chord = 2 * kRadius * std::sin(std::numbers::pi / kRound);
  GroundTruthGarment truth;
  truth.label = label;
  Garment& garment = truth.garment;
  garment.name = name;
  garment.panel_names = {"sheet"};
  garment.mesh.vertices.resize(kRound * kRings, 3);
  garment.mesh.faces.resize(2 * kRound * (kRings - 1), 3);
  garment.rest.resize((kRound + 1) * kRings, 2);
  garment.rest_faces.resize(garment.mesh.faces.rows(), 3);
  garment.panels.assign(static_cast<std::size_t>(garment.mesh.faces.rows()), 0);
  Seam seam;
  seam.name = "side";
  Index face = 0;
  for (int r = 0; r < kRings; ++r) {
    const double y = height * r / (kRings - 1);
    for (int i = 0; i <= kRound; ++i) {
      const double angle = 2 * std::numbers::pi * i / kRound;
      garment.mesh.vertices.row(r * kRound + i % kRound) << kRadius * std::sin(angle), y,
          kRadius * std::cos(angle);
      garment.rest.row(r * (kRound + 1) + i) << chord * i, y;
    }
    seam.a.push_back(r * (kRound + 1));
    seam.b.push_back(r * (kRound + 1) + kRound);
    for (int i = 0; i < kRound && r + 1 < kRings; ++i) {
      const int a = r * kRound + i;
      const int b = r * kRound + (i + 1) % kRound;
      const int flat = r * (kRound + 1) + i;
      const int up = flat + kRound + 1;
      garment.mesh.faces.row(face) << a, b, b + kRound;
      garment.rest_faces.row(face++) << flat, flat + 1, up + 1;
      garment.mesh.faces.row(face) << a, b + kRound, a + kRound;
      garment.rest_faces.row(face++) << flat, up + 1, up;
    }
  }
  truth.seams = {seam};
  return truth;
}

/// Its mesh as `flatten` leaves it: the pattern is its texture coordinates.
void write_flat(StageRun& run, const std::string& label, double height) {
  const Garment garment = sewn_tube(label, Label::Unknown, height).garment;
  Mesh mesh = garment.mesh;
  mesh.uvs = garment.rest;
  mesh.uv_faces = garment.rest_faces;
  run.output(label + "/garment.obj",
             [&](const auto& file) { write_text(file, obj_text(polygons_of(mesh))); });
}

/// m/s2: how the measured skirts were held up by their motion.
double cloth_motion = 0.3;

/// How far the registered skirt is turned off the true one, rad.
constexpr double kTurned = 0.01;

constexpr std::array kSeamMetric = {
    StageMetric{"seam_mismatch", ""}, StageMetric{"corners_max", ""}, StageMetric{"sewn_mean", "m"},
    StageMetric{"sewn_p95", "m"},     StageMetric{"sewn_motion", ""},
};

constexpr std::array kMeasured = {
    Stage{.name = "register",
          .summary = "a skirt that has slid round the trunk",
          .inputs = {"capture"},
          .outputs = {"registered"},
          .options = option_set<NoOptions>,
          .run =
              [](StageRun& run) {
                std::vector<Points> skirts = walking_skirt();
                for (std::size_t i = 1; i < skirts.size(); ++i) {
                  const Eigen::RowVector3d middle(0, 0, 0.02 * static_cast<double>(i));
                  const Eigen::AngleAxisd turn(kTurned, Eigen::Vector3d::UnitY());
                  skirts[i] = ((skirts[i].rowwise() - middle) * turn.toRotationMatrix().transpose())
                                  .rowwise() +
                              middle;
                }
                write_meshes(run, "registered/lower", tube_skirt().mesh.faces, skirts);
                run.output("registered/lower/template.h5",
                           [](const auto& file) { write_mesh_archive(file, tube_skirt().mesh); });
                run.output_text("figures.json", R"({"lower": {"template_frame": 0, "frames": {
                  "000000": {"inside": 0.03}, "000001": {"inside": 0}, "000002": {}}}})");
              }},
    Stage{.name = "flatten",
          .summary = "two patterns, the shorter one nearer to the other one's area",
          .inputs = {"capture"},
          .outputs = {"pattern"},
          .metrics = kSeamMetric,
          .options = option_set<NoOptions>,
          .run =
              [](StageRun& run) {
                write_flat(run, "lower", 0.62);
                write_flat(run, "upper", 0.7);
                run.metric("seam_mismatch", 0.0018);  // as drawn: smoothed
                run.metric("corners_max", 9);
                run.metric("sewn_mean", 0.004);
                run.metric("sewn_p95", 0.013);
                run.metric("sewn_motion", cloth_motion);
              }},
};

class Register : public ::testing::Test {
 protected:
  void SetUp() override {
    missing = {};
    if (run({"register", "--help"}).out.find("--photometric") == std::string::npos) {
      GTEST_SKIP() << "built without register";
    }
    SmallCapture small;
    small.frames = {0, 1, 2};
    write_small_capture(capture(), small);
  }

  static ChildResult run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), program_path());
    return run_child(arguments);
  }
  template <class Stages>
  void make(const Stages& stages, const fs::path& workspace) const {
    const std::vector<Stage> all = with_program_versions(stages);
    for (const Stage& stage : all) {
      StageRequest request;
      request.input = capture();
      request.workspace = workspace;
      request.options = stage.options();
      run_stage(all, stage, request);
    }
  }
  /// The stage after those before it.
  ChildResult registered(const std::vector<std::string>& more = {},
                         const std::string& workspace = "work") const {
    make(kBeforeRegister, root_ / workspace);
    std::vector<std::string> all{"register", capture().string(), (root_ / workspace).string(),
                                 "--rounds", "3"};
    all.insert(all.end(), more.begin(), more.end());
    return run(all);
  }
  nlohmann::json manifest(const std::string& workspace = "work") const {
    return nlohmann::json::parse(
        read_file_text(root_ / workspace / "register" / "current" / "manifest.json", 1 << 20));
  }
  void write_truth(const std::vector<GroundTruthGarment>& garments) const {
    GroundTruth truth;
    truth.cameras = SmallCapture{}.cameras;
    truth.body = trunk_body().mesh;
    truth.garments = garments;
    fs::create_directories(capture() / "truth" / "frames");
    write_archive(capture() / "truth" / "truth.h5", archive_of(truth));
    for (int id = 0; id < 3; ++id) {
      GroundTruthFrame frame;
      frame.frame_id = id;
      frame.body = walking_trunk()[static_cast<std::size_t>(id)];
      for (const GroundTruthGarment& garment : garments) {
        frame.garments.push_back(garments.size() == 1
                                     ? walking_skirt()[static_cast<std::size_t>(id)]
                                     : garment.garment.mesh.vertices);
      }
      write_archive(capture() / "truth" / "frames" / (frame_name(id) + ".h5"),
                    archive_of(frame, truth));
    }
  }
  nlohmann::json evaluated(const std::string& stage, int code) const {
    const ChildResult result =
        run({"evaluate", (root_ / "work").string(), "--ground-truth", capture().string(), "--stage",
             stage, "--check", "--targets", "accuracy", "--json"});
    EXPECT_EQ(result.exit_code, code) << result.err;
    return nlohmann::json::parse(result.out);
  }
  static std::string verdict(const nlohmann::json& evaluated, const std::string& key) {
    for (const nlohmann::json& row : evaluated.at("check")) {
      if (row.at("key") == key) {
        return row.at("verdict");
      }
    }
    return "no row";
  }
  fs::path capture() const { return root_ / "capture"; }

  TemporaryDirectory root_;
};

TEST_F(Register, TemplateWithoutAttachments_IsInThePoseOfTheFirstFrame) {
  const ChildResult done = registered();
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out + done.err, HasSubstr("no attachments to the body"));
  const Sequence skirt =
      open_sequence(root_ / "work" / "register" / "current" / "registered" / "lower");
  EXPECT_THAT(skirt.frame_ids, ::testing::ElementsAre(0, 1, 2));
  for (Index i = 0; i < 3; ++i) {
    const Points off = frame(skirt, i).vertices - walking_skirt()[static_cast<std::size_t>(i)];
    EXPECT_LT(off.rowwise().norm().mean(), 0.02) << i;
  }
}

TEST_F(Register, CameraWithoutImages_IsNamedOnceAndLeftOut) {
  fs::remove_all(capture() / "images" / "01");
  const ChildResult done = registered();
  EXPECT_EQ(done.exit_code, 0) << done.err;
  const std::string said = "camera 01: no image with a mask in 3 of 3 frames";
  EXPECT_THAT(manifest()["warnings"].dump(), HasSubstr(said));
  const std::size_t once = done.err.find(said);
  ASSERT_NE(once, std::string::npos) << done.err;
  EXPECT_EQ(done.err.find(said, once + 1), std::string::npos);
}

// As WholeRun of the stages before, and Appearance of the one that learns; body, template and those
// of simulation open no pictures.
TEST_F(Register, HeldOutImages_DoNotChangeTheResult) {
  for (const Camera& camera : SmallCapture{}.cameras) {
    for (int id = 0; id < 3; ++id) {
      ByteImage picture(camera.width, camera.height, 3);
      for (int x = 0; x < camera.width; ++x) {  // stripes, to slide along
        for (int y = 0; y < camera.height; ++y) {
          picture.at(x, y, 0) = static_cast<std::uint8_t>(120 + 60 * std::sin(0.4 * x + id));
        }
      }
      write_image(capture() / "images" / camera.id / (frame_name(id) + ".png"), picture);
      const ByteImage skirt(camera.width, camera.height, 1,
                            static_cast<std::uint8_t>(Label::Lower));
      write_labels(capture() / "labels" / camera.id / (frame_name(id) + ".png"), skirt);
    }
  }
  CaptureInfo info = read_capture_info(capture());
  info.held_out_cameras = {SmallCapture{}.cameras.back().id};
  std::ofstream(capture() / "capture.toml") << capture_toml(info);
  const std::vector<std::string> quick = {
      "--photometric-levels", "1", "--photometric-steps", "1", "--code", "false"};
  ASSERT_EQ(registered(quick).exit_code, 0);
  const nlohmann::json expected = manifest()["outputs"];
  for (const char* kind : {"images", "labels"}) {
    fs::remove_all(capture() / kind / info.held_out_cameras[0]);
  }
  const ChildResult done = registered(quick, "without");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.err, Not(HasSubstr("no image with a mask")));
  EXPECT_EQ(manifest("without")["outputs"], expected);
  // Images do say something here: those of another camera are missed.
  fs::remove_all(capture() / "images" / SmallCapture{}.cameras[0].id);
  ASSERT_EQ(registered(quick, "less").exit_code, 0);
  EXPECT_NE(manifest("less")["outputs"], expected);
}

TEST_F(Register, FrameWithoutScan_IsPredictedAndReportedAsFailure) {
  missing.scan = 1;
  const ChildResult done = registered();
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out + done.err,
              HasSubstr("no-scan [frames 1]: the garment follows body and images alone there"));
  EXPECT_THAT(
      done.out + done.err,
      HasSubstr("warning tracking-failure [lower]: its position is not to be relied on in"));
  EXPECT_EQ(manifest()["metrics"]["frames"], 3);
}

// With enough frames it is what rest_surface makes of them:
// Run.RegisteredGarment_IsFlattenedFromItsRestSurface.
TEST_F(Register, TooFewFrames_GiveTheTemplateAsRestSurface) {
  const ChildResult done = registered();
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out + done.err, HasSubstr("3 frames, too few to estimate the rest surface"));
  const fs::path garment = root_ / "work" / "register" / "current" / "registered" / "lower";
  EXPECT_LT((read_mesh(garment / "rest.obj").vertices -
             read_mesh_archive(garment / "template.h5").vertices)
                .rowwise()
                .norm()
                .maxCoeff(),
            1e-5);
}

TEST_F(Register, FrameWithoutBody_IsLeftOutAndReported) {
  missing.last_body = true;
  const ChildResult done = registered();
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out + done.err, HasSubstr("1 of 3 clothed frames has no body"));
  EXPECT_EQ(manifest()["metrics"]["frames"], 2);
}

// Not that every frame is told: no two lines of a program are within half a second, but the last.
TEST_F(Register, Progress_CountsTrackedFrames) {
  const ChildResult result = registered({"--jobs", "1", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  std::istringstream lines(result.out);
  std::vector<std::int64_t> told;
  for (std::string line; std::getline(lines, line);) {
    const nlohmann::json event = nlohmann::json::parse(line);
    if (event.value("event", "") == "progress" && event.value("unit", "") == "frames followed") {
      EXPECT_EQ(event.at("total"), 3);
      told.push_back(event.at("done"));
    }
  }
  ASSERT_FALSE(told.empty());
  EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
  EXPECT_EQ(told.back(), 3);
}

TEST_F(Register, BadFrameSelection_IsRefusedWhilePlanning) {
  for (const std::string choice : {"99", "3:"}) {
    for (const bool planned : {true, false}) {
      std::vector<std::string> more = {"--frames", choice};
      if (planned) {
        more.emplace_back("--dry-run");
      }
      const ChildResult result = registered(more);
      EXPECT_EQ(result.exit_code, 2) << choice;
      EXPECT_THAT(result.err, HasSubstr("--frames cannot be '" + choice + "'"));
      EXPECT_THAT(result.err, HasSubstr("a range that holds one of 3 frames, 0 to 2"));
    }
  }
  EXPECT_EQ(registered({"--frames", "2", "--dry-run"}).exit_code, 0);
  missing.last_body = true;
  EXPECT_EQ(registered({"--frames", "2", "--dry-run"}, "other").exit_code, 2) << "it has no body";
}

TEST_F(Register, Shards_GiveTheResultOfOneRun) {
  for (const std::string window : {"48", "1"}) {
    ASSERT_EQ(registered({"--window", window}, "one" + window).exit_code, 0);
    for (const char* shard : {"0/2", "1/2"}) {
      const ChildResult part =
          registered({"--window", window, "--shard", shard}, "shards" + window);
      ASSERT_EQ(part.exit_code, 0) << part.err;
    }
    EXPECT_GT(manifest("one" + window)["outputs"].size(), 6U);
    EXPECT_EQ(manifest("shards" + window)["outputs"], manifest("one" + window)["outputs"]);
  }
}

TEST_F(Register, ParallelShards_GiveTheResultOfOneRun) {
  ASSERT_EQ(registered().exit_code, 0);
  make(kBeforeRegister, root_ / "shards");
  const auto shard = [&](const std::string& which) {
    return std::vector<std::string>{
        program_path(), "register", capture().string(), (root_ / "shards").string(),
        "--rounds",     "3",        "--shard",          which};
  };
  ChildProcess first(shard("0/2"));
  ChildProcess second(shard("1/2"));
  for (ChildProcess* child : {&first, &second}) {
    const ChildResult done = child->wait();
    EXPECT_EQ(done.exit_code, 0) << done.err;
  }
  EXPECT_EQ(manifest("shards")["outputs"], manifest()["outputs"]);
}

/// Where unfinished work has what was followed of a frame.
fs::path kept_frame(const fs::path& workspace, int id) {
  const fs::path folder = workspace / "register";
  if (fs::exists(folder)) {
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (entry.path().filename().string().starts_with(".staging-")) {
        return entry.path() / ".scratch" / "lower" / (frame_name(id) + ".h5");
      }
    }
  }
  return {};
}

TEST_F(Register, KeptFrames_AreReusedByALaterRun) {
  ASSERT_EQ(registered().exit_code, 0);
  ASSERT_EQ(registered({"--frames", "2"}, "parts").exit_code, 0);
  const fs::path file = kept_frame(root_ / "parts", 1);
  ASSERT_TRUE(fs::exists(file));
  // Read, not followed once more: a mark in it comes through.
  Archive kept = read_archive(file, kFollowedFrameSchema, 1);
  kept.numbers["strain_p95"] = 0.123;
  write_archive(file, kept);
  ASSERT_EQ(registered({}, "parts").exit_code, 0);
  const auto strain = [&](const std::string& workspace, int id) {
    return read_archive(
               root_ / workspace / "register" / "current" / "frames" / (frame_name(id) + ".h5"),
               "atelier.mesh", 1)
        .numbers.at("lower.strain_p95");
  };
  EXPECT_EQ(strain("parts", 1), 0.123);
  for (const int id : {0, 2}) {
    EXPECT_EQ(strain("parts", id), strain("work", id));
  }
}

TEST_F(Register, DamagedKeptFrame_IsReportedAndTrackedAgain) {
  ASSERT_EQ(registered().exit_code, 0);
  const std::array<std::function<void(const fs::path& file)>, 4> spoils = {
      [](const fs::path& file) { fs::resize_file(file, fs::file_size(file) / 2); },
      [](const fs::path& file) {
        std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
        bytes.seekp(static_cast<std::streamoff>(fs::file_size(file)) - 9);
        bytes.put('!');
      },
      [](const fs::path& file) {
        fs::copy_file(file.parent_path() / "000002.h5", file, fs::copy_options::overwrite_existing);
      },
      [](const fs::path& file) { std::ofstream(file) << "no archive"; },
  };
  for (std::size_t i = 0; i < spoils.size(); ++i) {
    const std::string workspace = "spoilt" + std::to_string(i);
    ASSERT_EQ(registered({"--frames", "2"}, workspace).exit_code, 0);
    spoils[i](kept_frame(root_ / workspace, 1));
    const ChildResult done = registered({}, workspace);
    ASSERT_EQ(done.exit_code, 0) << done.err;
    EXPECT_THAT(done.out + done.err, HasSubstr("lower: frame 1 as it was kept is no good")) << i;
    EXPECT_EQ(manifest(workspace)["outputs"], manifest()["outputs"]) << i;
  }
}

TEST_F(Register, RunKilledWithinAWindow_ResumesToTheSameDigests) {
  ASSERT_EQ(registered().exit_code, 0);
  for (const int signal : {SIGKILL, SIGINT}) {
    const std::string workspace = "killed" + std::to_string(signal);
    make(kBeforeRegister, root_ / workspace);
    ChildProcess child({program_path(), "register", capture().string(),
                        (root_ / workspace).string(), "--rounds", "3", "--jobs", "1"});
    while (!fs::exists(kept_frame(root_ / workspace, 1)) && !child.has_ended()) {
      std::this_thread::yield();
    }
    child.kill(signal);
    const ChildResult stopped = child.wait();
    if (stopped.signal == SIGINT) {  // else it was quicker, or had no time to say it
      EXPECT_THAT(stopped.err,
                  ::testing::ContainsRegex("lower: [23] of 3 frames are followed and kept"));
      EXPECT_THAT(stopped.out, HasSubstr(" of 3 frames are finished and kept; "));
    }
    const ChildResult done = registered({}, workspace);
    ASSERT_EQ(done.exit_code, 0) << done.err;
    EXPECT_EQ(manifest(workspace)["outputs"], manifest()["outputs"]);
  }
}

TEST_F(Register, ScansWithoutClothing_GiveNoTemplate) {
  missing.labels = true;
  const std::array<Stage, 3> before = {dressed_stage("personalize"), kBeforeRegister[0],
                                       kBeforeRegister[1]};
  make(before, root_ / "work");
  const ChildResult made = run({"template", capture().string(), (root_ / "work").string()});
  EXPECT_EQ(made.exit_code, 3);
  EXPECT_THAT(made.err, HasSubstr("no clothing in any frame"));
}

TEST_F(Register, MeasuredError_IsThePointDistanceOnTheCloth) {
  GroundTruthGarment skirt;
  skirt.garment = tube_skirt();
  skirt.label = Label::Lower;
  write_truth({skirt});
  make(kMeasured, root_ / "work");
  const nlohmann::json all = evaluated("register", 1);  // the drift
  // Two frames of three are turned round their axis: along the surface, but for the chords.
  const double radius = 224;  // mm, mean
  EXPECT_NEAR(all.at("register.point_mean_mm").get<double>(), 2.0 / 3 * radius * kTurned, 0.05);
  EXPECT_NEAR(all.at("register.point_p95_mm").get<double>(), 2.48, 0.1);
  EXPECT_NEAR(all.at("register.drift_mm").get<double>(), radius * kTurned, 0.1);
  EXPECT_LT(all.at("register.chamfer_mm").get<double>(), 0.4);
  EXPECT_EQ(all.at("register.inverted"), 0);
  EXPECT_NEAR(all.at("register.inside_rate").get<double>(), 0.015, 1e-12);
  EXPECT_EQ(verdict(all, "register.inside_rate"), "no row") << "it has no target";
  EXPECT_EQ(verdict(all, "register.point_mean_mm"), "met");
  EXPECT_EQ(verdict(all, "register.drift_mm"), "missed");
}

TEST_F(Register, PlainCloth_IsNotJudged) {
  GroundTruthGarment skirt;
  skirt.garment = tube_skirt();
  skirt.label = Label::Lower;
  write_truth({skirt});
  std::ofstream(capture() / "synthesis.json") << R"({"options": {"fabric.kind": "plain"}})";
  make(kMeasured, root_ / "work");
  const nlohmann::json all = evaluated("register", 0);
  for (const char* key : {"register.chamfer_mm", "register.point_mean_mm", "register.point_p95_mm",
                          "register.inverted", "register.drift_mm"}) {
    EXPECT_EQ(verdict(all, key), "not judged") << key;
  }
}

TEST_F(Register, CheckMeasuringNothing_Fails) {
  GroundTruthGarment skirt;
  skirt.garment = tube_skirt();
  skirt.label = Label::Lower;
  write_truth({skirt});
  make(kMeasured, root_ / "work");
  const auto check = [&](std::vector<std::string> more) {
    more.insert(more.begin(),
                {"evaluate", (root_ / "work").string(), "--ground-truth", capture().string()});
    return run(more);
  };
  EXPECT_EQ(check({"--stage", "body"}).exit_code, 0) << "no check was asked for";
  const ChildResult none = check({"--stage", "body", "--check", "--json"});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_THAT(none.err, HasSubstr("no figure was measured"));
  EXPECT_EQ(check({"--stage", "body", "--complete"}).exit_code, 2);
  EXPECT_EQ(check({"--stage", "register", "--check", "--complete", "--targets", "demo"}).exit_code,
            0);
  // The true skirt has no seams, which --complete alone minds.
  std::vector<std::string> flat = {"--stage", "flatten", "--check", "--targets", "demo"};
  EXPECT_THAT(check(flat).err, Not(HasSubstr("not measured")));
  flat.push_back("--complete");
  const ChildResult incomplete = check(flat);
  EXPECT_EQ(incomplete.exit_code, 1);
  EXPECT_THAT(incomplete.err, HasSubstr("not measured: 1 figure among those"));
}

TEST_F(Register, DamagedResult_IsReportedWithItsRemedy) {
  GroundTruthGarment skirt;
  skirt.garment = tube_skirt();
  skirt.label = Label::Lower;
  write_truth({skirt});
  make(kMeasured, root_ / "work");
  for (const auto& entry :
       fs::recursive_directory_iterator(fs::canonical(root_ / "work" / "flatten" / "current"))) {
    if (entry.path().extension() == ".obj") {
      std::ofstream(entry.path()) << "f 1 2 3\n";
    }
  }
  const auto evaluate = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = {"evaluate",       (root_ / "work").string(),
                                      "--ground-truth", capture().string(),
                                      "--stage",        "flatten"};
    words.insert(words.end(), more.begin(), more.end());
    return run(words);
  };
  const ChildResult printed = evaluate({});
  EXPECT_EQ(printed.exit_code, 3);
  EXPECT_THAT(printed.out, HasSubstr("flatten: not measured: "));
  EXPECT_THAT(printed.out, HasSubstr("run 'atelier flatten' again"));
  const ChildResult checked = evaluate({"--check", "--json"});
  EXPECT_EQ(checked.exit_code, 3) << "damage counts more than what was not measured";
  const nlohmann::json json = nlohmann::json::parse(checked.out);
  EXPECT_THAT(json.at("check").at(0).at("why").get<std::string>(), HasSubstr("'atelier flatten'"));
}

TEST_F(Register, Patterns_AreComparedWithTheGarmentOfTheirLabel) {
  write_truth({sewn_tube("tee", Label::Upper, 0.7), sewn_tube("skirt", Label::Lower, 0.5)});
  make(kMeasured, root_ / "work");
  const nlohmann::json all = evaluated("flatten", 1);
  EXPECT_NEAR(all.at("flatten.area_ratio").get<double>(), 0.62 / 0.5, 1e-6);
  EXPECT_NEAR(all.at("flatten.area_error").get<double>(), 0.62 / 0.5 - 1, 1e-6);
  EXPECT_EQ(verdict(all, "flatten.area_error"), "missed");
  EXPECT_EQ(all.at("flatten.panels"), 2);
  EXPECT_EQ(verdict(all, "flatten.panels"), "met");
  EXPECT_NEAR(all.at("flatten.seam_ratio").get<double>(), (0.62 + 0.7) / (0.5 + 0.7), 1e-6);
  EXPECT_EQ(all.at("flatten.seam_mismatch"), 0.0018);
}

TEST_F(Register, PatternSewnAnew_IsJudgedWhereTheCapturedClothHungStill) {
  write_truth({sewn_tube("skirt", Label::Lower, 0.62)});
  make(kMeasured, root_ / "work");
  const nlohmann::json still = evaluated("flatten", 1);
  EXPECT_NEAR(still.at("flatten.sewn_mean_mm").get<double>(), 4, 1e-9);
  EXPECT_EQ(verdict(still, "flatten.sewn_mean_mm"), "met");
  EXPECT_EQ(verdict(still, "flatten.sewn_p95_mm"), "missed");
  EXPECT_EQ(still.at("flatten.corners_max"), 9);
  EXPECT_EQ(verdict(still, "flatten.corners_max"), "no row") << "shown, not judged";
  cloth_motion = 9;
  fs::remove_all(root_ / "work");
  make(kMeasured, root_ / "work");
  cloth_motion = 0.3;
  const ChildResult result =
      run({"evaluate", (root_ / "work").string(), "--ground-truth", capture().string(), "--stage",
           "flatten", "--check", "--targets", "accuracy", "--json"});
  const nlohmann::json moved = nlohmann::json::parse(result.out);
  EXPECT_EQ(verdict(moved, "flatten.sewn_p95_mm"), "not judged");
  EXPECT_THAT(result.out, HasSubstr("was in motion (9.0 m/s2)"));
}

TEST_F(Register, PatternWithoutGroundTruth_ChangesNoTarget) {
  write_truth({sewn_tube("skirt", Label::Lower, 0.5)});
  make(kMeasured, root_ / "work");
  const ChildResult result =
      run({"evaluate", (root_ / "work").string(), "--ground-truth", capture().string(), "--stage",
           "flatten", "--check", "--targets", "accuracy", "--json"});
  const nlohmann::json all = nlohmann::json::parse(result.out);
  EXPECT_EQ(all.at("flatten.panels"), 1);  // of the skirt: the other pattern is nobody's
  for (const nlohmann::json& row : all.at("check")) {
    if (row.at("key") == "flatten.panels") {
      EXPECT_EQ(row.at("target"), "at most 3");
    }
  }
}

}  // namespace
}  // namespace atelier::fixtures

#endif
