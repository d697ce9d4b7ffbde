// `atelier run`: plans, reports and what captures that have little come to.
#if defined(ATELIER_HAS_CAPTURE) && defined(ATELIER_HAS_CAPTURE_SURFACE) && \
    defined(ATELIER_HAS_BODYMODEL)

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/capture_info.h"
#include "core/atomic_file.h"
#include "core/io/file_bytes.h"
#include "core/io/image_file.h"
#include "core/store/file_lock.h"
#include "core/store/result.h"
#include "pipeline/pictures/run_account.h"
#include "tests/apps/dressed_workspace.h"
#include "tests/apps/run_fixture.h"
#include "tests/support/browser.h"
#include "tests/support/test_data.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

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

TEST_F(Run, DryRunWithNothingToDo_SaysSo) {
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
    EXPECT_THAT(
        result.err,
        HasSubstr(more.empty() ? "there is no image and no detection"
                               : capture_.string() + ": every stage but validate is skipped: "));
  }
}

TEST_F(Run, DryRunOfImagesAlone_ContradictsItselfNowhere) {
  for (const char* kind : {"keypoints2d", "labels", "masks"}) {
    fs::remove_all(capture_ / kind);
  }
  const ChildResult plan = run({"--from", "reconstruct", "--to", "reconstruct", "--dry-run"});
  EXPECT_EQ(plan.exit_code, 3);
  EXPECT_THAT(plan.out, HasSubstr("run: no stage is to run"));
  EXPECT_THAT(plan.out, Not(HasSubstr("is there")));
  EXPECT_THAT(plan.err, HasSubstr(": every stage is skipped: "));
}

TEST_F(Run, ErrorsOfTheCapture_AreSeenInStatusExportAndDryRun) {
  for (const char* kind : {"keypoints2d", "labels", "masks"}) {
    fs::remove_all(capture_ / kind);
  }
  CaptureInfo info = read_capture_info(capture_);
  info.held_out_frames = info.sequences.at(0).frame_ids;  // an error
  write_file_atomically(capture_ / "capture.toml", capture_toml(info));
  run({"--to", "validate", "--no-report"});
  const ChildResult status = run_child({program_path(), "status", workspace_.string()});
  EXPECT_THAT(status.out, HasSubstr("done, with errors"));
  const ChildResult exported =
      run_child({program_path(), "export", workspace_.string(), (root_ / "exported").string()});
  EXPECT_EQ(exported.exit_code, 0) << exported.err;
  EXPECT_THAT(exported.out, HasSubstr("warning: validate ended with errors"));
  const ChildResult plan = run({"--to", "validate", "--dry-run"});
  EXPECT_THAT(plan.out, HasSubstr("would do nothing: its result says that the capture has errors"));
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

TEST_F(Run, MovedOrGrownCapture_IsTheSameCapture) {
  ASSERT_EQ(run({"--from", "reconstruct", "--to", "reconstruct"}).exit_code, 0);
  std::ofstream(capture_ / "notes.txt") << "more";
  EXPECT_EQ(run({"--from", "reconstruct", "--to", "reconstruct"}).exit_code, 0);
  const fs::path moved = root_ / "moved";
  fs::rename(capture_, moved);
  std::vector<std::string> all = command({"--from", "reconstruct", "--to", "reconstruct"});
  all[2] = moved.string();
  EXPECT_THAT(run_child(all).out, HasSubstr("reconstruct is done already"));
}

TEST_F(Run, MovedAndGrownCapture_KeepsItsWorkspace) {
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

TEST_F(Run, Help_SaysWhereStageOptionsAre) {
  EXPECT_THAT(run_child({program_path(), "run", "--help"}).out,
              AllOf(HasSubstr("--STAGE.section.field VALUE"), HasSubstr("--capture.field VALUE"),
                    HasSubstr("atelier options"), HasSubstr("Exit codes:")));
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

}  // namespace
}  // namespace atelier::fixtures

#endif
