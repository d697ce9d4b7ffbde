#include "core/store/run_stage.h"

#include <atomic>
#include <fstream>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/store/active_run.h"
#include "core/store/collect_garbage.h"
#include "core/store/frame_log.h"
#include "core/store/result.h"
#include "core/store/workspace_status.h"
#include "core/store/write_text.h"
#include "tests/core_store/test_stages.h"
#include "tests/support/temporary_directory.h"

namespace atelier::testing {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using End = StageReport::End;

void write(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path) << text;
}

std::string read(const std::filesystem::path& path) {
  return read_file_text(path, 1 << 20);
}

class RunStage : public ::testing::Test {
 protected:
  RunStage() {
    behaviour() = {};
    write(root_ / "in/a.txt", "3");
  }

  StageRequest request(std::string_view stage) {
    StageRequest result;
    result.input = root_ / "in";
    result.workspace = root_ / "work";
    result.options = find_stage(kTestStages, stage)->options();
    result.jobs = 1;
    return result;
  }
  StageReport run(std::string_view stage, const StageRequest& what,
                  const StageEvents& events = {}) {
    return run_stage(kTestStages, *find_stage(kTestStages, stage), what, events);
  }
  StageReport run(std::string_view stage) { return run(stage, request(stage)); }
  std::filesystem::path folder(std::string_view stage) { return root_ / "work" / stage; }
  std::filesystem::path current(std::string_view stage) {
    return folder(stage) / current_name(folder(stage)).value_or("none");
  }
  template <class Error>
  std::string refusal(std::string_view stage, const StageRequest& what) {
    try {
      run(stage, what);
    } catch (const Error& error) {
      return error.what();
    }
    return "it ran";
  }
  std::vector<std::string> names(const std::filesystem::path& path) {
    std::vector<std::string> found;
    for (const auto& entry : std::filesystem::directory_iterator(path)) {
      found.push_back(entry.path().filename().string());
    }
    std::sort(found.begin(), found.end());
    return found;
  }

  TemporaryDirectory root_;
};

TEST_F(RunStage, DoesTheWorkOnce) {
  const StageReport first = run("count");
  EXPECT_EQ(first.end, End::Done);
  EXPECT_EQ(read(current("count") / "count.txt"), "1 files");
  EXPECT_EQ(behaviour().count_runs, 1);
  const StageReport second = run("count");
  EXPECT_EQ(second.end, End::AlreadyDone);
  EXPECT_EQ(behaviour().count_runs, 1);
  EXPECT_EQ(second.manifest.key, first.manifest.key);
  EXPECT_EQ(second.manifest.metrics.at("files"), 1);
}

TEST_F(RunStage, ManifestSaysWhatHappened) {
  StageRequest what = request("count");
  ASSERT_EQ(set_option(what.options.table, "word", "pieces", "outfit.toml:7"), "");
  run("count", what);
  const Manifest manifest = read_manifest(current("count"), "count");
  EXPECT_EQ(manifest.stage_version, 2);
  ASSERT_EQ(manifest.outputs.size(), 1u);
  EXPECT_EQ(manifest.outputs[0].size, 8);
  EXPECT_EQ(manifest.outputs[0].digest, sha256("1 pieces"));
  EXPECT_EQ(manifest.options[0].source, "outfit.toml:7");
  EXPECT_EQ(manifest.inputs[0].files, 1);
  EXPECT_THAT(manifest.build, HasSubstr("atelier"));
  EXPECT_GT(manifest.peak_memory_bytes, 1 << 20);
  EXPECT_GE(manifest.work_seconds, 0);
}

TEST_F(RunStage, EverythingIsForTheOwnerAlone) {
  run("count");
  run("frames");
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root_ / "work")) {
    if (entry.is_symlink()) {
      continue;
    }
    const auto mode = static_cast<unsigned>(entry.status().permissions()) & 0777;
    EXPECT_EQ(mode, entry.is_directory() ? 0700u : 0600u) << entry.path();
  }
  EXPECT_EQ(static_cast<unsigned>(std::filesystem::status(root_ / "work").permissions()) & 0777,
            0700u);
}

