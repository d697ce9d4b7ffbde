#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "core/store/result.h"
#include "core/store/run_stage.h"
#include "core/store/workspace_status.h"
#include "tests/core_store/run_stage_fixture.h"

namespace atelier::fixtures {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using End = StageReport::End;

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

TEST_F(DamagedResult, WrongSize_IsRepaired) {
  write(result_ / "count.txt", "1 fil");
  expect_repair("5 bytes, the manifest says 7");
}

TEST_F(DamagedResult, WrongBytesOfRightSize_AreRepaired) {
  write(result_ / "count.txt", "2 files");
  expect_repair("its bytes are not those that the stage wrote");
}

TEST_F(DamagedResult, MissingFile_IsRepaired) {
  std::filesystem::remove(result_ / "count.txt");
  expect_repair("the file is missing");
}

TEST_F(DamagedResult, ExtraFile_IsRepaired) {
  write(result_ / "more.txt", "x");
  expect_repair("the manifest does not name this file");
}

TEST_F(DamagedResult, ExtraHiddenFile_IsRepaired) {
  write(result_ / "deep/.x", "x");
  expect_repair("the manifest does not name this file");
}

TEST_F(DamagedResult, LinkInsteadOfFile_IsRepaired) {
  write(root_ / "elsewhere", "1 files");
  std::filesystem::remove(result_ / "count.txt");
  std::filesystem::create_symlink(root_ / "elsewhere", result_ / "count.txt");
  expect_repair("a symbolic link is in its place");
  EXPECT_EQ(read(root_ / "elsewhere"), "1 files");
}

TEST_F(DamagedResult, FolderInsteadOfFile_IsRepaired) {
  std::filesystem::remove(result_ / "count.txt");
  std::filesystem::create_directory(result_ / "count.txt");
  expect_repair("the file is missing");
}

TEST_F(DamagedResult, PipeInsteadOfFile_IsRepaired) {
  std::filesystem::remove(result_ / "count.txt");
  ASSERT_EQ(mkfifo((result_ / "count.txt").c_str(), 0600), 0);
  expect_repair("it is no regular file");
}

TEST_F(DamagedResult, MissingManifest_IsRepaired) {
  std::filesystem::remove(result_ / "manifest.json");
  expect_repair("manifest.json");
}

TEST_F(DamagedResult, EmptyManifest_IsRepaired) {
  write(result_ / "manifest.json", "");
  expect_repair("manifest.json");
}

TEST_F(DamagedResult, TruncatedManifest_IsRepaired) {
  const std::string text = read(result_ / "manifest.json");
  write(result_ / "manifest.json", text.substr(0, text.size() / 2));
  expect_repair("manifest.json");
}

TEST_F(DamagedResult, ManifestOfOtherResult_IsRepaired) {
  StageRequest what = request("count");
  ASSERT_EQ(set_option(what.options.table, "word", "x"), "");
  run("count", what);
  std::filesystem::copy_file(current("count") / "manifest.json", result_ / "manifest.json",
                             std::filesystem::copy_options::overwrite_existing);
  set_current(folder("count"), result_.filename());
  expect_repair("that of the folder it is in");
}

TEST_F(DamagedResult, ManifestOfOtherStage_IsRepaired) {
  run("twins");
  std::filesystem::copy_file(current("twins") / "manifest.json", result_ / "manifest.json",
                             std::filesystem::copy_options::overwrite_existing);
  expect_repair("stage: 'twins'; expected 'count'");
}

TEST_F(DamagedResult, ManifestThatIsALink_IsRepaired) {
  std::filesystem::rename(result_ / "manifest.json", root_ / "m.json");
  std::filesystem::create_symlink(root_ / "m.json", result_ / "manifest.json");
  expect_repair("a symbolic link");
}

TEST_F(DamagedResult, ResultFolderThatIsALink_IsRepairedWithoutFollowing) {
  std::filesystem::rename(result_, root_ / "away");
  std::filesystem::create_symlink(root_ / "away", result_);
  expect_repair("a symbolic link");
  EXPECT_TRUE(std::filesystem::exists(root_ / "away/count.txt")) << "links are not followed";
}

TEST_F(DamagedResult, FinishTimeInTheFuture_IsAWarning) {
  Manifest manifest = read_manifest(result_, "count");
  manifest.finished = "2999-01-01T00:00:00Z";
  write(result_ / "manifest.json", manifest_text(manifest));
  const auto findings = check_outputs(result_, manifest, Check::Digests);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].code, "manifest-time");
  EXPECT_EQ(findings[0].severity, Severity::Warning);
  EXPECT_EQ(run("count").end, End::AlreadyDone);
}

TEST_F(DamagedResult, DanglingCurrentLink_IsRepaired) {
  std::filesystem::remove(folder("count") / "current");
  std::filesystem::create_symlink("0123456789abcdef", folder("count") / "current");
  EXPECT_EQ(run("count").end, End::AlreadyDone);
  EXPECT_EQ(current("count"), result_);
}

TEST_F(DamagedResult, MissingCurrentLink_IsRepaired) {
  std::filesystem::remove(folder("count") / "current");
  EXPECT_EQ(run("count").end, End::AlreadyDone);
  EXPECT_EQ(current("count"), result_);
}

TEST_F(DamagedResult, CurrentLinkOutOfTheFolder_IsRepaired) {
  for (const char* target : {"../../in", "/etc", "../count", ".", "0123456789ABCDEF", ""}) {
    std::filesystem::remove(folder("count") / "current");
    std::error_code ignored;
    std::filesystem::create_symlink(target, folder("count") / "current", ignored);
    EXPECT_FALSE(current_name(folder("count"))) << target;
    EXPECT_EQ(run("count").end, End::AlreadyDone);
    EXPECT_EQ(current("count"), result_);
  }
}

TEST_F(DamagedResult, CurrentThatIsAFile_IsRepaired) {
  std::filesystem::remove(folder("count") / "current");
  write(folder("count") / "current", "x");
  EXPECT_EQ(run("count").end, End::AlreadyDone);
  EXPECT_EQ(current("count"), result_);
}

TEST_F(DamagedResult, CurrentThatIsAFolder_IsRefused) {
  std::filesystem::remove(folder("count") / "current");
  std::filesystem::copy(result_, folder("count") / "current");  // cp -rL
  const int runs = behaviour().count_runs;
  StageRequest again = request("count");
  for (const bool force : {false, true}) {
    again.force = force;
    EXPECT_THAT(refusal<DataError>("count", again), HasSubstr("current: a folder, as a copy"));
  }
  EXPECT_EQ(behaviour().count_runs, runs) << "before any work";
  std::filesystem::remove_all(folder("count") / "current");
  EXPECT_EQ(run("count").end, End::AlreadyDone);
  EXPECT_EQ(current("count"), result_);
}

TEST(ResultsOfStage, FormerName_FoundWhereOnlyItIsThere) {
  const TemporaryDirectory root;
  const std::filesystem::path workspace = root.path();
  EXPECT_EQ(results_of_stage(workspace, "oracle"), workspace / "oracle");
  std::filesystem::create_directory(workspace / "ceiling");
  EXPECT_EQ(results_of_stage(workspace, "oracle"), workspace / "ceiling");
  std::filesystem::create_directory(workspace / "oracle");
  EXPECT_EQ(results_of_stage(workspace, "oracle"), workspace / "oracle");
  EXPECT_EQ(results_of_stage(workspace, "register"), workspace / "register");
}

}  // namespace
}  // namespace atelier::fixtures
