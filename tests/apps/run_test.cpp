// `atelier run`: what it does with captures that have little, and what it refuses.
#if defined(ATELIER_HAS_CAPTURE) && defined(ATELIER_HAS_CAPTURE_SURFACE) && \
    defined(ATELIER_HAS_BODYMODEL)

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>

#include "core/device.h"
#include "core/io/file_bytes.h"
#include "core/io/image_file.h"
#include "core/io/mesh_file.h"
#include "core/normals.h"
#include "core/sequence_archive.h"
#include "core/store/commit.h"
#include "core/store/file_lock.h"
#include "core/store/input_digest.h"
#include "core/store/result.h"
#include "core/store/stage_plan.h"
#include "pipeline/pictures/run_account.h"
#include "registration/flattening/rest_surface.h"
#include "tests/apps/dressed_workspace.h"
#include "tests/capture/small_capture.h"
#include "tests/support/browser.h"
#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_data.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// A capture without masks: three cameras, two frames.
class Run : public ::testing::Test {
 protected:
  void SetUp() override {
    write_small_capture(capture_, SmallCapture());
    fs::remove_all(capture_ / "labels");
  }
  std::vector<std::string> command(std::vector<std::string> more = {}) const {
    std::vector<std::string> all = {program_path(), "run", capture_.string(), workspace_.string()};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  ChildResult run(std::vector<std::string> more = {}) const {
    return run_child(command(std::move(more)));
  }
  bool has_result(const std::string& stage) const {
    return current_name(workspace_ / stage).has_value();
  }
  Manifest manifest(const std::string& stage) const {
    return read_manifest(workspace_ / stage / *current_name(workspace_ / stage), stage);
  }
  fs::path toml(const std::string& text) const {
    const fs::path file = root_ / "options.toml";
    std::ofstream(file) << text;
    return file;
  }
  static void expect_refusal(const ChildResult& result, int code, const std::string& words) {
    EXPECT_EQ(result.exit_code, code) << result.err;
    EXPECT_THAT(result.err, AllOf(HasSubstr("atelier: "), HasSubstr(words)));
  }

  TemporaryDirectory root_;
  fs::path capture_ = root_.path() / "capture";
  fs::path workspace_ = root_.path() / "work";
};

TEST_F(Run, DryRun_ReportsThePlanAndChangesNothing) {
  const ChildResult result = run({"--dry-run"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out,
              AllOf(HasSubstr("3 cameras, 2 frames, 0 with masks"), HasSubstr("about "),
                    HasSubstr("reconstruct  would run: it has no result in this workspace"),
                    HasSubstr("track        would run: after reconstruct"),
                    HasSubstr("body         is skipped: no frame has images with masks")));
  EXPECT_FALSE(fs::exists(workspace_));
  std::vector<std::string> unwritable = command({"--dry-run"});
  unwritable[3] = "/proc/atelier";
  expect_refusal(run_child(unwritable), 5, "/proc");
}

TEST_F(Run, DryRun_SaysEachSkippedStageOnce) {
  const std::string out = run({"--dry-run"}).out;
  const std::string skipped = "no frame has images with masks";
  EXPECT_THAT(out, HasSubstr("body         is skipped: " + skipped));
  EXPECT_THAT(out, Not(HasSubstr("run: body is skipped")));
}

TEST_F(Run, DryRunWhereNothingIsToDo_SaysSo) {
  ASSERT_EQ(run({"--from", "reconstruct", "--to", "reconstruct"}).exit_code, 0);
  const ChildResult plan = run({"--from", "reconstruct", "--to", "reconstruct", "--dry-run"});
  EXPECT_THAT(plan.out, HasSubstr("run: every result of 1 stage is there; a run would write the "
                                  "report alone again"));
}

TEST_F(Run, CaptureWithoutImagesAndKeypoints_IsNoSuccess) {
  fs::remove_all(capture_ / "images");
  fs::remove_all(capture_ / "keypoints2d");
  for (const std::vector<std::string>& more : {std::vector<std::string>{"--dry-run"}, {}}) {
    const ChildResult result = run(more);
    EXPECT_EQ(result.exit_code, 3) << result.out;
    EXPECT_THAT(result.err,
                HasSubstr(more.empty() ? "there is no image and no detection"
                                       : capture_.string() + ": every stage is skipped: "));
  }
}

TEST_F(Run, WorkspaceOfAnotherCapture_IsReplacedOnlyWhenAsked) {
  const std::vector<std::string> stages = {"--from", "reconstruct", "--to", "reconstruct"};
  ASSERT_EQ(run(stages).exit_code, 0);
  run({"--to", "validate"});
  const std::string before = *current_name(workspace_ / "reconstruct");
  const fs::path first = root_ / "first";
  fs::rename(capture_, first);
  SmallCapture other;
  other.frames = {0, 1, 2};
  write_small_capture(capture_, other);
  fs::remove_all(capture_ / "labels");
  fs::rename(capture_, root_ / "second");
  fs::rename(first, capture_);
  const auto second = [&](std::vector<std::string> more) {
    std::vector<std::string> all = command(std::move(more));
    all[2] = (root_ / "second").string();
    return run_child(all);
  };
  for (const std::vector<std::string>& more : {std::vector<std::string>{}, {"--dry-run"}}) {
    expect_refusal(
        second(more), 2,
        "it holds results of another capture, " + capture_.string() + " (validate, reconstruct)");
  }
  const ChildResult plan = second({"--replace", "--dry-run", "--to", "validate"});
  EXPECT_THAT(plan.out, HasSubstr("results of " + capture_.string() + " would be set aside"));
  EXPECT_EQ(*current_name(workspace_ / "reconstruct"), before);

  const ChildResult done = second({"--replace", "--to", "validate"});
  EXPECT_THAT(done.out, HasSubstr("results of " + capture_.string() +
                                  " are set aside: validate, "
                                  "reconstruct"));
  EXPECT_FALSE(has_result("reconstruct")) << "which nobody takes for one of the second capture";
  EXPECT_TRUE(has_result("validate"));
  EXPECT_TRUE(fs::exists(workspace_ / "reconstruct" / before)) << "aside, not gone";
  EXPECT_NE(second({"--to", "validate"}).exit_code, 2) << "all of it is the second's now";
  // The first one is taken up where it was left.
  EXPECT_THAT(run({"--replace", "--from", "reconstruct", "--to", "reconstruct"}).out,
              HasSubstr("reconstruct is done already"));
}

TEST_F(Run, MovedOrGrownCapture_IsNoOther) {
  ASSERT_EQ(run({"--from", "reconstruct", "--to", "reconstruct"}).exit_code, 0);
  std::ofstream(capture_ / "notes.txt") << "more";
  EXPECT_EQ(run({"--from", "reconstruct", "--to", "reconstruct"}).exit_code, 0);
  const fs::path moved = root_ / "moved";
  fs::rename(capture_, moved);
  std::vector<std::string> all = command({"--from", "reconstruct", "--to", "reconstruct"});
  all[2] = moved.string();
  EXPECT_THAT(run_child(all).out, HasSubstr("reconstruct is done already"));
}

TEST_F(Run, CaptureThatWasMovedAndHasGrown_IsGoneOnWith) {
  ASSERT_EQ(run({"--from", "reconstruct", "--to", "reconstruct"}).exit_code, 0);
  const std::size_t before = frames_of(manifest("reconstruct")).size();
  const fs::path grown = root_ / "grown";
  SmallCapture more;
  more.frames = {3, 4, 5, 6};
  write_small_capture(grown, more);
  fs::remove_all(grown / "labels");
  std::vector<std::string> all = command({"--from", "reconstruct", "--to", "reconstruct"});
  all[2] = grown.string();
  const ChildResult result = run_child(all);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("reconstruct is done,"));
  EXPECT_EQ(frames_of(manifest("reconstruct")).size(), 2 * before);
}

TEST_F(Run, DryRunOnDamagedResult_PlansToRecomputeIt) {
  ASSERT_EQ(run({"--from", "reconstruct", "--to", "reconstruct"}).exit_code, 0);
  std::ofstream(workspace_ / "reconstruct/current" / manifest("reconstruct").outputs.front().path,
                std::ios::app)
      << "x";
  const ChildResult result = run({"--to", "personalize", "--dry-run"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("reconstruct  would run: the result is damaged"),
                                HasSubstr("personalize  would run: after reconstruct")));
  // Where nothing mends it, it is refused as the run refuses it.
  expect_refusal(run({"--from", "personalize", "--to", "personalize", "--dry-run"}), 3,
                 "run 'atelier reconstruct' first");
}

TEST_F(Run, DryRunFromALaterStage_NamesTheMissingResult) {
  const ChildResult result = run({"--from", "track", "--dry-run"});
  EXPECT_EQ(result.exit_code, 3) << result.err;
  EXPECT_THAT(result.out,
              HasSubstr("track        cannot run: no result of reconstruct, which --from track "
                        "leaves out"));
}

/// What the first event says of the time that all takes.
double announced_seconds(const ChildResult& result) {
  return nlohmann::json::parse(result.out.substr(0, result.out.find('\n')))["expected_seconds"];
}

TEST_F(Run, AnnouncedTime_IncludesRecomputedStages) {
  run({"--to", "validate"});
  ASSERT_TRUE(has_result("validate"));
  const std::vector<std::string> plan = {"--to", "validate", "--dry-run", "--json"};
  const double report = announced_seconds(run(plan));
  EXPECT_GT(report, 0);
  std::vector<std::string> other = plan;
  other.insert(other.end(), {"--capture.fps", "24"});
  const ChildResult again = run(other);
  EXPECT_THAT(again.out, HasSubstr("option capture.fps"));
  EXPECT_GT(announced_seconds(again), report);
}

TEST_F(Run, TimeLeft_IsLearntFromTheStagesThatRanHere) {
  run({"--to", "validate"});
  RunAccount account = read_run_account(workspace_).value();
  const std::vector<std::string> again = {"--to",   "validate",      "--dry-run",
                                          "--json", "--capture.fps", "24"};
  const double usual = announced_seconds(run(again));
  EXPECT_LT(usual, 1000);
  ASSERT_EQ(account.stages[0].stage, "validate");
  account.stages[0].seconds = 5000;
  write_run_account(workspace_, account);
  const double learnt = announced_seconds(run(again));
  EXPECT_GT(learnt, 5000);
  EXPECT_LT(learnt, 6000);
  account.capture = root_.path().string();  // of another capture nothing is learnt
  write_run_account(workspace_, account);
  EXPECT_LT(announced_seconds(run(again)), 1000);
}

TEST_F(Run, SignalWhileReporting_EndsTheRun) {
  run({"--to", "validate"});
  ASSERT_TRUE(has_result("validate"));
  // Whoever writes the report holds it up until the signal comes.
  auto held = FileLock::try_lock(workspace_ / "report" / ".lock", FileLock::Mode::Exclusive);
  ASSERT_TRUE(held);
  const fs::path said = root_ / "said.txt";
  ChildProcess child({"/bin/sh", "-c", R"(exec "$@" > ")" + said.string() + "\"", "sh",
                      program_path(), "run", capture_.string(), workspace_.string(), "--to",
                      "validate"});
  while (!child.has_ended() &&
         !(fs::exists(said) &&
           read_file_text(said, 1 << 20).find("run: report, about ") != std::string::npos)) {
    usleep(1000);
  }
  child.kill(SIGINT);
  EXPECT_EQ(child.wait().signal, SIGINT);
}