TEST_F(RunStage, AnOptionMakesAnotherResultAndTheFirstComesBack) {
  const auto first = run("count").plan.result_folder;
  StageRequest what = request("count");
  ASSERT_EQ(set_option(what.options.table, "word", "pieces"), "");
  EXPECT_EQ(run("count", what).end, End::Done);
  EXPECT_EQ(read(current("count") / "count.txt"), "1 pieces");
  const StageReport back = run("count");
  EXPECT_EQ(back.end, End::AlreadyDone);
  EXPECT_EQ(current("count"), first);
  EXPECT_EQ(behaviour().count_runs, 2);
}

TEST_F(RunStage, WhatIsNotKeyedMakesNoDifference) {
  run("count");
  StageRequest what = request("count");
  ASSERT_EQ(set_option(what.options.table, "threads", "9"), "");
  EXPECT_EQ(run("count", what).end, End::AlreadyDone);
  what.jobs = 7;
  EXPECT_EQ(run("count", what).end, End::AlreadyDone);
}

TEST_F(RunStage, ADeviceIsKeyedOnlyWhereTwinsDiffer) {
  StageRequest cuda = request("count");
  cuda.device = Device::Cuda;
  EXPECT_EQ(run("count").plan.manifest.key, run("count", cuda).plan.manifest.key);
  cuda = request("twins");
  cuda.device = Device::Cuda;
  EXPECT_NE(run("twins").plan.manifest.key, run("twins", cuda).plan.manifest.key);
}

TEST_F(RunStage, AnInputChangesTheKey) {
  run("count");
  write(root_ / "in/b.txt", "4");
  const StageReport second = run("count");
  EXPECT_EQ(second.end, End::Done);
  EXPECT_EQ(read(current("count") / "count.txt"), "2 files");
  EXPECT_THAT(second.plan.reasons, ElementsAre(HasSubstr("input texts changed (1 files, 1 bytes -> "
                                                         "2 files, 2 bytes)")));
}

TEST_F(RunStage, ReasonsNameWhatChanged) {
  StageRequest what = request("count");
  const Stage& stage = *find_stage(kTestStages, "count");
  EXPECT_THAT(plan_stage(kTestStages, stage, what).reasons,
              ElementsAre("it has no result in this workspace"));
  run("count", what);
  EXPECT_EQ(plan_stage(kTestStages, stage, what).state, StagePlan::State::Done);
  ASSERT_EQ(set_option(what.options.table, "word", "x"), "");
  ASSERT_EQ(set_option(what.options.table, "scale", "2.5"), "");
  EXPECT_THAT(plan_stage(kTestStages, stage, what).reasons,
              ElementsAre("option word: \"files\" -> \"x\"", "option scale: 1 -> 2.5"));
  what.force = true;
  EXPECT_THAT(plan_stage(kTestStages, stage, what).reasons, Contains("option scale: 1 -> 2.5"));
}

TEST_F(RunStage, ANewVersionOfAStageRunsAgain) {
  run("count");
  Stage newer = *find_stage(kTestStages, "count");
  newer.version = 3;
  const StageReport report = run_stage(kTestStages, newer, request("count"));
  EXPECT_EQ(report.end, End::Done);
  EXPECT_THAT(report.plan.reasons, ElementsAre("stage version: 2 -> 3"));
}

TEST_F(RunStage, PlanningChangesNothing) {
  plan_stage(kTestStages, *find_stage(kTestStages, "count"), request("count"));
  EXPECT_FALSE(std::filesystem::exists(root_ / "work"));
}

TEST_F(RunStage, ForceDoesItAgain) {
  run("count");
  StageRequest what = request("count");
  what.force = true;
  const StageReport report = run("count", what);
  EXPECT_EQ(report.end, End::Done);
  EXPECT_EQ(behaviour().count_runs, 2);
  EXPECT_THAT(report.plan.reasons, ElementsAre("--force"));
  EXPECT_THAT(names(folder("count")),
              ElementsAre(".commit-lock", ".lock", ::testing::_, "current"));
}

// --- damage: found, and done again

