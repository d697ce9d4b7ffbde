#include "core/store/run_stage.h"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/file_kind.h"
#include "core/store/collect_garbage.h"
#include "core/store/commit.h"
#include "core/store/file_lock.h"
#include "core/store/result.h"
#include "core/store/workspace_status.h"
#include "tests/core_store/run_stage_fixture.h"
#include "tests/support/denied_folder.h"
#include "tests/support/refusals.h"

namespace atelier::fixtures {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using End = StageReport::End;

TEST_F(RunStage, SecondRun_IsAlreadyDone) {
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

TEST_F(RunStage, Manifest_RecordsTheRun) {
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

TEST_F(RunStage, WorkspaceFiles_AreAccessibleByOwnerOnly) {
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

TEST_F(RunStage, DamagedOptionalInput_IsRefused) {
  run("count");
  write(current("count") / "count.txt", "2 files");
  EXPECT_THAT(refusal<DataError>("either", request("either")), HasSubstr("run 'atelier count'"));
}

TEST_F(RunStage, ResultsOfOtherInput_AreRefused) {
  run("count");
  StageRequest what = request("either");
  what.input = root_ / "other";
  what.force = true;
  write(root_ / "other/a.txt", "4");
  const std::string refused = refusal<DataError>("either", what);
  EXPECT_THAT(refused, HasSubstr("result of 'count' was made from, not"));
  EXPECT_THAT(refused, HasSubstr("run 'atelier count'"));
  // The same content elsewhere, and the same place with more or less in it, are no other input.
  write(root_ / "other/a.txt", "3");
  EXPECT_EQ(run("either", what).end, End::Done);
  write(root_ / "in/b.txt", "5");
  EXPECT_EQ(run("either").end, End::Done);
  // What lies elsewhere is followed once its first stage has been.
  write(root_ / "other/a.txt", "4");
  StageRequest first = request("count");
  first.input = what.input;
  EXPECT_EQ(run("count", first).end, End::Done);
  EXPECT_EQ(run("either", what).end, End::Done);
}

TEST_F(RunStage, InputErrors_ArePartOfTheReport) {
  Stage stage = *find_stage(kTestStages, "count");
  for (const double bad : {0.0, 2.0}) {
    std::filesystem::remove_all(root_ / "work");
    static double errors;
    errors = bad;
    stage.run = [](StageRun& run) { run.metric("bad", errors); };
    EXPECT_EQ(run_stage(kTestStages, stage, request("count")).input_errors, bad > 0);
    const StageReport again = run_stage(kTestStages, stage, request("count"));
    EXPECT_EQ(again.end, End::AlreadyDone);
    EXPECT_EQ(again.input_errors, bad > 0) << "a result that is done says it again";
  }
}

TEST_F(RunStage, UnfinishedScratch_IsKeptForTheNextRun) {
  Stage stage = *find_stage(kTestStages, "count");
  static int tries;
  tries = 0;
  stage.run = [](StageRun& run) {
    const std::filesystem::path kept = run.scratch_folder() / "checkpoint";
    EXPECT_EQ(std::filesystem::exists(kept), tries == 1);
    write_file_atomically(kept, "half");
    if (++tries < 4 && tries != 2) {
      throw EnvironmentError("disk", "full");
    }
    run.output_text("count.txt", "done");
  };
  EXPECT_THROW(run_stage(kTestStages, stage, request("count")), EnvironmentError);
  EXPECT_EQ(run_stage(kTestStages, stage, request("count")).end, End::Done);
  EXPECT_FALSE(std::filesystem::exists(current("count") / ".scratch")) << "no part of the result";
  StageRequest again = request("count");
  again.force = true;
  EXPECT_THROW(run_stage(kTestStages, stage, again),
               EnvironmentError);  // began without the first's
  tries = 3;
  EXPECT_EQ(run_stage(kTestStages, stage, again).end, End::Done) << "nor --force with what is left";
}

TEST_F(RunStage, Metrics_AreShownWithTheirUnits) {
  const Stage* count = find_stage(kTestStages, "count");
  EXPECT_EQ(metric_text(count, "length", 0.25), "0.25 m");
  EXPECT_EQ(metric_text(count, "files", 3), "3");
  EXPECT_EQ(metric_text(count, "of_another_version", 3), "3");
  EXPECT_EQ(metric_text(nullptr, "length", 3), "3");
}

TEST_F(RunStage, WorkspaceReadableByOthers_GivesAWarning) {
  EXPECT_THAT(run("count").plan.warnings, IsEmpty()) << "it was made for its owner alone";
  for (const mode_t mode : {0755, 0710, 0702}) {
    ASSERT_EQ(chmod((root_ / "work").c_str(), mode), 0);
    const std::vector<std::string> warnings = run("count").plan.warnings;
    ASSERT_EQ(warnings.size(), 1u) << mode;
    EXPECT_THAT(warnings[0], HasSubstr("others may look into"));
    EXPECT_THAT(warnings[0], HasSubstr("chmod 700"));
    struct stat status {};
    ASSERT_EQ(stat((root_ / "work").c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, mode) << "its owner's wish";
  }
  ASSERT_EQ(chmod((root_ / "work").c_str(), 0700), 0);
  EXPECT_THAT(run("count").plan.warnings, IsEmpty());
}

TEST_F(RunStage, Planning_ChangesNothing) {
  plan_stage(kTestStages, *find_stage(kTestStages, "count"), request("count"));
  EXPECT_FALSE(std::filesystem::exists(root_ / "work"));
}

TEST_F(RunStage, Force_RunsAgain) {
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

TEST_F(RunStage, TimeLeft_CountsOnlyTheCurrentUnit) {
  std::vector<StageProgress> told;
  StageEvents events;
  events.progress = [&](const StageProgress& progress) {
    if (progress.unit == "steps") {
      told.push_back(progress);
    }
  };
  behaviour().reports = [](StageRun& run) {
    run.progress(40, 50, "steps");  // that earlier runs have done
    run.progress(45, 50, "steps", {{"loss", 0.5}});
    run.progress(0, 50, "steps");
  };
  run("count", request("count"), events);
  ASSERT_EQ(told.size(), 3U);
  EXPECT_EQ(told[0].per_second, 0) << "not known";
  EXPECT_EQ(told[0].seconds_left, 0);
  EXPECT_GT(told[1].per_second, 0);
  EXPECT_NEAR(told[1].seconds_left, 5 / told[1].per_second, 1e-9);
  EXPECT_EQ(told[1].figures, (std::vector<std::pair<std::string, double>>{{"loss", 0.5}}));
  EXPECT_EQ(told[2].per_second, 0) << "another count";
}

// --- what a stage of several files, and a chain, do

TEST_F(RunStage, Failure_LeavesNoStagingFolder) {
  behaviour().during = [] { throw DataError("f", "", "bad", "good"); };
  EXPECT_THROW(run("count"), DataError);
  EXPECT_FALSE(std::filesystem::exists(root_ / "work")) << "the run made it";
}

TEST_F(RunStage, UnreadableWorkspace_IsNotTakenForAbsent) {
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

TEST_F(RunStage, ReadOnlyWorkspace_CanBeInspected) {
  constexpr uid_t kNobody = 65534;
  run("count");
  run("frames");
  std::filesystem::remove(folder("frames") / ".lock");
  ASSERT_EQ(chmod(root_.path().c_str(), 0755), 0);
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root_.path())) {
    if (!entry.is_symlink()) {
      ASSERT_EQ(chmod(entry.path().c_str(), entry.is_directory() ? 0555 : 0444), 0);
    }
  }
  ASSERT_EQ(chmod((folder("count") / ".lock").c_str(), 0000), 0);
  ASSERT_EQ(chmod((root_ / "work").c_str(), 0555), 0);
  struct AsNobody {
    bool was_root = geteuid() == 0 && seteuid(kNobody) == 0;
    ~AsNobody() { EXPECT_TRUE(!was_root || seteuid(0) == 0); }
  };
  const auto [all, garbage, again] = [&] {
    const AsNobody nobody;
    return std::tuple(workspace_status(kTestStages, root_ / "work", Check::Digests),
                      collect_garbage(kTestStages, root_ / "work", true), run("count"));
  }();
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root_.path())) {
    if (entry.is_directory()) {
      ASSERT_EQ(chmod(entry.path().c_str(), 0700), 0);
    }
  }
  EXPECT_EQ(all[0].state, StageStatus::State::Done);
  EXPECT_FALSE(all[0].running);
  EXPECT_THAT(garbage, IsEmpty());
  EXPECT_EQ(again.end, End::AlreadyDone);
  EXPECT_FALSE(std::filesystem::exists(folder("frames") / ".lock")) << "looking made it";
}

TEST_F(RunStage, EmptySelectionOnFinishedResult_IsRefused) {
  run("frames");
  StageRequest what = request("frames");
  ASSERT_EQ(set_frames(what.selection, "100:200"), "");
  EXPECT_THAT(refusal<DataError>("frames", what), HasSubstr("frames: '100:200'; expected a range"));
  ASSERT_EQ(set_frames(what.selection, "3:6"), "");
  EXPECT_EQ(run("frames", what).end, End::AlreadyDone);
}

TEST_F(RunStage, InputOfOtherKind_IsRefusedWhenPlanned) {
  Stage picky = *find_stage(kTestStages, "count");
  picky.check_input = [](const std::filesystem::path& input, const OptionTable&) {
    if (!std::filesystem::is_directory(input)) {
      throw DataError(input.string(), "scene", "no folder", "a folder");
    }
  };
  const std::vector<Stage> stages = {picky};
  StageRequest what = request("count");
  EXPECT_EQ(plan_stage(stages, picky, what, {}).state, StagePlan::State::Run);
  what.input = root_ / "in/a.txt";
  try {
    plan_stage(stages, picky, what, {});
    FAIL() << "it was planned";
  } catch (const DataError& error) {
    EXPECT_EQ(error.found, "no folder");
  }
  what.input = root_ / "nothing";
  try {
    plan_stage(stages, picky, what, {});
    FAIL() << "it was planned";
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), HasSubstr("nothing there"));
  }
}

TEST_F(RunStage, ResultWithoutCurrentLink_IsCountedAndFoundAgain) {
  run("count");
  const std::filesystem::path result = current("count");
  std::filesystem::remove(folder("count") / "current");
  EXPECT_EQ(unlinked_results(folder("count")), 1);
  EXPECT_EQ(workspace_status(kTestStages, root_ / "work")[0].unlinked_results, 1);
  EXPECT_THAT(collect_garbage(kTestStages, root_ / "work", false), IsEmpty());
  EXPECT_EQ(run("count").end, End::AlreadyDone);
  EXPECT_EQ(current("count"), result);
  EXPECT_EQ(workspace_status(kTestStages, root_ / "work")[0].unlinked_results, 0);
}

TEST_F(RunStage, FolderInPlaceOfCurrentLink_IsRefused) {
  run("count");
  const std::filesystem::path current_link = folder("count") / "current";
  std::filesystem::remove(current_link);
  std::filesystem::create_directory(current_link);
  const StageStatus status = workspace_status(kTestStages, root_ / "work")[0];
  EXPECT_EQ(status.state, StageStatus::State::Damaged);
  EXPECT_EQ(status.unlinked_results, 0) << "the stage cannot link it";
  ASSERT_EQ(status.findings.size(), 1U);
  EXPECT_EQ(status.findings[0].code, "current-folder");
  try {
    run("count");
    FAIL() << "it was not refused";
  } catch (const DataError& error) {
    EXPECT_EQ(error.file, current_link.string());
    EXPECT_EQ(error.found, status.findings[0].what);
    EXPECT_EQ(error.expected, "a link: " + status.findings[0].advice);
  }
  std::filesystem::remove(current_link);
  EXPECT_EQ(run("count").end, End::AlreadyDone);
}

TEST_F(RunStage, FileInPlaceOfStageFolder_IsRefused) {
  std::filesystem::create_directories(root_ / "work");
  std::ofstream(folder("count")) << "a file";
  const std::string words = folder("count").string() + ": a file; expected a folder";
  ATELIER_EXPECT_REFUSED(run("count"), DataError, words);
  ATELIER_EXPECT_REFUSED(run("double"), DataError, words);
  ATELIER_EXPECT_REFUSED(workspace_status(kTestStages, root_ / "work"), DataError, words);
  ATELIER_EXPECT_REFUSED(collect_garbage(kTestStages, root_ / "work", true), DataError, words);
}

TEST_F(RunStage, UnreadableResultFolder_IsNamed) {
  run("count");
  const std::filesystem::path result = current("count");
  const Manifest manifest = read_manifest(result, "count");
  std::filesystem::create_directory(result / "frames");
  {
    const DeniedFolder without_rights(result / "frames", root_.path());
    ATELIER_EXPECT_REFUSED(check_outputs(result, manifest, Check::Sizes), EnvironmentError,
                           (result / "frames").string() + ": cannot list the folder: Permission");
  }
  const DeniedFolder without_rights(root_ / "work", root_.path());
  const std::string words = (root_ / "work").string() + ": Permission denied";
  ATELIER_EXPECT_REFUSED(file_kind(result / "frames"), EnvironmentError, words);
  ATELIER_EXPECT_REFUSED(list_folder(result / "frames"), EnvironmentError,
                         (root_ / "work").string() + ": cannot list the folder");
}

TEST_F(RunStage, RefusedRun_KeepsExistingFolders) {
  behaviour().during = [] { throw DataError("f", "", "bad", "good"); };
  StageRequest what = request("count");
  what.workspace = root_ / "new/er/work";
  EXPECT_THROW(run("count", what), DataError);
  EXPECT_FALSE(std::filesystem::exists(root_ / "new"));
  std::filesystem::create_directories(root_ / "work");
  EXPECT_THROW(run("count"), DataError);
  EXPECT_TRUE(std::filesystem::exists(root_ / "work"));
  EXPECT_THAT(names(root_ / "work"), IsEmpty());
  const auto lock = [&] {
    std::filesystem::create_directories(folder("count"));
    return FileLock::try_lock(folder("count") / ".lock", FileLock::Mode::Shared);
  }();
  remove_bare_stage_folder(folder("count"));
  EXPECT_TRUE(std::filesystem::exists(folder("count") / ".lock")) << "somebody holds it";
}

TEST_F(RunStage, StoppedStage_LeavesNothing) {
  behaviour().asks_to_stop = true;
  StageEvents events;
  events.stop = [] { return behaviour().count_runs > 0; };
  EXPECT_EQ(run("count", request("count"), events).end, End::Stopped);
  EXPECT_FALSE(std::filesystem::exists(root_ / "work")) << "the run made it";
}

TEST_F(RunStage, StopWhileDigestingInputs_BeginsNothing) {
  StageEvents events;
  events.stop = [] { return true; };
  const StageReport report = run("count", request("count"), events);
  EXPECT_EQ(report.end, End::Stopped);
  EXPECT_EQ(report.frames_total, 0);
  EXPECT_EQ(behaviour().count_runs, 0);
  EXPECT_FALSE(std::filesystem::exists(root_ / "work")) << "nothing was begun";
  EXPECT_EQ(run("count").end, End::Done);
}

TEST_F(RunStage, StopWhileDigestingEarlierResult_CanBeResumed) {
  run("count");
  StageEvents events;
  events.stop = [] { return true; };
  EXPECT_EQ(run("double", request("double"), events).end, End::Stopped);
  EXPECT_EQ(run("double").end, End::Done);
}

}  // namespace
}  // namespace atelier::fixtures
