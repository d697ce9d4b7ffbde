// `status` and `gc`, and what a workspace of a newer program gets.

#include <fstream>
#include <nlohmann/json.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/exit_code.h"
#include "core/store/file_lock.h"
#include "tests/apps/program_fixture.h"

namespace atelier::fixtures {
namespace {

using ::testing::HasSubstr;

using WorkspaceCommand = Program;

TEST_F(WorkspaceCommand, Status_ChecksResults) {
  write_boxes(input(), 1);
  run_statistics({});
  EXPECT_EQ(run({"status", workspace().string(), "--check", "--digests"}).exit_code, 0);
  const auto json = nlohmann::json::parse(run({"status", workspace().string(), "--json"}).out);
  EXPECT_EQ(json[0]["stage"], "statistics");
  EXPECT_EQ(json[0]["state"], "done");
  std::ofstream(stage_folder() / "current/statistics.json") << "x";
  const ChildResult damaged = run({"status", workspace().string(), "--check"});
  EXPECT_EQ(damaged.exit_code, kExitCheckFailed);
  EXPECT_THAT(damaged.out, HasSubstr("output-size"));
  const auto findings = nlohmann::json::parse(
      run({"status", workspace().string(), "--check", "--json"}).out)[0]["findings"];
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_FALSE(findings[0]["advice"].get<std::string>().empty());
}

TEST_F(WorkspaceCommand, ResultOfANewerVersion_IsLeftAlone) {
  write_boxes(input(), 1);
  run_statistics({});
  const std::filesystem::path path = stage_folder() / "current/manifest.json";
  std::string text = read_file_text(path, 1 << 20);
  const std::string version = "\"schema_version\": 3";
  ASSERT_NE(text.find(version), std::string::npos);
  text.replace(text.find(version), version.size(), "\"schema_version\": 5");
  std::ofstream(path) << text;
  const ChildResult status = run({"status", workspace().string(), "--check"});
  EXPECT_EQ(status.exit_code, kExitCheckFailed);
  EXPECT_THAT(status.out, HasSubstr("it is not damaged: a newer atelier reads it"));
  for (const char* force : {"--dry-run", "--force", "--json"}) {
    const ChildResult again = run_statistics({force, "--jobs", "1"});
    EXPECT_EQ(again.exit_code, kExitBadData) << force;
    EXPECT_THAT(again.err, HasSubstr("a newer atelier wrote it: use that one, or another"))
        << force;
  }
  expect_refusal(run_statistics({"--statistics.edge_quantiles", "0.5"}), kExitBadData,
                 "a newer atelier wrote it");
  expect_refusal(run({"inspect", path.string()}), kExitBadData, "a newer atelier wrote it");
  EXPECT_THAT(run({"gc", workspace().string()}).out, HasSubstr("nothing to remove"));
  EXPECT_EQ(read_file_text(path, 1 << 20), text);
}

TEST_F(WorkspaceCommand, NewerResultBesideOlderOnes_IsLeftAlone) {
  write_boxes(input(), 1);
  run_statistics({});
  const std::filesystem::path older = std::filesystem::canonical(stage_folder() / "current");
  run_statistics({"--input.unit", "mm"});
  const std::filesystem::path newer = std::filesystem::canonical(stage_folder() / "current");
  ASSERT_NE(older, newer);
  const std::string sound = read_file_text(newer / "manifest.json", 1 << 20);
  std::string text = sound;
  const std::string version = "\"schema_version\": 3";
  ASSERT_NE(text.find(version), std::string::npos);
  text.replace(text.find(version), version.size(), "\"schema_version\": 9");
  std::ofstream(newer / "manifest.json") << text;

  // The older result is sound and is what is asked for, yet the newer one stays current.
  for (const std::vector<std::string>& flags :
       {std::vector<std::string>{}, {"--force"}, {"--dry-run"}}) {
    expect_refusal(run_statistics(flags), kExitBadData, "a newer atelier wrote it");
    EXPECT_EQ(std::filesystem::canonical(stage_folder() / "current"), newer);
  }
  const ChildResult status = run({"status", workspace().string(), "--check"});
  EXPECT_EQ(status.exit_code, kExitCheckFailed);
  EXPECT_THAT(status.out, HasSubstr("statistics    newer\n"));
  EXPECT_THAT(status.out, HasSubstr("1 older result; atelier gc leaves it while"));
  const std::filesystem::path out = workspace().parent_path() / "exported";
  const ChildResult exported = run({"export", workspace().string(), out.string()});
  expect_refusal(exported, kExitBadData, "a result that a newer atelier wrote");
  EXPECT_THAT(exported.err, ::testing::Not(HasSubstr("damaged")));
  EXPECT_THAT(run({"gc", workspace().string()}).out, HasSubstr("nothing to remove"));
  EXPECT_TRUE(std::filesystem::exists(older));

  // Set aside all the same (by hand, by a program before this one), it is not removed.
  std::filesystem::remove(stage_folder() / "current");
  std::filesystem::create_symlink(older.filename(), stage_folder() / "current");
  EXPECT_THAT(run({"status", workspace().string()}).out,
              HasSubstr("1 older result; atelier gc leaves it, which a newer atelier wrote"));
  EXPECT_THAT(run({"gc", workspace().string()}).out,
              ::testing::AllOf(HasSubstr("left "), HasSubstr("; a newer atelier wrote it")));
  EXPECT_EQ(read_file_text(newer / "manifest.json", 1 << 20), text);
}

TEST_F(WorkspaceCommand, ResultsWithoutCurrentLink_AreReported) {
  write_boxes(input(), 1);
  run_statistics({});
  std::filesystem::remove(stage_folder() / "current");
  const std::string words = "1 result without a current link; the stage's command";
  EXPECT_THAT(run({"status", workspace().string()}).out, HasSubstr(words));
  EXPECT_THAT(run({"gc", workspace().string(), "--dry-run"}).out,
              HasSubstr("left statistics: " + words));
  EXPECT_THAT(run_statistics({}).out, HasSubstr("is done already"));
  EXPECT_THAT(run({"status", workspace().string()}).out, ::testing::Not(HasSubstr(words)));
}

TEST_F(WorkspaceCommand, FolderInPlaceOfCurrent_IsReportedWithAdvice) {
  write_boxes(input(), 1);
  run_statistics({});
  std::filesystem::remove(stage_folder() / "current");
  std::filesystem::create_directory(stage_folder() / "current");
  const std::string words = "remove the folder and run the stage again";
  const ChildResult status = run({"status", workspace().string(), "--check"});
  EXPECT_EQ(status.exit_code, kExitCheckFailed);
  EXPECT_THAT(status.out, HasSubstr(words));
  EXPECT_THAT(status.out, ::testing::Not(HasSubstr("links it again")));
  const ChildResult gc = run({"gc", workspace().string()});
  EXPECT_THAT(gc.out, HasSubstr(words));
  EXPECT_THAT(gc.out, ::testing::Not(HasSubstr("links it again")));
  expect_refusal(run_statistics({}), kExitBadData, words);
}

TEST_F(WorkspaceCommand, FileInPlaceOfAStageFolder_IsRefused) {
  write_boxes(input(), 1);
  std::filesystem::create_directories(workspace());
  std::ofstream(stage_folder()) << "a file";
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"status", workspace().string()},
        {"gc", workspace().string()},
        {"statistics", input().string(), workspace().string()}}) {
    SCOPED_TRACE(command[0]);
    expect_refusal(run(command), kExitBadData, stage_folder().string() + ": a file");
    std::vector<std::string> with_json = command;
    with_json.emplace_back("--json");
    const auto json = nlohmann::json::parse(run(with_json).out);
    EXPECT_EQ(json["file"], stage_folder().string());
    EXPECT_EQ(json["expected"], "a folder");
  }
}