TEST_F(Run, RequestedStages_RunAsTheirOwnCommandsDo) {
  const ChildResult first = run({"--from", "reconstruct", "--to", "reconstruct"});
  ASSERT_EQ(first.exit_code, 0) << first.err;
  EXPECT_TRUE(has_result("reconstruct"));
  EXPECT_FALSE(has_result("validate"));
  const ChildResult by_hand =
      run_child({program_path(), "reconstruct", capture_.string(), workspace_.string()});
  EXPECT_THAT(by_hand.out, HasSubstr("is done already"));
  EXPECT_THAT(run({"--from", "reconstruct", "--to", "reconstruct"}).out,
              HasSubstr("reconstruct is done already"));
}

TEST_F(Run, Report_SaysWhatWasSkippedAndWhy) {
  const ChildResult result = run({"--from", "reconstruct", "--to", "reconstruct"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("report: " + (workspace_ / "report/index.html").string()));
  const RunAccount account = read_run_account(workspace_).value();
  EXPECT_EQ(account.capture, capture_.string());
  std::map<std::string, std::string> ends;
  for (const RunStageAccount& one : account.stages) {
    ends[one.stage] = one.end;
  }
  EXPECT_EQ(ends["reconstruct"], "done");
  EXPECT_EQ(ends["validate"], "not asked for");
  const std::string page = read_file_text(workspace_ / "report/index.html", 1 << 26);
  EXPECT_THAT(page,
              AllOf(HasSubstr("The run"), HasSubstr("Positions and directions of the cameras")));
}

TEST_F(Run, Report_LoadsInABrowser) {
  if (!has_browser()) {
    GTEST_SKIP() << "no program chromium (scripts/setup)";
  }
  ASSERT_EQ(run({"--from", "reconstruct", "--to", "reconstruct"}).exit_code, 0);
  const BrowsedPage found = browse(workspace_ / "report" / "index.html", root_.path());
  EXPECT_EQ(found.broken, 0);
  EXPECT_THAT(found.text, HasSubstr("Positions and directions of the cameras"));
  EXPECT_THAT(found.messages, Not(HasSubstr("CONSOLE")));
}

/// Folders of a real trial of four cameras with keypoints and videos, and the first few frames of
/// the keypoints.
void copy_few_frames(const fs::path& trial, const fs::path& to) {
  constexpr int kFrames = 6;
  fs::create_directories(to / "calibration");
  fs::copy_file(trial / "Config.toml", to / "Config.toml");
  for (const auto& entry : fs::directory_iterator(trial / "calibration")) {
    if (entry.is_regular_file()) {
      fs::copy_file(entry.path(), to / "calibration" / entry.path().filename());
    }
  }
  for (const auto& camera : fs::directory_iterator(trial / "pose_openpose_body25b")) {
    const fs::path folder = to / "pose_openpose_body25b" / camera.path().filename();
    fs::create_directories(folder);
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(camera)) {
      files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    files.resize(std::min<std::size_t>(files.size(), kFrames));
    for (const fs::path& file : files) {
      fs::copy_file(file, folder / file.filename());
    }
  }
}

TEST(RunOnARealTrial, RealTrial_RunsPossibleStagesAndExplainsSkippedOnes) {
  ATELIER_TEST_FILE(trial, "pose2sim_demo/single");
  const TemporaryDirectory root;
  copy_few_frames(trial, root / "trial");
  const std::vector<std::string> command = {program_path(), "run", (root / "trial").string(),
                                            (root / "work").string()};
  const auto with = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all = command;
    all.insert(all.end(), more.begin(), more.end());
    return run_child(all);
  };
  const ChildResult plan = with({"--dry-run"});
  ASSERT_EQ(plan.exit_code, 0) << plan.err;
  for (const char* stage : {"body", "template", "register", "flatten", "material", "appearance"}) {
    std::string name = stage;
    name.resize(12, ' ');
    EXPECT_THAT(plan.out + plan.err,
                HasSubstr(name + " is skipped: no frame has images with masks"))
        << stage;
  }
  EXPECT_THAT(plan.out + plan.err, HasSubstr("simulate     is skipped: no garment was captured"));
  EXPECT_THAT(plan.out, HasSubstr("animate      would run"));
  EXPECT_FALSE(fs::exists(root / "work"));

  const ChildResult done =
      with({"--to", "track", "--personalize.samples", "800", "--personalize.shape_rounds", "2",
            "--personalize.surface_rounds", "1"});
  // 3: the trial's own cameras have an error, which validate names.
  EXPECT_EQ(done.exit_code, 3) << done.err;
  EXPECT_THAT(done.err, HasSubstr("distortion-scaled"));
  for (const char* stage : {"validate", "reconstruct", "personalize", "track"}) {
    EXPECT_TRUE(current_name(root / "work" / stage).has_value()) << stage;
  }
  EXPECT_TRUE(fs::exists(root / "work/report/index.html"));
  // `track` keeps each motion in two forms, which are one BVH.
  const fs::path out = root / "out";
  ASSERT_EQ(run_child({program_path(), "export", (root / "work").string(), out.string(), "--stage",
                       "track"})
                .exit_code,
            0);
  EXPECT_TRUE(fs::exists(out / "track/tracked/capture.bvh"));
  EXPECT_TRUE(fs::exists(out / "track/motion/capture.npz"));
  EXPECT_FALSE(fs::exists(out / "track/motion/capture.bvh"));
}