class DamagedResult : public RunStage {
 protected:
  DamagedResult() {
    run("count");
    result_ = current("count");
  }
  /// It is noticed by plan and status, and the next run makes it good.
  void expect_repair(const std::string& reason) {
    const StagePlan plan =
        plan_stage(kTestStages, *find_stage(kTestStages, "count"), request("count"));
    EXPECT_NE(plan.state, StagePlan::State::Done);
    EXPECT_THAT(plan.reasons, Contains(HasSubstr(reason)));
    const auto status = workspace_status(kTestStages, root_ / "work", Check::Digests);
    EXPECT_EQ(status[0].state, StageStatus::State::Damaged);
    EXPECT_EQ(run("count").end, End::Done);
    EXPECT_EQ(read(current("count") / "count.txt"), "1 files");
    EXPECT_EQ(workspace_status(kTestStages, root_ / "work", Check::Digests)[0].state,
              StageStatus::State::Done);
    EXPECT_EQ(run("count").end, End::AlreadyDone);
  }
  std::filesystem::path result_;
};

TEST_F(DamagedResult, WrongSize) {
  write(result_ / "count.txt", "1 fil");
  expect_repair("5 bytes, the manifest says 7");
}

TEST_F(DamagedResult, RightSizeWrongBytes) {
  write(result_ / "count.txt", "2 files");
  expect_repair("its bytes are not those that the stage wrote");
}

TEST_F(DamagedResult, MissingFile) {
  std::filesystem::remove(result_ / "count.txt");
  expect_repair("the file is missing");
}

TEST_F(DamagedResult, ExtraFile) {
  write(result_ / "more.txt", "x");
  expect_repair("the manifest does not name this file");
}

TEST_F(DamagedResult, ExtraHiddenFileInAFolder) {
  write(result_ / "deep/.x", "x");
  expect_repair("the manifest does not name this file");
}

TEST_F(DamagedResult, LinkInstead) {
  write(root_ / "elsewhere", "1 files");
  std::filesystem::remove(result_ / "count.txt");
  std::filesystem::create_symlink(root_ / "elsewhere", result_ / "count.txt");
  expect_repair("a symbolic link is in its place");
  EXPECT_EQ(read(root_ / "elsewhere"), "1 files");
}

TEST_F(DamagedResult, FolderInstead) {
  std::filesystem::remove(result_ / "count.txt");
  std::filesystem::create_directory(result_ / "count.txt");
  expect_repair("the file is missing");
}

TEST_F(DamagedResult, PipeInstead) {
  std::filesystem::remove(result_ / "count.txt");
  ASSERT_EQ(mkfifo((result_ / "count.txt").c_str(), 0600), 0);
  expect_repair("it is no regular file");
}

TEST_F(DamagedResult, NoManifest) {
  std::filesystem::remove(result_ / "manifest.json");
  expect_repair("manifest.json");
}

TEST_F(DamagedResult, EmptyManifest) {
  write(result_ / "manifest.json", "");
  expect_repair("manifest.json");
}

TEST_F(DamagedResult, TruncatedManifest) {
  const std::string text = read(result_ / "manifest.json");
  write(result_ / "manifest.json", text.substr(0, text.size() / 2));
  expect_repair("manifest.json");
}

TEST_F(DamagedResult, ManifestOfAnotherResult) {
  StageRequest what = request("count");
  ASSERT_EQ(set_option(what.options.table, "word", "x"), "");
  run("count", what);
  std::filesystem::copy_file(current("count") / "manifest.json", result_ / "manifest.json",
                             std::filesystem::copy_options::overwrite_existing);
  set_current(folder("count"), result_.filename());
  expect_repair("that of the folder it is in");
}

TEST_F(DamagedResult, ManifestOfAnotherStage) {
  run("twins");
  std::filesystem::copy_file(current("twins") / "manifest.json", result_ / "manifest.json",
                             std::filesystem::copy_options::overwrite_existing);
  expect_repair("stage: 'twins'; expected 'count'");
}

TEST_F(DamagedResult, ManifestIsALink) {
  std::filesystem::rename(result_ / "manifest.json", root_ / "m.json");
  std::filesystem::create_symlink(root_ / "m.json", result_ / "manifest.json");
  expect_repair("a symbolic link");
}

