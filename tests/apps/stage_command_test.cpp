// A stage on the command line: what it does, what it says, what it leaves.

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/exit_code.h"
#include "core/sequence_archive.h"
#include "core/store/file_lock.h"
#include "tests/apps/program_fixture.h"

namespace atelier::fixtures {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

using StageCommand = Program;

TEST_F(StageCommand, StageHelp_ShowsOptionsWithRangeAndDefault) {
  const ChildResult result = run({"statistics", "--help"});
  EXPECT_THAT(result.out, HasSubstr("--statistics.edge-quantiles"));
  EXPECT_THAT(result.out, HasSubstr("list of numbers in [0, 1]"));
  EXPECT_THAT(result.out, HasSubstr("[0, 0.05, 0.5, 0.95, 1]"));
}

TEST_F(StageCommand, Stage_RunsAndReports) {
  write_boxes(input(), 4);
  const ChildResult result = run({"statistics", input().string(), workspace().string()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("statistics done: "));
  EXPECT_THAT(result.out, HasSubstr("frames 4"));
  EXPECT_THAT(result.out, HasSubstr("consent: none recorded"));
  EXPECT_THAT(result.err, HasSubstr("statistics  4/4 frames"));
  const auto text = read_file_text(stage_folder() / "current/statistics.json", 1 << 20);
  const nlohmann::json json = nlohmann::json::parse(text);
  EXPECT_EQ(json["frames"].size(), 4u);
  EXPECT_EQ(json["ranges"]["vertices"]["mean"], 8.0);
  EXPECT_NEAR(json["frames"][3]["volume"].get<double>(), 1.03, 1e-12);
  EXPECT_EQ(json["frames"][0]["boundary_loops"], 0);
}

TEST_F(StageCommand, JsonEvents_AreOnePerLine) {
  write_boxes(input(), 3);
  const ChildResult result = run_statistics({"--json"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.err, IsEmpty());
  std::istringstream lines(result.out);
  std::string last;
  for (std::string line; std::getline(lines, line); last = line) {
    EXPECT_TRUE(nlohmann::json::accept(line)) << line;
  }
  const nlohmann::json end = nlohmann::json::parse(last);
  EXPECT_EQ(end["event"], "end");
  EXPECT_EQ(end["end"], "done");
  EXPECT_EQ(end["metrics"]["frames"], 3);
}

TEST_F(StageCommand, DryRun_SaysWhyAndDoesNothing) {
  write_boxes(input(), 2);
  const ChildResult first = run_statistics({"--dry-run"});
  EXPECT_EQ(first.exit_code, 0);
  EXPECT_THAT(first.out, HasSubstr("it has no result in this workspace"));
  EXPECT_FALSE(std::filesystem::exists(workspace()));
  run_statistics({});
  EXPECT_THAT(run_statistics({"--dry-run"}).out, HasSubstr("would do nothing"));
  EXPECT_THAT(run_statistics({"--dry-run", "--statistics.edge_quantiles", "0.5"}).out,
              HasSubstr("option statistics.edge_quantiles: [0,0.05,0.5,0.95,1] -> [0.5]"));
  write_boxes(input(), 3);
  EXPECT_THAT(run_statistics({"--dry-run"}).out, HasSubstr("input meshes changed (2 files"));
}

TEST_F(StageCommand, Options_ComeFromFilesAndFlagsAndAreRecorded) {
  write_boxes(input(), 1);
  const std::string file = (root_ / "outfit.toml").string();
  std::ofstream(file) << "[statistics]\nedge_quantiles = [0.25]\n[input]\nunit = \"cm\"\n";
  ASSERT_EQ(run_statistics({"--config", file, "--input.unit", "mm"}).exit_code, 0);
  const nlohmann::json manifest =
      nlohmann::json::parse(read_file_text(stage_folder() / "current/manifest.json", 1 << 20));
  for (const auto& option : manifest["options"]) {
    if (option["name"] == "input.unit") {
      EXPECT_EQ(option["source"], "flag");
      EXPECT_EQ(option["value"], "mm");
    } else if (option["name"] == "statistics.edge_quantiles") {
      EXPECT_EQ(option["source"], file + ":2");
    } else {
      EXPECT_EQ(option["source"], "default");
    }
  }
}

TEST_F(StageCommand, InputUnit_IsApplied) {
  write_boxes(input(), 1);
  run_statistics({"--input.unit", "cm"});
  const nlohmann::json json =
      nlohmann::json::parse(read_file_text(stage_folder() / "current/statistics.json", 1 << 20));
  EXPECT_NEAR(json["frames"][0]["volume"].get<double>(), 1e-6, 1e-15);
}

TEST_F(StageCommand, Failure_IsAJsonEvent) {
  write_boxes(input(), 2);
  std::ofstream(input() / "box_001.obj") << "v nan 0 0\n";
  const ChildResult result = run_statistics({"--json", "--jobs", "1"});
  EXPECT_EQ(result.exit_code, kExitBadData);
  ASSERT_GT(result.out.size(), 2u);
  const nlohmann::json event =
      nlohmann::json::parse(result.out.substr(result.out.rfind('\n', result.out.size() - 2) + 1));
  EXPECT_EQ(event["event"], "error");
  EXPECT_EQ(event["stage"], "statistics");
  EXPECT_THAT(event["file"].get<std::string>(), HasSubstr("box_001.obj"));
  EXPECT_NE(event["where"], "");
  EXPECT_NE(event["found"], "");
  EXPECT_NE(event["expected"], "");
  EXPECT_EQ(event["exit_code"], kExitBadData);
}

TEST_F(StageCommand, EnvironmentFailure_IsAJsonEvent) {
  write_boxes(input(), 1);
  std::filesystem::create_directories(stage_folder());
  const auto lock = FileLock::try_lock(stage_folder() / ".lock", FileLock::Mode::Exclusive);
  const nlohmann::json event = nlohmann::json::parse(run_statistics({"--json"}).out);
  EXPECT_EQ(event["event"], "error");
  EXPECT_EQ(event["file"], stage_folder().string());
  EXPECT_EQ(event["found"], "another run is working on 'statistics' here");
  EXPECT_THAT(event["expected"].get<std::string>(), ::testing::StartsWith("wait until it ends"));
  EXPECT_EQ(event["exit_code"], kExitEnvironment);
}

TEST_F(StageCommand, ControlCharacters_AreNotShown) {
  write_boxes(input(), 1);
  ASSERT_EQ(run_statistics({}).exit_code, 0);
  const std::filesystem::path result = std::filesystem::canonical(stage_folder() / "current");
  std::ofstream(result / "more\x1b[31m") << "x";
  const ChildResult plan = run_statistics({"--dry-run"});
  EXPECT_THAT(plan.out, HasSubstr("the result is damaged: " + result.string() + "/more?[31m"));
  EXPECT_THAT(plan.out, Not(HasSubstr("\x1b")));
  EXPECT_THAT(run({"status", workspace().string()}).out, Not(HasSubstr("\x1b")));
}

TEST_F(StageCommand, ShardedForce_SaysWhatIsDoneAndWhatIsLeft) {
  write_boxes(input(), 6);
  ASSERT_EQ(run_statistics({}).exit_code, 0);
  EXPECT_THAT(run_statistics({"--shard", "0/2", "--force"}).out,
              HasSubstr("3 of 6 frames are done again; the rest is left to other runs"));
  EXPECT_THAT(run_statistics({}).out, HasSubstr("beside it lies unfinished work of 3 frames"));
  EXPECT_THAT(run_statistics({"--shard", "1/2", "--force"}).out, HasSubstr("statistics done: "));
  EXPECT_THAT(run_statistics({}).out, Not(HasSubstr("unfinished work")));
}

TEST_F(StageCommand, Shards_TogetherCompleteTheStage) {
  write_boxes(input(), 5);
  EXPECT_THAT(run_statistics({"--shard", "0/2"}).out, HasSubstr("3 of 5 frames are done"));
  EXPECT_THAT(run_statistics({"--shard", "1/2"}).out, HasSubstr("statistics done"));
}

TEST_F(StageCommand, EmptyShard_IsNoFailure) {
  write_boxes(input(), 4);
  const ChildResult result = run_statistics({"--shard", "5/100000"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("there is nothing for this shard: --shard 5/100000 of 4"));
  EXPECT_THAT(result.out, HasSubstr("0 of 4 frames are done; the rest is left to other runs"));
  EXPECT_FALSE(std::filesystem::exists(workspace()));
}

TEST_F(StageCommand, LockedWorkspace_IsRefused) {
  write_boxes(input(), 1);
  std::filesystem::create_directories(stage_folder());
  const auto lock = FileLock::try_lock(stage_folder() / ".lock", FileLock::Mode::Exclusive);
  expect_refusal(run_statistics({}), kExitEnvironment,
                 "another run is working on 'statistics' here");
}

TEST_F(StageCommand, DryRun_ReportsSelectedFramesAndAnotherRun) {
  write_boxes(input(), 4);
  EXPECT_THAT(run_statistics({"--dry-run"}).out,
              AllOf(Not(HasSubstr("  only ")), Not(HasSubstr("another run"))));
  EXPECT_THAT(run_statistics({"--dry-run", "--frames", "1:3"}).out,
              HasSubstr("  only --frames 1:3\n"));
  std::filesystem::create_directories(stage_folder());
  const auto lock = FileLock::try_lock(stage_folder() / ".lock", FileLock::Mode::Exclusive);
  EXPECT_THAT(run_statistics({"--dry-run"}).out, HasSubstr("this one would be refused\n"));
  const ChildResult part = run_statistics({"--dry-run", "--json", "--shard", "1/2"});
  EXPECT_EQ(part.exit_code, 0);
  const nlohmann::json plan = nlohmann::json::parse(part.out);
  EXPECT_EQ(plan["selection"], "--shard 1/2");
  EXPECT_EQ(plan["running"], true);
}

TEST_F(StageCommand, WorkspaceReadableByOthers_IsWarnedOf) {
  write_boxes(input(), 1);
  std::filesystem::create_directory(workspace());
  std::filesystem::permissions(workspace(), std::filesystem::perms(0755));
  const std::string words = "others may look into " + workspace().string() +
                            " (mode 0755): chmod 700 " + workspace().string() + " closes it";
  EXPECT_THAT(run_statistics({"--dry-run"}).out, HasSubstr("warning: " + words));
  EXPECT_THAT(run_statistics({}).out, HasSubstr("warning: " + words));
  EXPECT_THAT(run_statistics({"--json"}).out, HasSubstr("\"warnings\":[\"" + words));
  EXPECT_THAT(run({"status", workspace().string()}).out, HasSubstr("warning: " + words));
  EXPECT_THAT(run({"status", workspace().string(), "--json"}).err, HasSubstr(words));
  std::filesystem::permissions(workspace(), std::filesystem::perms(0700));
  EXPECT_THAT(run_statistics({}).out, Not(HasSubstr("warning")));
}

TEST_F(StageCommand, StageWarnings_AreRepeatedAtTheEndOfEveryRun) {
  write_boxes(input(), 2);
  std::ofstream(input() / "box_000.obj") << "v 0 0 0\nv 0 1800 0\nv 500 0 0\nf 1 2 3\n";
  const std::string words = "the file does not say its unit";
  for (const char* when : {"the run that warned", "one that finds it done"}) {
    SCOPED_TRACE(when);
    const std::string out = run_statistics({"--json"}).out;
    const std::size_t last = out.rfind('\n', out.size() - 2) + 1;
    const auto end = nlohmann::json::parse(out.substr(last));
    EXPECT_EQ(end["event"], "end");
    ASSERT_EQ(end["warnings"].size(), 1u);
    EXPECT_THAT(end["warnings"][0].get<std::string>(), HasSubstr(words));
    EXPECT_EQ(end["frames_done"], 2);
    EXPECT_EQ(end["frames_total"], 2);
  }
  EXPECT_THAT(run_statistics({}).out,
              ::testing::AllOf(HasSubstr("is done already"), HasSubstr("\n  warning unit-unknown"),
                               HasSubstr(words)));
}

TEST_F(StageCommand, Consent_IsShown) {
  write_boxes(input(), 1);
  std::ofstream(input() / "capture.toml")
      << "[consent]\nwho = 'P. Doe'\nscope = 'research'\nuntil = 2030-12-31\n";
  EXPECT_THAT(run_statistics({}).out, HasSubstr("consent: P. Doe, research, until 2030-12-31"));
  EXPECT_THAT(run({"status", workspace().string()}).out, HasSubstr("consent: P. Doe, research"));
}

TEST_F(StageCommand, ExpiredConsent_IsWarnedOf) {
  write_boxes(input(), 1);
  std::ofstream(input() / "capture.toml")
      << "[consent]\nwho = 'P. Doe'\nscope = 'research'\nuntil = 2001-12-31\n";
  const std::string words = "the consent of P. Doe (research) ended with 2001-12-31";
  EXPECT_THAT(run_statistics({}).out, HasSubstr("warning: " + words));
  EXPECT_THAT(run({"status", workspace().string()}).out, HasSubstr(words));
  EXPECT_THAT(run({"inspect", (stage_folder() / "current/manifest.json").string()}).out,
              HasSubstr(words));
  const ChildResult refused = run({"export", workspace().string(), (root_ / "no").string()});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, HasSubstr(words));
  const ChildResult exported =
      run({"export", workspace().string(), (root_ / "out").string(), "--ended-consent"});
  const std::string warning =
      "warning: " + words + "; renew it in " + (input() / "capture.toml").string();
  EXPECT_THAT(exported.out, HasSubstr(warning));
  EXPECT_THAT(read_file_text(root_ / "out/statistics/consent.txt", 1 << 10), HasSubstr(warning));
}

TEST_F(StageCommand, ChangedConsent_IsReportedEverywhere) {
  write_boxes(input(), 1);
  const auto state = [&](const std::string& what) {
    std::ofstream(root_ / "consent.toml") << "[consent]\nwho = 'P'\n" << what << "\n";
  };
  state("scope = 'research'");
  ASSERT_EQ(run_statistics({}).exit_code, 0);
  EXPECT_THAT(run({"status", workspace().string()}).out, Not(HasSubstr("changed")));
  state("scope = 'withdrawn'\nuntil = 2026-01-01");
  const std::string words = "today it says 'P, withdrawn, until 2026-01-01'";
  EXPECT_THAT(run({"status", workspace().string()}).out, HasSubstr(words));
  EXPECT_THAT(run({"status", workspace().string(), "--json"}).out, HasSubstr("consent-changed"));
  EXPECT_THAT(run({"report", workspace().string()}).out, HasSubstr(words));
  EXPECT_THAT(read_file_text(workspace() / "report/index.html", 1 << 24),
              HasSubstr("today it says"));
  EXPECT_THAT(
      run({"export", workspace().string(), (root_ / "out").string(), "--ended-consent"}).out,
      HasSubstr(words));
  EXPECT_THAT(read_file_text(root_ / "out/statistics/consent.txt", 1 << 10), HasSubstr(words));
}

TEST_F(StageCommand, OtherInputKind_IsRefusedBeforeHashing) {
  std::filesystem::create_directories(input());
  std::filesystem::create_symlink("nothing", input() / "link.txt");  // digesting refuses it
  for (const std::vector<std::string>& more : {std::vector<std::string>{}, {"--dry-run"}}) {
    expect_refusal(run_statistics(more), kExitBadData, "no .obj, .ply, .glb or .gltf");
    EXPECT_FALSE(std::filesystem::exists(workspace()));
  }
#ifdef ATELIER_HAS_REGISTRATION
  expect_refusal(run({"flatten", input().string(), workspace().string()}), kExitBadData,
                 "no .obj or .ply");
#endif
}

TEST_F(StageCommand, NativeSequences_AreRead) {
  Mesh mesh;
  mesh.vertices = Points::Random(3, 3);
  mesh.faces.resize(1, 3);
  mesh.faces << 0, 1, 2;
  write_sequence(input(), sequence_of({mesh, mesh, mesh}, 30, {4, 5, 9}));
  const ChildResult result = run({"statistics", input().string(), workspace().string()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("frames 3"));
  EXPECT_TRUE(std::filesystem::exists(stage_folder() / "current/frames/000009.json"));
  const ChildResult frame = run({"inspect", (input() / "frames/000009.h5").string()});
  EXPECT_THAT(frame.out, HasSubstr("archive of schema 'atelier.mesh'"));
}

}  // namespace
}  // namespace atelier::fixtures