TEST_F(Run, FailedStage_SkipsItsDependentsAndStillReports) {
  // Two people who are no people: bodies cannot be measured on them.
  const ChildResult result = run({"--from", "reconstruct"});
  EXPECT_THAT(result.exit_code, ::testing::AnyOf(0, 3)) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("body was skipped: no frame has images with masks"),
                                HasSubstr("report: ")));
  const RunAccount account = read_run_account(workspace_).value();
  const bool failed = std::any_of(account.stages.begin(), account.stages.end(),
                                  [](const auto& one) { return one.end == "failed"; });
  EXPECT_EQ(result.exit_code, failed ? 3 : 0);
  EXPECT_TRUE(has_result("reconstruct"));
}

TEST_F(Run, OneOptionsFile_ServesEveryStage) {
  const std::string file = toml(
                               "[capture]\nfps = 24\n[reconstruct]\nlabel_by_color = false\n"
                               "[track]\nexclude = \"none\"\n[report]\npictures = 3\n")
                               .string();
  const ChildResult result =
      run({"--from", "reconstruct", "--to", "reconstruct", "--config", file});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  std::map<std::string, std::string> set;
  for (const ManifestOption& option : manifest("reconstruct").options) {
    if (option.source != "default") {
      set[option.name] = option.json;
      EXPECT_THAT(option.source, HasSubstr("options.toml:"));
    }
  }
  EXPECT_EQ(set, (std::map<std::string, std::string>{{"capture.fps", "24"},
                                                     {"label_by_color", "false"}}));
}

TEST_F(Run, StageFlags_OverrideFiles) {
  const std::string file = toml("[reconstruct]\nlabel_by_color = false\n").string();
  ASSERT_EQ(run({"--to", "reconstruct", "--from", "reconstruct", "--config", file,
                 "--reconstruct.label-by-color", "true", "--reconstruct.capture.fps", "30",
                 "--capture.fps", "24"})
                .exit_code,
            0);
  for (const ManifestOption& option : manifest("reconstruct").options) {
    if (option.name == "capture.fps") {
      EXPECT_EQ(option.json, "30") << "the stage's own wins over the capture's";
    }
    if (option.name == "label_by_color") {
      EXPECT_EQ(option.json, "true");
    }
  }
}