TEST_F(DamagedResult, ResultFolderIsALink) {
  std::filesystem::rename(result_, root_ / "away");
  std::filesystem::create_symlink(root_ / "away", result_);
  expect_repair("a symbolic link");
  EXPECT_TRUE(std::filesystem::exists(root_ / "away/count.txt")) << "links are not followed";
}

TEST_F(DamagedResult, AFinishInTheFutureIsAWarning) {
  Manifest manifest = read_manifest(result_, "count");
  manifest.finished = "2999-01-01T00:00:00Z";
  write(result_ / "manifest.json", manifest_text(manifest));
  const auto findings = check_outputs(result_, manifest, Check::Digests);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].code, "manifest-time");
  EXPECT_EQ(findings[0].severity, Severity::Warning);
  EXPECT_EQ(run("count").end, End::AlreadyDone);
}

TEST_F(DamagedResult, CurrentPointsNowhere) {
  std::filesystem::remove(folder("count") / "current");
  std::filesystem::create_symlink("0123456789abcdef", folder("count") / "current");
  EXPECT_EQ(run("count").end, End::AlreadyDone);
  EXPECT_EQ(current("count"), result_);
}

TEST_F(DamagedResult, CurrentIsMissing) {
  std::filesystem::remove(folder("count") / "current");
  EXPECT_EQ(run("count").end, End::AlreadyDone);
  EXPECT_EQ(current("count"), result_);
}

TEST_F(DamagedResult, CurrentLeadsOut) {
  for (const char* target : {"../../in", "/etc", "../count", ".", "0123456789ABCDEF", ""}) {
    std::filesystem::remove(folder("count") / "current");
    std::error_code ignored;
    std::filesystem::create_symlink(target, folder("count") / "current", ignored);
    EXPECT_FALSE(current_name(folder("count"))) << target;
    EXPECT_EQ(run("count").end, End::AlreadyDone);
    EXPECT_EQ(current("count"), result_);
  }
}

TEST_F(DamagedResult, CurrentIsAFile) {
  std::filesystem::remove(folder("count") / "current");
  write(folder("count") / "current", "x");
  EXPECT_EQ(run("count").end, End::AlreadyDone);
  EXPECT_EQ(current("count"), result_);
}

// --- refusals

TEST_F(RunStage, RefusesAMissingInput) {
  StageRequest what = request("count");
  what.input = root_ / "nothing";
  EXPECT_THAT(refusal<DataError>("count", what), HasSubstr("nothing there"));
  EXPECT_FALSE(std::filesystem::exists(root_ / "work"));
}

TEST_F(RunStage, RefusesAnEmptyInput) {
  std::filesystem::create_directory(root_ / "empty");
  StageRequest what = request("count");
  what.input = root_ / "empty";
  EXPECT_THAT(refusal<DataError>("count", what), HasSubstr("an empty folder"));
}

TEST_F(RunStage, RefusesALinkInTheInput) {
  std::filesystem::create_symlink("/etc/passwd", root_ / "in/link.txt");
  EXPECT_THAT(refusal<DataError>("count", request("count")),
              HasSubstr("a symbolic link, which may lead out of the folder"));
}

TEST_F(RunStage, RefusesAPipeInTheInput) {
  ASSERT_EQ(mkfifo((root_ / "in/pipe").c_str(), 0600), 0);
  EXPECT_THAT(refusal<DataError>("count", request("count")), HasSubstr("neither file nor folder"));
}

TEST_F(RunStage, FollowsTheInputItselfIfItIsALink) {
  std::filesystem::create_directory_symlink(root_ / "in", root_ / "link");
  StageRequest what = request("count");
  what.input = root_ / "link";
  EXPECT_EQ(run("count", what).end, End::Done);
  EXPECT_EQ(run("count").end, End::AlreadyDone) << "the same input by another name";
}

TEST_F(RunStage, HiddenFilesOfTheInputDoNotCount) {
  run("count");
  write(root_ / "in/.DS_Store", "x");
  EXPECT_EQ(run("count").end, End::AlreadyDone);
}