TEST_F(WorkspaceCommand, Gc_ReportsWhatARunningStageKeeps) {
  write_boxes(input(), 1);
  run_statistics({});
  run_statistics({"--statistics.edge_quantiles", "0.5"});
  {
    const auto lock = FileLock::try_lock(stage_folder() / ".lock", FileLock::Mode::Shared);
    const std::string words = "a result that is no longer current; the stage is running";
    EXPECT_THAT(run({"gc", workspace().string(), "--dry-run"}).out,
                ::testing::AllOf(HasSubstr("would leave "), HasSubstr(words)));
    EXPECT_THAT(run({"gc", workspace().string()}).out,
                ::testing::AllOf(HasSubstr("left "), HasSubstr(words)));
    const auto json =
        nlohmann::json::parse(run({"gc", workspace().string(), "--dry-run", "--json"}).out);
    EXPECT_EQ(json[0]["kept"], "the stage is running");
    EXPECT_EQ(json[0]["removed"], false);
  }
  const auto json =
      nlohmann::json::parse(run({"gc", workspace().string(), "--dry-run", "--json"}).out);
  EXPECT_EQ(json[0]["kept"], "");
  EXPECT_EQ(json[0]["removed"], false);
}

TEST_F(WorkspaceCommand, Error_IsAJsonObject) {
  const std::string missing = (root_ / "nothing").string();
  const std::string picture = (root_ / "bad.jpg").string();
  std::ofstream(picture) << "no image";
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"status", missing}, {"gc", missing}, {"inspect", picture}}) {
    SCOPED_TRACE(command[0]);
    const ChildResult result = run({command[0], command[1], "--json"});
    EXPECT_EQ(result.exit_code, kExitBadData);
    const auto json = nlohmann::json::parse(result.out);
    EXPECT_EQ(json["event"], "error");
    EXPECT_EQ(json["command"], command[0]);
    EXPECT_EQ(json["file"], command[1]);
    EXPECT_EQ(json["exit_code"], kExitBadData);
    EXPECT_NE(json["found"], "");
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << "people are told too";
    expect_refusal(run(command), kExitBadData, command[1]);
    expect_refusal(run({command[0], command[1], "--json=false"}), kExitBadData, command[1]);
    expect_refusal(run({command[0], "--json"}), kExitUsage, " takes a");
  }
}

TEST_F(WorkspaceCommand, Gc_RemovesOlderResults) {
  write_boxes(input(), 1);
  run_statistics({});
  run_statistics({"--statistics.edge_quantiles", "0.5"});
  EXPECT_THAT(run({"gc", workspace().string(), "--dry-run"}).out, HasSubstr("would remove"));
  EXPECT_THAT(run({"gc", workspace().string()}).out, HasSubstr("removed"));
  EXPECT_THAT(run({"gc", workspace().string()}).out, HasSubstr("nothing to remove"));
}

}  // namespace
}  // namespace atelier::fixtures