TEST_F(Run, JsonEvents_EndWithTheAccount) {
  const ChildResult result = run({"--from", "reconstruct", "--to", "reconstruct", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  std::vector<std::string> events;
  nlohmann::json last;
  std::istringstream lines(result.out);
  for (std::string line; std::getline(lines, line);) {
    last = nlohmann::json::parse(line);
    events.push_back(last["event"]);
  }
  EXPECT_EQ(last["event"], "run_end");
  EXPECT_THAT(events, AllOf(::testing::Contains("run"), ::testing::Contains("end")));
  EXPECT_TRUE(fs::exists(last["report"].get<std::string>()));
}

TEST_F(Run, FinishedStages_KeepTheirTimes) {
  ASSERT_EQ(run({"--from", "reconstruct", "--to", "reconstruct"}).exit_code, 0);
  const double first = read_run_account(workspace_).value().stages[1].seconds;
  EXPECT_GT(first, 0);
  const ChildResult again = run({"--from", "reconstruct", "--to", "reconstruct", "--json"});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  const RunAccount account = read_run_account(workspace_).value();
  ASSERT_EQ(account.stages[1].stage, "reconstruct");
  EXPECT_EQ(account.stages[1].end, "done already");
  EXPECT_EQ(account.stages[1].seconds, first);
  EXPECT_THAT(read_file_text(workspace_ / "report/index.html", 1 << 26), HasSubstr(" s then</td>"));
  const std::size_t last = again.out.rfind('\n', again.out.size() - 2);
  const auto end = nlohmann::json::parse(again.out.substr(last + 1));
  EXPECT_GT(end["seconds"].get<double>(), account.seconds);
  // Asked for or not, it is not forgotten.
  run({"--to", "validate"});
  EXPECT_EQ(read_run_account(workspace_).value().stages[1].seconds, first);
}

TEST_F(Run, CaptureErrors_AreReportedAndSetTheExitCode) {
  const SmallCapture small;
  fs::resize_file(capture_ / "images" / small.cameras[1].id / "000003.png", 20);
  const ChildResult result = run({"--to", "validate"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.out, HasSubstr("the capture has errors"));
  EXPECT_THAT(read_file_text(workspace_ / "report/index.html", 1 << 26),
              HasSubstr("the capture has errors"));
}

/// A patch of cloth of seven by seven vertices, which are `width` m apart across.
void write_patch(const fs::path& file, double width) {
  std::ofstream patch(file);
  constexpr int kSide = 6;
  for (int y = 0; y <= kSide; ++y) {
    for (int x = 0; x <= kSide; ++x) {
      patch << "v " << width * x << " " << 0.05 * y << " 0\n";
    }
  }
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const int v = y * (kSide + 1) + x + 1;
      patch << "f " << v << " " << v + 1 << " " << v + kSide + 2 << "\n";
      patch << "f " << v << " " << v + kSide + 2 << " " << v + kSide + 1 << "\n";
    }
  }
}

/// Commits what `write` puts into a folder as the result of a stage, of somebody who agreed to
/// something.
fs::path make_result(const fs::path& workspace, const std::string& stage,
                     const std::function<void(const fs::path&)>& write) {
  const fs::path staging = workspace / stage / ".staging-0";
  fs::create_directories(staging);
  write(staging);
  Manifest manifest;
  manifest.stage = stage;
  manifest.stage_version = 1;
  manifest.canonical_options = "{}";
  manifest.key = stage_key(stage, 1, "", "{}", {});
  manifest.started = manifest.finished = "2026-01-01T00:00:00Z";
  manifest.consent = {{"P. Doe", "research", "2999-12-31"}};
  for (const auto& entry : fs::recursive_directory_iterator(staging)) {
    if (!entry.is_directory()) {
      const FileDigest digest = digest_of_file(entry.path());
      manifest.outputs.push_back(
          {entry.path().lexically_relative(staging).generic_string(), digest.size, digest.digest});
    }
  }
  std::sort(manifest.outputs.begin(), manifest.outputs.end(),
            [](const auto& a, const auto& b) { return a.path < b.path; });
  const fs::path result = workspace / stage / folder_name(manifest.key);
  commit_result(staging, result, manifest);
  return result;
}

/// A result of `template`: a patch of cloth.
fs::path make_template(const fs::path& workspace) {
  return make_result(workspace, "template", [](const fs::path& folder) {
    fs::create_directory(folder / "garments");
    write_patch(folder / "garments" / "upper.obj", 0.05);
  });
}

TEST_F(Run, Consent_IsCarriedIntoDerivedResults) {
  write_small_capture(capture_, SmallCapture());  // with labels: there are clothes
  make_template(workspace_);
  for (const char* time : {"first", "done already"}) {
    const ChildResult result = run({"--from", "flatten", "--to", "flatten"});
    ASSERT_EQ(result.exit_code, 0) << time << result.err;
  }
  const Manifest made = manifest("flatten");
  ASSERT_EQ(made.consent.size(), 1U);
  EXPECT_EQ(made.consent.front().who, "P. Doe");
  EXPECT_GE(made.metrics.at("panels"), 1);
  EXPECT_TRUE(fs::exists(workspace_ / "flatten/current/upper/pattern.svg"));
}

TEST_F(Run, Status_TracesDerivedInputsBackToResults) {
  write_small_capture(capture_, SmallCapture());
  make_template(workspace_);
  ASSERT_EQ(run({"--from", "flatten", "--to", "flatten"}).exit_code, 0);
  const auto status = [&] {
    const std::string all = run_child({program_path(), "status", workspace_.string()}).out;
    return all.substr(all.find("\nflatten"));
  };
  EXPECT_THAT(status(), AllOf(HasSubstr("outdated"), HasSubstr("'template' before it is outdated")))
      << "a version of the stage that is no more";
  fs::remove(workspace_ / "template" / "current");
  EXPECT_THAT(status(),
              HasSubstr("its input surface is made from a result of 'template' that is no "
                        "longer the current one"));
  std::ofstream(workspace_ / "surfaces" / "made_of.txt") << "2\n../template 0123\n";
  EXPECT_THAT(status(), AllOf(HasSubstr("input surface changed"), Not(HasSubstr("is made of"))));
}

// What is registered is laid flat without what folds took; where its wearer looks is kept, but it
// is in nobody's pose, and so has no weight that could be taken out.
TEST_F(Run, RegisteredGarment_IsFlattenedFromItsRestSurface) {
  write_small_capture(capture_, SmallCapture());
  make_result(workspace_, "template", [](const fs::path& folder) {
    fs::create_directory(folder / "garments");
    write_patch(folder / "garments" / "upper.obj", 0.05);
    std::ofstream(folder / "template.json")
        << R"({"garments": [{"label": "upper", "frame": 3, "facing": [0.6, 0, 0.8]}]})";
  });
  make_result(workspace_, "register", [](const fs::path& folder) {
    fs::create_directories(folder / "registered" / "upper");
    write_patch(folder / "registered" / "upper" / "rest.obj", 0.06);
    fs::create_directory(folder / "registered" / "upper" / "frames");
    for (std::size_t i = 0; i < kRestFrames; ++i) {
      std::ofstream(folder / "registered" / "upper" / "frames" / std::to_string(i)) << i;
    }
  });
  const ChildResult result = run({"--from", "flatten", "--to", "flatten"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Mesh flat = read_mesh(workspace_ / "flatten/current/upper/garment.obj");
  EXPECT_NEAR(face_areas(flat.vertices, flat.faces).sum(), 0.36 * 0.3, 1e-3);
  EXPECT_LT(manifest("flatten").metrics.at("deviation_max"), 1e-3);  // it lies flat already
  const auto note = nlohmann::json::parse(
      read_file_text(workspace_ / "surfaces" / "template.json", 1 << 16))["garments"][0];
  EXPECT_EQ(note["facing"], nlohmann::json({0.6, 0, 0.8}));
  EXPECT_EQ(note["rest"], true);
  EXPECT_FALSE(note.contains("frame"));

  const ChildResult relaxed =
      run_child({program_path(), "flatten", (workspace_ / "surfaces").string(), workspace_.string(),
                 "--relax.body", (workspace_ / "surfaces" / "upper.obj").string(), "--dry-run"});
  if (relaxed.err.find("unknown") == std::string::npos) {  // built with simulation
    EXPECT_EQ(relaxed.exit_code, 3);
    EXPECT_THAT(relaxed.err, AllOf(HasSubstr("upper.obj: a rest surface"),
                                   HasSubstr("WORKSPACE/template/current")));
  }
}

// So that the pattern can be sewn anew and held against it: the body of another frame is nobody's.
TEST_F(Run, BodyOfTheTemplatesFrame_IsKeptBesideTheSurfaces) {
  write_small_capture(capture_, SmallCapture());
  make_result(workspace_, "template", [](const fs::path& folder) {
    fs::create_directory(folder / "garments");
    write_patch(folder / "garments" / "upper.obj", 0.05);
    std::ofstream(folder / "template.json")
        << R"({"garments": [{"label": "upper", "frame": 3, "facing": [0, 0, 1]}]})";
  });
  Mesh ball = sphere(2);
  ball.vertices *= 0.1;
  Mesh other = ball;
  other.vertices.array() += 5;
  make_result(workspace_, "body", [&](const fs::path& folder) {
    write_sequence(folder, sequence_of({other, ball}, 10, {2, 3}));
  });
  const ChildResult result = run({"--from", "flatten", "--to", "flatten"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const fs::path captured = workspace_ / "surfaces" / "captured" / "upper";
  EXPECT_EQ(read_mesh(captured / "body.obj").vertices, ball.vertices);
  EXPECT_EQ(read_mesh(captured / "garment.obj").faces.rows(),
            read_mesh(workspace_ / "surfaces" / "upper.obj").faces.rows());
  EXPECT_EQ(nlohmann::json::parse(read_file_text(captured / "captured.json", 1 << 10)),
            (nlohmann::json{{"frame", 3}}));
  EXPECT_TRUE(manifest("flatten").metrics.contains("sewn_mean"));
  const ChildResult again = run({"--from", "flatten", "--to", "flatten"});
  EXPECT_THAT(again.out, HasSubstr("flatten is done already"));
}

TEST_F(Run, RegistrationOfAnEarlierVersion_IsNamed) {
  write_small_capture(capture_, SmallCapture());
  make_template(workspace_);
  const fs::path registered = make_result(workspace_, "register", [](const fs::path& folder) {
    fs::create_directories(folder / "registered" / "upper");
    write_patch(folder / "registered" / "upper" / "template.obj", 0.05);
  });
  const ChildResult result = run({"--from", "flatten", "--to", "flatten"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, AllOf(HasSubstr((registered / "registered/upper: rest.obj").string()),
                                HasSubstr("run 'atelier register' again")));
}

TEST_F(Run, SurfacesOfAnEarlierTemplate_AreWarnedOf) {
  write_small_capture(capture_, SmallCapture());
  make_template(workspace_);
  ASSERT_EQ(run({"--from", "flatten", "--to", "flatten"}).exit_code, 0);
  const auto flatten = [&](std::vector<std::string> more) {
    std::vector<std::string> all = {program_path(), "flatten", (workspace_ / "surfaces").string(),
                                    workspace_.string()};
    all.insert(all.end(), more.begin(), more.end());
    const ChildResult result = run_child(all);
    return result.out + result.err;
  };
  EXPECT_THAT(flatten({"--dry-run"}), Not(HasSubstr("no longer the current one")));
  // Another result takes its place, as where a template is recomputed.
  const std::string other = std::string(16, '0');
  const fs::path made = workspace_ / "template" / fs::read_symlink(workspace_ / "template/current");
  fs::copy(made, workspace_ / "template" / other, fs::copy_options::recursive);
  fs::remove(workspace_ / "template" / "current");
  fs::create_directory_symlink(other, workspace_ / "template" / "current");
  for (const std::string& said : {flatten({"--dry-run"}), flatten({})}) {
    EXPECT_THAT(said,
                HasSubstr("surfaces is made from a result of 'template' that is no longer the "
                          "current one; run 'atelier run CAPTURE " +
                          workspace_.string() + " --from flatten --to flatten' to recompute it"));
  }
}

TEST_F(Run, SurfacesOfAnEarlierTemplate_AreFoundByAnyPath) {
  const fs::path made = make_template(workspace_);
  const fs::path surfaces = workspace_ / "surfaces";
  fs::create_directory(surfaces);
  for (const char* name : {"upper.obj", "mine.obj"}) {
    fs::copy_file(made / "garments" / "upper.obj", surfaces / name);
  }
  std::ofstream(surfaces / "made_of.txt") << "3\ntemplate 0000000000000000\nupper.obj 01\n";
  const auto planned = [&](const std::string& input) {
    const ChildResult result =
        run_child({program_path(), "flatten", input, workspace_.string(), "--dry-run"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out + result.err;
  };
  const std::string place = workspace_.string();
  for (const std::string& input :
       {place + "/surfaces", place + "/surfaces/", place + "/surfaces/.",
        place + "/template/../surfaces", fs::relative(surfaces).string(),
        fs::relative(surfaces).string() + "/", place + "/surfaces/upper.obj",
        fs::relative(surfaces / "upper.obj").string()}) {
    EXPECT_THAT(planned(input), HasSubstr("is made from a result of 'template' that is no longer"))
        << input;
  }
  EXPECT_THAT(planned(place + "/surfaces/mine.obj"), Not(HasSubstr("no longer the current")))
      << "somebody put it there";
}

TEST_F(Run, DamagedDerivedInputs_AreRecomputed) {
  write_small_capture(capture_, SmallCapture());
  make_template(workspace_);
  const std::vector<std::string> flatten = {"--from", "flatten", "--to", "flatten"};
  ASSERT_EQ(run(flatten).exit_code, 0);
  const Digest expected = outputs_digest(manifest("flatten"));
  const fs::path file = workspace_ / "surfaces" / "upper.obj";
  const std::string sound = read_file_text(file, 1 << 20);
  std::string bit = sound;
  bit[sound.find("0.05")] = '1';
  for (const std::string& damaged : {bit, sound.substr(0, sound.size() / 2), std::string()}) {
    std::ofstream(file) << damaged;
    const ChildResult result = run(flatten);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("flatten is done already"));
    EXPECT_EQ(read_file_text(file, 1 << 20), sound);
  }
  fs::remove(file);
  EXPECT_THAT(run(flatten).out, HasSubstr("flatten is done already"));
  EXPECT_EQ(outputs_digest(manifest("flatten")), expected);
}

TEST_F(Run, AnyStageError_LeavesAReport) {
  run({"--to", "validate"});  // so that there is something to report on
  // What no file can be made of: an error of the surroundings, not of the data.
  fs::create_directories(workspace_ / "reconstruct" / ".lock");
  const ChildResult result = run({"--from", "reconstruct", "--to", "track"});
  EXPECT_EQ(result.exit_code, 5) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("reconstruct FAILED: "),
                                HasSubstr("track was skipped: it reads the result of reconstruct"),
                                HasSubstr("report: ")));
  EXPECT_THAT(read_file_text(workspace_ / "report/index.html", 1 << 26),
              HasSubstr("<b>reconstruct</b> failed: "));
}

TEST_F(Run, EnvironmentError_EndsTheRun) {
  const fs::path lock = workspace_ / "validate" / ".lock";
  fs::create_directories(lock.parent_path());
  const auto held = FileLock::try_lock(lock, FileLock::Mode::Exclusive);
  ASSERT_TRUE(held);
  const ChildResult result = run({"--to", "reconstruct", "--json"});
  EXPECT_EQ(result.exit_code, 5) << result.err;
  EXPECT_THAT(result.out, HasSubstr("the run ended with the error of validate"));
  EXPECT_FALSE(has_result("reconstruct"));
}

TEST_F(Run, RefusalOfTheLastStage_IsRefusedBeforeTheFirst) {
  const std::string none = (root_ / "none.npz").string();
  for (const std::string option : {"motion", "body", "cloth-sequence"}) {
    for (const bool dry : {true, false}) {
      std::vector<std::string> more = {"--animate." + option, none};
      if (dry) {
        more.emplace_back("--dry-run");
      }
      expect_refusal(run(more), 3, "none.npz");
    }
  }
  expect_refusal(run({"--animate.garment", (root_ / "none.json").string()}), 3, "none.json");
  expect_refusal(run({"--animate.camera", "oracle"}), 2, "--animate.camera cannot be 'oracle'");
  if (!cuda_available()) {
    expect_refusal(run({"--device", "cuda"}), 5, "; use --device cpu");
    expect_refusal(run({"--device", "cuda", "--dry-run"}), 5, "; use --device cpu");
  }
  EXPECT_FALSE(fs::exists(workspace_));
}

TEST_F(Run, UnknownTemplateFrame_IsRefusedWithTheValidOnes) {
  write_small_capture(capture_, SmallCapture());  // with labels: there are clothes
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"--template.frame", "99", "--dry-run"},
        std::vector<std::string>{"--template.frame", "99"}}) {
    expect_refusal(run(more), 2, "it takes one of the capture's clothed frames, 3 to 4; or -1");
  }
  EXPECT_FALSE(fs::exists(workspace_));
  EXPECT_EQ(run({"--template.frame", "3", "--dry-run"}).exit_code, 0);
}

TEST_F(Run, TemplateFrameWithLittleClothing_IsRefused) {
  write_small_capture(capture_, SmallCapture());
  const fs::path file = capture_ / "capture.toml";
  std::string text = read_file_text(file, 1 << 20);
  const std::size_t ids = text.find("frame_ids = [3");
  ASSERT_NE(ids, std::string::npos);
  const std::size_t line = text.find('\n', ids);
  text.replace(ids, line - ids,
               "frame_ids = [3]\n\n[[sequence]]\nname = \"minimal\"\nkind = \"minimal\"\nfps = "
               "1.0\nframe_ids = [4]");
  std::ofstream(file) << text;
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"--template.frame", "4", "--dry-run"},
        std::vector<std::string>{"--template.frame", "4"}}) {
    expect_refusal(run(more), 2, "--template.frame cannot be '4'");
  }
  EXPECT_EQ(run({"--template.frame", "3", "--dry-run"}).exit_code, 0);
}