TEST_F(RunStage, RefusesAWorkspaceInsideTheInput) {
  StageRequest what = request("count");
  what.workspace = root_ / "in/work";
  EXPECT_THAT(refusal<DataError>("count", what), HasSubstr("a workspace inside its own input"));
  what.workspace = root_ / "in";
  EXPECT_THAT(refusal<DataError>("count", what), HasSubstr("a workspace inside its own input"));
  what.workspace = root_ / "in/../in/x";
  EXPECT_THAT(refusal<DataError>("count", what), HasSubstr("a workspace inside its own input"));
}

TEST_F(RunStage, RefusesAWorkspaceThatIsAFile) {
  StageRequest what = request("count");
  what.workspace = root_ / "file";
  write(what.workspace, "x");
  EXPECT_THAT(refusal<EnvironmentError>("count", what), HasSubstr("file"));
}

TEST_F(RunStage, RefusesAStageFolderThatIsALink) {
  std::filesystem::create_directories(root_ / "work");
  std::filesystem::create_directories(root_ / "elsewhere");
  std::filesystem::create_directory_symlink(root_ / "elsewhere", root_ / "work/count");
  EXPECT_THAT(refusal<DataError>("count", request("count")),
              HasSubstr("a symbolic link; expected a folder: a workspace holds no links"));
  EXPECT_THAT(names(root_ / "elsewhere"), IsEmpty());
}

TEST_F(RunStage, RefusesALockThatIsALink) {
  std::filesystem::create_directories(root_ / "work/count");
  write(root_ / "precious", "x");
  std::filesystem::create_symlink(root_ / "precious", root_ / "work/count/.lock");
  EXPECT_THAT(refusal<EnvironmentError>("count", request("count")), HasSubstr(".lock"));
}

TEST_F(RunStage, RemovesAStagingThatIsALinkWithoutFollowingIt) {
  write(root_ / "precious/file", "x");
  const StagePlan plan =
      plan_stage(kTestStages, *find_stage(kTestStages, "frames"), request("frames"));
  std::filesystem::create_directories(plan.stage_folder);
  std::filesystem::create_directory_symlink(root_ / "precious", plan.staging_folder);
  EXPECT_EQ(run("frames").end, End::Done);
  EXPECT_THAT(names(root_ / "precious"), ElementsAre("file"));
}

TEST_F(RunStage, RefusesAReadOnlyWorkspace) {
  constexpr uid_t kNobody = 65534;
  std::filesystem::create_directories(root_ / "work");
  if (geteuid() == 0) {  // root may write everywhere: be somebody else for a moment
    ASSERT_EQ(chown(root_.path().c_str(), kNobody, kNobody), 0);
    ASSERT_EQ(chown((root_ / "work").c_str(), kNobody, kNobody), 0);
  }
  ASSERT_EQ(chmod((root_ / "work").c_str(), 0500), 0);
  const bool was_root = geteuid() == 0 && seteuid(kNobody) == 0;
  const std::string message = refusal<EnvironmentError>("count", request("count"));
  if (was_root) {
    ASSERT_EQ(seteuid(0), 0);
  }
  EXPECT_THAT(message, HasSubstr((root_ / "work/count").string()));
  EXPECT_THAT(message, HasSubstr("Permission denied"));
}

TEST_F(RunStage, RefusesToSplitWhatHasNoFrames) {
  StageRequest what = request("count");
  what.selection.shards = 2;
  EXPECT_THROW(run("count", what), LogicError);
}

TEST_F(RunStage, RefusesOptionsOutOfRange) {
  StageRequest what = request("count");
  static_cast<CountOptions*>(what.options.values.get())->scale = -1;
  EXPECT_THROW(run("count", what), LogicError);
}

TEST_F(RunStage, RefusesWithoutTheStageBefore) {
  EXPECT_THAT(refusal<DataError>("double", request("double")),
              HasSubstr("run 'atelier count' first"));
}

TEST_F(RunStage, RefusesADamagedStageBefore) {
  run("count");
  write(current("count") / "count.txt", "9 files");
  EXPECT_THAT(refusal<DataError>("double", request("double")),
              HasSubstr("run 'atelier count' first"));
}

