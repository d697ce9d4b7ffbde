// `atelier run`: errors and refusals, and what is left of a run that had one.
#if defined(ATELIER_HAS_CAPTURE) && defined(ATELIER_HAS_CAPTURE_SURFACE) && \
    defined(ATELIER_HAS_BODYMODEL)

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>

#include "core/device.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/store/file_lock.h"
#include "pipeline/pictures/run_account.h"
#include "tests/apps/dressed_workspace.h"
#include "tests/apps/run_fixture.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

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

TEST_F(Run, CaptureErrors_AreReportedAndSetTheExitCode) {
  const SmallCapture small;
  fs::resize_file(capture_ / "images" / small.cameras[1].id / "000003.png", 20);
  const ChildResult result = run({"--to", "validate"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.out, HasSubstr("the capture has errors"));
  EXPECT_THAT(read_file_text(workspace_ / "report/index.html", 1 << 26),
              HasSubstr("the capture has errors"));
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