TEST_F(Run, Help_SaysWhereStageOptionsAre) {
  EXPECT_THAT(run_child({program_path(), "run", "--help"}).out,
              AllOf(HasSubstr("--STAGE.section.field VALUE"), HasSubstr("--capture.field VALUE"),
                    HasSubstr("atelier options"), HasSubstr("Exit codes:")));
}

TEST_F(Run, DamagedResult_IsNotBuiltUpon) {
  write_small_capture(capture_, SmallCapture());
  std::ofstream(make_template(workspace_) / "garments" / "upper.obj", std::ios::app) << "v 9 9 9\n";
  const ChildResult result = run({"--from", "flatten", "--to", "flatten"});
  EXPECT_EQ(result.exit_code, 3) << result.out;
  EXPECT_THAT(result.err, HasSubstr("run 'atelier template' again"));
  EXPECT_FALSE(has_result("flatten"));
}

TEST_F(Run, SecondRunInAWorkspace_IsRefusedMeanwhile) {
  const fs::path lock = workspace_ / "reconstruct" / ".lock";
  fs::create_directories(lock.parent_path());
  const auto held = FileLock::try_lock(lock, FileLock::Mode::Exclusive);
  ASSERT_TRUE(held);
  expect_refusal(run({"--from", "reconstruct", "--to", "reconstruct"}), 5,
                 "another run is working on 'reconstruct'");
}