TEST_F(RunStage, RefusesAnInputThatChangesMeanwhile) {
  behaviour().during = [this] { write(root_ / "in/late.txt", "x"); };
  EXPECT_THAT(refusal<DataError>("count", request("count")),
              HasSubstr("files that changed while the stage ran"));
  EXPECT_FALSE(current_name(folder("count")));
}

TEST_F(RunStage, RefusesWithoutSpace) {
  behaviour().during = [] { throw LogicError("not reached"); };
  behaviour().space = std::int64_t{1} << 60;
  EXPECT_THAT(refusal<EnvironmentError>("count", request("count")),
              HasSubstr("GB are free, the stage "
                        "needs 1.15e+09 GB"));
}

// --- misuse by a stage is a defect, and commits nothing

struct Misuse {
  const char* name;
  void (*run)(StageRun& run);
};

class StageMisuse : public RunStage, public ::testing::WithParamInterface<Misuse> {};

INSTANTIATE_TEST_SUITE_P(
    All, StageMisuse,
    ::testing::Values(
        Misuse{"PathOut", [](StageRun& run) { run.output_text("../x", "x"); }},
        Misuse{"AbsolutePath", [](StageRun& run) { run.output_text("/tmp/x", "x"); }},
        Misuse{"Hidden", [](StageRun& run) { run.output_text(".x", "x"); }},
        Misuse{"TheManifest", [](StageRun& run) { run.output_text("manifest.json", "x"); }},
        Misuse{"Twice",
               [](StageRun& run) {
                 run.output_text("x", "x");
                 run.output_text("x", "y");
               }},
        Misuse{"UnknownInput", [](StageRun& run) { run.input("cloth"); }},
        Misuse{"MetricNaN", [](StageRun& run) { run.metric("m", 0.0 / 0.0); }},
        Misuse{"FramesUnsaid",
               [](StageRun& run) { run.each_frame("f", ".t", {1}, [](int, const auto&) {}); }}),
    [](const ::testing::TestParamInfo<Misuse>& misuse) { return misuse.param.name; });

TEST_P(StageMisuse, IsRefused) {
  Stage stage = *find_stage(kTestStages, "count");
  stage.run = GetParam().run;
  EXPECT_THROW(run_stage(kTestStages, stage, request("count")), LogicError);
  EXPECT_FALSE(current_name(folder("count")));
  EXPECT_THAT(names(folder("count")), ::testing::Each(::testing::Not(HasSubstr("staging"))));
}

struct FrameMisuse {
  const char* name;
  std::vector<int> frame_ids;
};

class StageFrameMisuse : public RunStage, public ::testing::WithParamInterface<FrameMisuse> {};

INSTANTIATE_TEST_SUITE_P(
    All, StageFrameMisuse,
    ::testing::Values(FrameMisuse{"None", {}}, FrameMisuse{"Negative", {-1, 2}},
                      FrameMisuse{"Twice", {1, 1}}, FrameMisuse{"Backwards", {3, 2}}),
    [](const ::testing::TestParamInfo<FrameMisuse>& misuse) { return misuse.param.name; });

TEST_P(StageFrameMisuse, IsRefused) {
  behaviour().frame_ids = GetParam().frame_ids;
  EXPECT_THROW(run("frames"), LogicError);
}

// --- what a stage of several files, and a chain, do

TEST_F(RunStage, AFailureLeavesNoStaging) {
  behaviour().during = [] { throw DataError("f", "", "bad", "good"); };
  EXPECT_THROW(run("count"), DataError);
  EXPECT_THAT(names(folder("count")), ElementsAre(".commit-lock", ".lock"));
}

TEST_F(RunStage, AChainRunsOnResults) {
  run("count");
  EXPECT_EQ(run("double").end, End::Done);
  EXPECT_EQ(read(current("double") / "double.txt"), "1 files1 files");
  const Manifest manifest = read_manifest(current("double"), "double");
  EXPECT_EQ(manifest.inputs[0].stage, "count");
}

