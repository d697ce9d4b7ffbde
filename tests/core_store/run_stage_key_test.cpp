// What makes the result of a stage another one, and what is then said of those made from it.
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/store/commit.h"
#include "core/store/named_files.h"
#include "core/store/run_stage.h"
#include "core/store/workspace_status.h"
#include "tests/core_store/run_stage_fixture.h"

namespace atelier::fixtures {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using End = StageReport::End;

TEST_F(RunStage, OptionalInput_IsUsedOncePresent) {
  EXPECT_EQ(run("either").end, End::Done);
  EXPECT_EQ(read(current("either") / "either.txt"), "not counted");
  run("count");
  const std::vector<StageStatus> all =
      workspace_status(kTestStages, root_ / "work", Check::Digests);
  const auto found = std::find_if(all.begin(), all.end(),
                                  [](const StageStatus& s) { return s.stage == "either"; });
  EXPECT_EQ(found->state, StageStatus::State::Outdated);
  EXPECT_THAT(found->reasons, Contains(HasSubstr("'count' has a result now")));
  EXPECT_EQ(run("either").end, End::Done);
  EXPECT_EQ(read(current("either") / "either.txt"), "counted");
  EXPECT_EQ(run("either").end, End::AlreadyDone);
}

TEST_F(RunStage, FileNamedByOption_IsPartOfTheKey) {
  StageRequest what = request("either");
  write(root_ / "motion.txt", "hop");
  ASSERT_EQ(set_option(what.options.table, "word", (root_ / "motion.txt").string()), "");
  const StageReport first = run("either", what);
  EXPECT_EQ(read(current("either") / "either.txt"), "not counted, hop");
  EXPECT_EQ(run("either", what).end, End::AlreadyDone);
  write(root_ / "motion.txt", "jump");
  const StageReport second = run("either", what);
  EXPECT_EQ(second.end, End::Done);
  EXPECT_NE(second.manifest.key, first.manifest.key);
  EXPECT_EQ(read(current("either") / "either.txt"), "not counted, jump");
}

TEST_F(RunStage, EveryListedFile_IsPartOfTheKey) {
  write(root_ / "tee.obj", "tee");
  write(root_ / "skirt.obj", "skirt");
  StageRequest what = request("either");
  const std::string list =
      "upper=" + (root_ / "tee.obj").string() + ", lower=" + (root_ / "skirt.obj").string();
  ASSERT_EQ(set_option(what.options.table, "word", list), "");
  const StageReport first = run("either", what);
  EXPECT_EQ(std::ssize(first.manifest.inputs), 3);
  EXPECT_EQ(run("either", what).end, End::AlreadyDone);
  write(root_ / "skirt.obj", "another");
  EXPECT_THAT(plan_stage(kTestStages, *find_stage(kTestStages, "either"), what).reasons,
              ElementsAre(HasSubstr("input --word changed (1 file, 5 bytes -> 1 file, 7 bytes)")));
  EXPECT_EQ(run("either", what).end, End::Done);
}

TEST_F(RunStage, DefaultOptionText_IsNotTakenForAFile) {
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(root_.path());
  write(root_ / CountOptions{}.word, "lies about");
  EXPECT_EQ(std::ssize(run("either").manifest.inputs), 1);
  std::filesystem::current_path(before);
}

TEST_F(RunStage, FileNamesInText_AreFound) {
  const auto at = [&](const char* name) { return (root_ / name).string(); };
  write(root_ / "a.obj", "a");
  write(root_ / "b,c.obj", "b");
  EXPECT_THAT(files_named_in(at("b,c.obj")), ElementsAre(root_ / "b,c.obj"));
  EXPECT_THAT(files_named_in("tee+" + at("a.obj") + "+mhclo:" + at("a.obj")),
              ElementsAre(root_ / "a.obj", root_ / "a.obj"));
  EXPECT_THAT(files_named_in("upper=" + at("a.obj") + ",lower=" + at("none.obj")),
              ElementsAre(root_ / "a.obj"));
  for (const char* words : {"", ",", "auto", "upper=", "=", " , +", "a=b:c"}) {
    EXPECT_THAT(files_named_in(words), IsEmpty()) << words;
  }
  EXPECT_THROW(files_named_in("upper=" + std::string(5000, 'x')), EnvironmentError);
}

TEST_F(RunStage, ChangedOption_MakesNewResultAndOldOneIsReused) {
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

TEST_F(RunStage, UnkeyedOptions_DoNotChangeTheKey) {
  run("count");
  StageRequest what = request("count");
  ASSERT_EQ(set_option(what.options.table, "threads", "9"), "");
  EXPECT_EQ(run("count", what).end, End::AlreadyDone);
  what.jobs = 7;
  EXPECT_EQ(run("count", what).end, End::AlreadyDone);
}

TEST_F(RunStage, Device_IsKeyedOnlyWhereTwinsDiffer) {
  StageRequest cuda = request("count");
  cuda.device = Device::Cuda;
  EXPECT_EQ(run("count").plan.manifest.key, run("count", cuda).plan.manifest.key);
  cuda = request("twins");
  cuda.device = Device::Cuda;
  EXPECT_NE(run("twins").plan.manifest.key, run("twins", cuda).plan.manifest.key);
}

TEST_F(RunStage, ChangedInput_ChangesTheKey) {
  run("count");
  write(root_ / "in/b.txt", "4");
  const StageReport second = run("count");
  EXPECT_EQ(second.end, End::Done);
  EXPECT_EQ(read(current("count") / "count.txt"), "2 files");
  EXPECT_THAT(second.plan.reasons, ElementsAre(HasSubstr("input texts changed (1 file, 1 bytes -> "
                                                         "2 files, 2 bytes)")));
}

TEST_F(RunStage, PlanReasons_NameWhatChanged) {
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

TEST_F(RunStage, NewStageVersion_RunsAgain) {
  run("count");
  Stage newer = *find_stage(kTestStages, "count");
  newer.version = 3;
  const StageReport report = run_stage(kTestStages, newer, request("count"));
  EXPECT_EQ(report.end, End::Done);
  EXPECT_THAT(report.plan.reasons, ElementsAre("stage version: 2 -> 3"));
}

TEST_F(RunStage, StageChain_RunsOnResults) {
  run("count");
  EXPECT_EQ(run("double").end, End::Done);
  EXPECT_EQ(read(current("double") / "double.txt"), "1 files1 files");
  const Manifest manifest = read_manifest(current("double"), "double");
  EXPECT_EQ(manifest.inputs[0].stage, "count");
}

TEST_F(RunStage, UnchangedIntermediateResult_StopsTheChain) {
  run("count");
  run("double");
  StageRequest what = request("count");
  ASSERT_EQ(set_option(what.options.table, "scale", "2"), "");  // another key, the same bytes
  EXPECT_EQ(run("count", what).end, End::Done);
  EXPECT_EQ(run("double").end, End::AlreadyDone);
}

TEST_F(RunStage, ChangedUpstreamResult_MakesStageOutdated) {
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
  EXPECT_TRUE(found->inputs_changed);
  EXPECT_FALSE(status[0].inputs_changed);
}

TEST_F(RunStage, OutdatedUpstreamOfSeveralInputs_IsNamedOnce) {
  std::array<Stage, 2> stages = {kTestStages[0], kTestStages[1]};
  stages[0].outputs = {"counts", "sums"};
  stages[1].inputs = {"counts", "sums"};
  for (const Stage& stage : stages) {
    run_stage(stages, stage, request(std::string(stage.name)));
  }
  stages[0].version = 3;
  const StageStatus second = workspace_status(stages, root_ / "work")[1];
  EXPECT_THAT(second.reasons, ElementsAre("'count' before it is outdated"));
  EXPECT_FALSE(second.inputs_changed) << "there is a new version, of the same files";
}

// Two folders of one result, of which one changes.
TEST_F(RunStage, ChangedInputsOfSameResult_AreNamed) {
  std::array<Stage, 2> stages = {kTestStages[0], kTestStages[1]};
  stages[0].outputs = {"left", "right"};
  stages[0].run = [](StageRun& run) {
    const std::string& word = run.options<CountOptions>().word;
    run.output_text("left/a.txt", word.substr(0, 1));
    run.output_text("right/b.txt", word.substr(1));
  };
  stages[1].inputs = {"left", "right"};
  stages[1].run = [](StageRun& run) { run.output_text("made.txt", "it"); };
  const auto make = [&](const Stage& stage, const char* word) {
    StageRequest what = request(std::string(stage.name));
    set_option(what.options.table, "word", word, "a test");
    run_stage(stages, stage, what);
  };
  const auto reasons = [&] { return workspace_status(stages, root_ / "work")[1].reasons; };
  make(stages[0], "ab");
  make(stages[1], "ab");
  EXPECT_THAT(reasons(), ElementsAre());
  make(stages[0], "ac");
  EXPECT_THAT(reasons(), ElementsAre("its input right of 'count' has changed since"));
  make(stages[0], "dc");
  EXPECT_THAT(reasons(), ElementsAre("the result of 'count', which its inputs left, right are of, "
                                     "has changed since"));
  std::filesystem::path older;  // of which nothing can be told once it is gone
  for (const ManifestInput& input : read_manifest(current("double"), "double").inputs) {
    older = input.path;
  }
  make(stages[0], "ac");
  std::filesystem::remove_all(older);
  EXPECT_THAT(reasons(), ElementsAre("the result of 'count', which its inputs left, right are of, "
                                     "has changed since"));
}

TEST_F(RunStage, Status_DetectsChangedInput) {
  run("count");
  const auto first = [&](Check check = Check::Sizes) {
    return workspace_status(kTestStages, root_ / "work", check)[0];
  };
  EXPECT_EQ(first().state, StageStatus::State::Done);
  write(root_ / "in/a.txt", "4");  // the same size
  EXPECT_EQ(first().state, StageStatus::State::Outdated);
  EXPECT_THAT(first().reasons,
              ElementsAre("input texts changed (1 file, 1 bytes -> 1 file, 1 bytes)"));
  write(root_ / "in/a.txt", "3");  // as it was, later
  EXPECT_EQ(first().state, StageStatus::State::Done);
  write(root_ / "in/b.txt", "1");
  EXPECT_THAT(first().reasons,
              ElementsAre("input texts changed (1 file, 1 bytes -> 2 files, 2 bytes)"));
  EXPECT_THAT(first(Check::Digests).reasons, ::testing::SizeIs(1));
}

TEST_F(RunStage, Status_ReportsMissingInput) {
  run("count");
  std::filesystem::rename(root_ / "in", root_ / "elsewhere");
  const StageStatus status = workspace_status(kTestStages, root_ / "work")[0];
  EXPECT_EQ(status.state, StageStatus::State::Done);
  ASSERT_EQ(status.findings.size(), 1u);
  EXPECT_EQ(status.findings[0].code, "input-gone");
  EXPECT_EQ(status.findings[0].severity, Severity::Warning);
  StageRequest moved = request("count");
  moved.input = root_ / "elsewhere";
  EXPECT_EQ(run("count", moved).end, End::AlreadyDone);  // which learns the place
  EXPECT_THAT(workspace_status(kTestStages, root_ / "work")[0].findings, ::testing::IsEmpty());
}

TEST_F(RunStage, ManifestWithoutStamp_IsComparedByBytes) {
  run("count");
  Manifest manifest = read_manifest(current("count"), "count");
  manifest.inputs[0].stamp = {};
  replace_manifest(current("count"), manifest);
  EXPECT_EQ(workspace_status(kTestStages, root_ / "work")[0].state, StageStatus::State::Done);
  write(root_ / "in/a.txt", "5");
  EXPECT_EQ(workspace_status(kTestStages, root_ / "work")[0].state, StageStatus::State::Outdated);
}

}  // namespace
}  // namespace atelier::fixtures