TEST_F(Run, SecondRun_KeepsAccountAndReportOfTheFirst) {
  run({"--to", "validate"});
  const fs::path page = workspace_ / "report" / "index.html";
  const fs::path account = workspace_ / "report" / "run.json";
  const std::string page_before = read_file_text(page, 1 << 26);
  const std::string account_before = read_file_text(account, 1 << 20);
  fs::create_directories(workspace_ / "reconstruct");
  const auto held =
      FileLock::try_lock(workspace_ / "reconstruct" / ".lock", FileLock::Mode::Exclusive);
  ASSERT_TRUE(held);
  const ChildResult result = run({"--from", "reconstruct", "--to", "track"});
  expect_refusal(result, 5, "another run is working on 'reconstruct'");
  EXPECT_THAT(result.out, AllOf(HasSubstr("reconstruct FAILED: "), Not(HasSubstr("\nreport: "))));
  EXPECT_EQ(read_file_text(page, 1 << 26), page_before);
  EXPECT_EQ(read_file_text(account, 1 << 20), account_before);
}

/// Images of one camera in another size than it is calibrated for.
void crop_pictures(const fs::path& folder) {
  for (const auto& entry : fs::directory_iterator(folder)) {
    const ImageHeader header = read_image_header(entry.path());
    write_image(entry.path(), Image(header.width - 8, header.height, 3, 0.5F));
  }
}