TEST_F(RunStage, AChainIsCutWhereNothingChanges) {
  run("count");
  run("double");
  StageRequest what = request("count");
  ASSERT_EQ(set_option(what.options.table, "scale", "2"), "");  // another key, the same bytes
  EXPECT_EQ(run("count", what).end, End::Done);
  EXPECT_EQ(run("double").end, End::AlreadyDone);
}

TEST_F(RunStage, AChainShowsWhatIsOutdated) {
  run("count");
  run("double");
  write(root_ / "in/b.txt", "4");
  run("count");
  auto status = workspace_status(kTestStages, root_ / "work");
  EXPECT_EQ(status[0].state, StageStatus::State::Done);
  const auto found = std::find_if(status.begin(), status.end(),
                                  [](const StageStatus& s) { return s.stage == "double"; });
  EXPECT_EQ(found->state, StageStatus::State::Outdated);
  EXPECT_THAT(found->reasons, ElementsAre(HasSubstr("'count' has changed since")));
}

TEST_F(RunStage, ConsentTravelsDownTheChain) {
  write(root_ / "in/capture.toml",
        "[consent]\nwho = 'P. Doe'\nscope = 'research'\nuntil = 2030-12-31\n");
  run("count");
  run("double");
  const std::vector<Consent> expected = {{"P. Doe", "research", "2030-12-31"}};
  EXPECT_EQ(read_manifest(current("count"), "count").consent, expected);
  EXPECT_EQ(read_manifest(current("double"), "double").consent, expected);
}

TEST_F(RunStage, AResultThatIsDoneLearnsNewConsent) {
  write(root_ / "capture.toml", "[consent]\nwho = 'P. Doe'\nscope = 'research'\n");
  run("count");
  run("double");
  write(root_ / "capture.toml", "[consent]\nwho = 'P. Doe'\nscope = 'nothing'\n");
  const StageReport again = run("count");
  EXPECT_EQ(again.end, End::AlreadyDone);
  const std::vector<Consent> expected = {{"P. Doe", "nothing", ""}};
  EXPECT_EQ(again.manifest.consent, expected);
  EXPECT_EQ(read_manifest(current("count"), "count").consent, expected);
  EXPECT_EQ(run("double").end, End::AlreadyDone);
  EXPECT_EQ(read_manifest(current("double"), "double").consent, expected);
  EXPECT_THAT(check_outputs(current("count"), again.manifest, Check::Digests), IsEmpty());
}

TEST_F(RunStage, WhatMayNotBeLookedAtIsNotAbsent) {
  constexpr uid_t kNobody = 65534;
  run("count");
  ASSERT_EQ(chmod(root_.path().c_str(), 0755), 0);
  ASSERT_EQ(chmod((root_ / "work").c_str(), 0000), 0);
  const bool was_root = geteuid() == 0 && seteuid(kNobody) == 0;
  const auto message = [](const auto& look) -> std::string {
    try {
      look();
    } catch (const EnvironmentError& error) {
      return error.what();
    } catch (const DataError& error) {
      return std::string("bad data: ") + error.what();
    }
    return "nothing was said";
  };
  const std::string status = message([&] { workspace_status(kTestStages, root_ / "work"); });
  const std::string gc = message([&] { collect_garbage(kTestStages, root_ / "work", true); });
  const std::string again = message([&] { run("count"); });
  if (was_root) {
    ASSERT_EQ(seteuid(0), 0);
  }
  ASSERT_EQ(chmod((root_ / "work").c_str(), 0700), 0);
  for (const std::string& said : {status, gc, again}) {
    EXPECT_THAT(said, HasSubstr("Permission denied"));
    EXPECT_THAT(said, HasSubstr((root_ / "work").string()));
    EXPECT_THAT(said, ::testing::Not(HasSubstr("bad data")));
  }
}

TEST_F(RunStage, AStageThatIsToldToStopLeavesNothing) {
  behaviour().asks_to_stop = true;
  StageEvents events;
  events.stop = [] { return true; };
  EXPECT_EQ(run("count", request("count"), events).end, End::Stopped);
  EXPECT_THAT(names(folder("count")), ElementsAre(".commit-lock", ".lock"));
}

}  // namespace
}  // namespace atelier::testing