TEST_F(Run, ReportOverlays_UseCamerasWhoseImagesMatchCalibration) {
  fs::remove_all(capture_);
  SmallCapture small;
  small.frames = {0, 1, 2};
  write_small_capture(capture_, small);
  fs::remove_all(capture_ / "labels");
  write_dressed_workspace(capture_, workspace_, "track");
  ASSERT_EQ(run({"--from", "reconstruct", "--to", "reconstruct"}).exit_code, 0);
  const auto camera = [&] {
    EXPECT_EQ(run_child({program_path(), "report", workspace_.string()}).exit_code, 0);
    const std::string page = read_file_text(workspace_ / "report" / "index.html", 1 << 26);
    constexpr std::string_view kCaption = "<figcaption>The skeleton over the images of camera ";
    const std::size_t at = page.find(kCaption);
    return at == std::string::npos
               ? page
               : page.substr(at + kCaption.size(),
                             page.find('<', at + kCaption.size()) - at - kCaption.size());
  };
  const std::string first = camera();
  ASSERT_TRUE(fs::exists(capture_ / "images" / first)) << first;
  crop_pictures(capture_ / "images" / first);
  const std::string second = camera();
  ASSERT_TRUE(fs::exists(capture_ / "images" / second)) << second;
  EXPECT_NE(second, first);
  for (const auto& entry : fs::directory_iterator(capture_ / "images")) {
    if (entry.path().filename() != first) {
      crop_pictures(entry.path());
    }
  }
  EXPECT_THAT(camera(),
              AllOf(HasSubstr("The skeleton over images is left out: no camera's are as large"),
                    HasSubstr(first + ": 56x80 pixels, calibrated for 64x80")));
}

TEST_F(Run, FullDisk_EndsTheExportAndTheNextOneCompletes) {
  const fs::path disk = root_ / "disk";
  fs::create_directories(disk);
  if (mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=100m") != 0) {
    GTEST_SKIP() << "mounting is not allowed here: " << std::strerror(errno);
  }
  fs::remove_all(capture_);
  workspace_ = disk / "work";
  write_dressed_workspace(capture_, workspace_);
  const std::vector<std::string> animate = {"--from",
                                            "animate",
                                            "--to",
                                            "animate",
                                            "--animate.pictures",
                                            "false",
                                            "--animate.cloth.xpbd.substeps",
                                            "6"};
  if (const ChildResult made = run(animate); made.exit_code == 0) {
    const fs::path avatar = workspace_ / "export" / "avatar.glb";
    const std::string sound = read_file_text(avatar, 1 << 26);
    fs::remove_all(workspace_ / "export");
    const auto ballast = fs::space(disk).available - sound.size() / 2;
    run_child({"fallocate", "-l", std::to_string(ballast), (disk / "ballast").string()});
    const ChildResult full = run(animate);
    expect_refusal(full, 5, "export: ");
    EXPECT_THAT(full.err, HasSubstr("No space left on device"));
    EXPECT_THAT(full.out, HasSubstr("export FAILED: "));
    EXPECT_FALSE(fs::exists(workspace_ / "export"));
    fs::remove(disk / "ballast");
    EXPECT_EQ(run(animate).exit_code, 0);
    EXPECT_EQ(read_file_text(avatar, 1 << 26), sound);
    EXPECT_FALSE(fs::exists(workspace_ / ".export-new"));
  } else {
    ADD_FAILURE() << made.err;
  }
  umount2(disk.c_str(), MNT_DETACH);
}

TEST_F(Run, Damage_OutranksAMissedTarget) {
  fs::remove_all(capture_);
  const std::string capture = capture_.string();
  const std::string places = capture + " " + workspace_.string();
  for (const std::string& command :
       {"synthesize " + capture +
            " --dome.cameras 8 --dome.width 90 --dome.height 120 --frames 0 --minimal-frames 1 "
            "--held-out-cameras 0 --held-out-share 0 --samples 1 --light-samples 6 "
            "--skin-resolution 128",
        "reconstruct " + places + " --surface.octree-depth 6 --surface.edge-length 0.03",
        "personalize " + places + " --samples 800 --shape-rounds 1 --surface-rounds 1"}) {
    std::istringstream words(command);
    std::vector<std::string> all = {program_path()};
    all.insert(all.end(), std::istream_iterator<std::string>(words), {});
    ASSERT_EQ(run_child(all).exit_code, 0) << command;
  }
  const auto evaluate = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {program_path(), "evaluate", workspace_.string(), "--ground-truth",
                               capture_.string()});
    return run_child(more);
  };
  EXPECT_EQ(evaluate({"--check", "--targets", "accuracy"}).exit_code, 1);
  const fs::path file = workspace_ / "personalize" / "current" / "shape.json";
  fs::resize_file(file, fs::file_size(file) / 2);
  for (const char* more : {"--check", "--json"}) {
    expect_refusal(evaluate({more}), 3,
                   "the result of 'personalize' is damaged: error output-size");
  }
  EXPECT_EQ(evaluate({"--stage", "reconstruct"}).exit_code, 0);
}

TEST_F(Run, RealCapture_IsNotGroundTruth) {
  ASSERT_EQ(run({"--from", "reconstruct", "--to", "reconstruct"}).exit_code, 0);
  expect_refusal(run_child({program_path(), "evaluate", workspace_.string(), "--ground-truth",
                            capture_.string()}),
                 3, "truth: none: only synthetic captures have it");
}

TEST_F(Run, KilledRun_ResumesToTheSameDigests) {
  const std::vector<std::string> all = command({"--from", "reconstruct", "--to", "reconstruct"});
  ASSERT_EQ(run_child(all).exit_code, 0);
  const Digest expected = outputs_digest(manifest("reconstruct"));
  fs::remove_all(workspace_);
  for (int kill = 0; kill < 3; ++kill) {
    ChildProcess child(all);
    while (!child.has_ended() && !fs::exists(workspace_ / "reconstruct" / ".lock")) {
    }
    child.kill(SIGKILL);
    child.wait();
  }
  ASSERT_EQ(run_child(all).exit_code, 0);
  EXPECT_EQ(outputs_digest(manifest("reconstruct")), expected);
}

TEST_F(Run, UnknownOptionsAndStages_AreRefused) {
  expect_refusal(run({"--config", toml("[tracks]\nexclude = \"none\"\n").string()}), 2,
                 "did you mean 'track.exclude'?");
  expect_refusal(run({"--config", toml("[track]\nexclude = 7\n").string()}), 2, "track.exclude");
  expect_refusal(run({"--config", toml("exclude = \"none\"\n").string()}), 2, "exclude");
  expect_refusal(run({"--config", toml("[track\n").string()}), 2, "options.toml");
  expect_refusal(run({"--config", (root_ / "nothing.toml").string()}), 2, "nothing.toml");
  expect_refusal(run({"--track.exlude", "none"}), 2, "did you mean '--track.exclude'?");
  expect_refusal(run({"--from", "tracks"}), 2, "did you mean 'track'?");
  expect_refusal(run({"--from", "track", "--to", "reconstruct"}), 2, "lies before");
  expect_refusal(run({"--jobs", "-1"}), 2, "whole number");
  expect_refusal(run({"--material", "demin"}), 2, "custom, silk");
  EXPECT_THAT(run({"--material", "denimm"}).err,
              AllOf(HasSubstr("did you mean 'denim'"), Not(HasSubstr("fitted"))));
  expect_refusal(run({"--material.name", "denim"}), 2, "did you mean '--material'?");
  expect_refusal(run({"--material", "denim", "--material.search.coarse", "4"}), 2,
                 "material.search.coarse does nothing with material.material.name denim");
  expect_refusal(run({"--material.material.name", "denim", "--material.frames", "4"}), 2,
                 "--material.material.name fitted");
  EXPECT_FALSE(fs::exists(workspace_));
}

TEST_F(Run, BadCapturesAndWorkspaces_AreRefused) {
  expect_refusal(run_child({program_path(), "run", capture_.string()}), 2,
                 "run takes CAPTURE and WORKSPACE");
  expect_refusal(run_child({program_path(), "run", (root_ / "no").string(), workspace_.string()}),
                 3, "no");
  expect_refusal(
      run_child({program_path(), "run", capture_.string(), (capture_ / "work").string()}), 2,
      "inside its own input");
  fs::create_directories(workspace_);
  std::ofstream(workspace_ / "letter.txt") << "x";
  expect_refusal(run(), 2, "it holds letter.txt");
  EXPECT_FALSE(fs::exists(workspace_ / "report"));
}

TEST_F(Run, GarbageInCaptureFiles_IsRefused) {
  for (const char* name : {"capture.toml", "cameras.json"}) {
    const std::string before = read_file_text(capture_ / name, 1 << 20);
    for (const std::string& garbage :
         {std::string(), std::string("\0\xff{[", 4), before.substr(0, before.size() / 2)}) {
      std::ofstream(capture_ / name, std::ios::binary | std::ios::trunc) << garbage;
      const ChildResult result = run();
      EXPECT_EQ(result.exit_code, 3) << name << ": " << result.err;
      EXPECT_FALSE(fs::exists(workspace_));
    }
    std::ofstream(capture_ / name, std::ios::binary | std::ios::trunc) << before;
  }
}

TEST_F(Run, BadAccount_IsRefusedAndLeftOutOfTheReport) {
  ASSERT_EQ(run({"--from", "reconstruct", "--to", "reconstruct"}).exit_code, 0);
  const fs::path file = workspace_ / "report" / "run.json";
  const std::string sound = read_file_text(file, 1 << 20);
  for (const std::string& text :
       {std::string("{}"), std::string("[1, 2]"), sound.substr(0, sound.size() / 2),
        std::string(R"({"schema": "atelier.run", "version": 9})"),
        std::string(R"({"schema": "atelier.run", "version": 1, "capture": 3})")}) {
    std::ofstream(file) << text;
    EXPECT_THROW(read_run_account(workspace_), DataError) << text;
    EXPECT_EQ(run_child({program_path(), "report", workspace_.string()}).exit_code, 0);
    EXPECT_THAT(read_file_text(workspace_ / "report" / "index.html", 1 << 24),
                HasSubstr("what the last run came to cannot be read"));
  }
  EXPECT_FALSE(read_run_account(root_ / "nowhere").has_value());
}

}  // namespace
}  // namespace atelier::fixtures

#endif
