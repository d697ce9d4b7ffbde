// The command line: what it says, what it refuses, how it exits.

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "apps/exit_code.h"
#include "core/io/mesh_gltf.h"
#include "core/io/npz.h"
#include "core/io/safetensors.h"
#include "core/sequence_archive.h"
#include "core/store/file_lock.h"
#include "tests/apps/statistics_fixture.h"

namespace atelier::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

class Program : public StatisticsFixture {
 protected:
  /// One readable line on standard error, nothing on standard output, and the code.
  static void expect_refusal(const ChildResult& result, int code, const std::string& words) {
    EXPECT_EQ(result.exit_code, code) << result.err;
    EXPECT_THAT(result.err, StartsWith("atelier: "));
    EXPECT_THAT(result.err, HasSubstr(words));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_THAT(result.out, IsEmpty());
  }
  ChildResult run_statistics(std::vector<std::string> more) {
    return run_child(statistics(std::move(more)));
  }
};

TEST_F(Program, HelpListsStagesAndCommandsAndExitCodes) {
  const ChildResult result = run({"--help"});
  EXPECT_EQ(result.exit_code, 0);
  for (const char* word : {"statistics", "status", "inspect", "gc", "convert", "options",
                           "completion", "Exit codes:", "70 a defect"}) {
    EXPECT_THAT(result.out, HasSubstr(word));
  }
  EXPECT_THAT(result.err, IsEmpty());
}

TEST_F(Program, NothingIsAUsageErrorWithHelp) {
  const ChildResult result = run({});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.out, HasSubstr("Usage: atelier COMMAND"));
}

TEST_F(Program, EveryCommandHasHelp) {
  for (const char* command :
       {"statistics", "status", "inspect", "gc", "convert", "options", "completion"}) {
    const ChildResult result = run({command, "--help"});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(result.out, HasSubstr(std::string("atelier ") + command));
    EXPECT_THAT(result.out, HasSubstr("Exit codes:"));
  }
}

TEST_F(Program, HelpOfAStageHasItsOptionsWithRangeAndDefault) {
  const ChildResult result = run({"statistics", "--help"});
  EXPECT_THAT(result.out, HasSubstr("--statistics.edge_quantiles"));
  EXPECT_THAT(result.out, HasSubstr("list of numbers in [0, 1]"));
  EXPECT_THAT(result.out, HasSubstr("[0, 0.05, 0.5, 0.95, 1]"));
}

TEST_F(Program, AFlagWithoutItsValueIsASentence) {
  expect_refusal(run({"convert", "a.obj", "b.obj", "--input.unit"}), 2,
                 "--input.unit needs a value behind it: m|dm|cm|mm|in|ft; see atelier convert");
  expect_refusal(run({"statistics", "--jobs"}), 2, "--jobs needs a value behind it");
}

TEST_F(Program, AnUnknownFlagSuggestsTheOptionOfThatWord) {
  expect_refusal(run({"convert", "a.obj", "b.obj", "--unit", "cm"}), 2,
                 "convert has no option '--unit', did you mean '--input.unit'?");
}

TEST_F(Program, AFolderIsNoMesh) {
  expect_refusal(run({"convert", root_.path().string(), "b.obj"}), 3,
                 "a folder; expected a mesh file");
}

TEST_F(Program, VersionNamesTheBuild) {
  EXPECT_THAT(run({"--version"}).out, StartsWith("atelier "));
}

TEST_F(Program, RunsAStage) {
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

TEST_F(Program, JsonEventsAreOnePerLine) {
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

TEST_F(Program, ADryRunSaysWhyAndDoesNothing) {
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

TEST_F(Program, OptionsComeFromFilesAndFlagsAndTheManifestSaysWhich) {
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

TEST_F(Program, UnitsOfTheInputCount) {
  write_boxes(input(), 1);
  run_statistics({"--input.unit", "cm"});
  const nlohmann::json json =
      nlohmann::json::parse(read_file_text(stage_folder() / "current/statistics.json", 1 << 20));
  EXPECT_NEAR(json["frames"][0]["volume"].get<double>(), 1e-6, 1e-15);
}

TEST_F(Program, AFailureIsAnEventForMachines) {
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

TEST_F(Program, TheHelpSaysEveryChoiceOnce) {
  EXPECT_THAT(run({"statistics", "--help"}).out,
              AllOf(HasSubstr("cpu|cuda"), Not(HasSubstr("{cpu"))));
  EXPECT_THAT(run({"body-model", "--help"}).out, Not(HasSubstr("{show")));
}

TEST_F(Program, ASplitForceSaysWhatIsDoneAndWhatIsNot) {
  write_boxes(input(), 6);
  ASSERT_EQ(run_statistics({}).exit_code, 0);
  EXPECT_THAT(run_statistics({"--shard", "0/2", "--force"}).out,
              HasSubstr("3 of 6 frames are done again; the rest is left to other runs"));
  EXPECT_THAT(run_statistics({}).out, HasSubstr("beside it lies unfinished work of 3 frames"));
  EXPECT_THAT(run_statistics({"--shard", "1/2", "--force"}).out, HasSubstr("statistics done: "));
  EXPECT_THAT(run_statistics({}).out, Not(HasSubstr("unfinished work")));
}

TEST_F(Program, ShardsOnTheCommandLine) {
  write_boxes(input(), 5);
  EXPECT_THAT(run_statistics({"--shard", "0/2"}).out, HasSubstr("3 of 5 frames are done"));
  EXPECT_THAT(run_statistics({"--shard", "1/2"}).out, HasSubstr("statistics done"));
}

TEST_F(Program, ALockedWorkspaceIsRefused) {
  write_boxes(input(), 1);
  std::filesystem::create_directories(stage_folder());
  const auto lock = FileLock::try_lock(stage_folder() / ".lock", FileLock::Mode::Exclusive);
  expect_refusal(run_statistics({}), kExitEnvironment,
                 "another run is working on 'statistics' here");
}

TEST_F(Program, ConsentIsShown) {
  write_boxes(input(), 1);
  std::ofstream(input() / "capture.toml")
      << "[consent]\nwho = 'P. Doe'\nscope = 'research'\nuntil = 2030-12-31\n";
  EXPECT_THAT(run_statistics({}).out, HasSubstr("consent: P. Doe, research, until 2030-12-31"));
  EXPECT_THAT(run({"status", workspace().string()}).out, HasSubstr("consent: P. Doe, research"));
}

TEST_F(Program, ConsentThatEndedIsAWarning) {
  write_boxes(input(), 1);
  std::ofstream(input() / "capture.toml")
      << "[consent]\nwho = 'P. Doe'\nscope = 'research'\nuntil = 2001-12-31\n";
  const std::string words = "the consent of P. Doe (research) ended with 2001-12-31";
  EXPECT_THAT(run_statistics({}).out, HasSubstr("warning: " + words));
  EXPECT_THAT(run({"status", workspace().string()}).out, HasSubstr(words));
  EXPECT_THAT(run({"inspect", (stage_folder() / "current/manifest.json").string()}).out,
              HasSubstr(words));
}

TEST_F(Program, UsageNamesTheCommandOnce) {
  EXPECT_THAT(run({"statistics", "--help"}).out,
              HasSubstr("Usage: atelier statistics [OPTIONS] INPUT WORKSPACE"));
}

TEST_F(Program, StatusChecks) {
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
}

TEST_F(Program, GcRemovesOlderResults) {
  write_boxes(input(), 1);
  run_statistics({});
  run_statistics({"--statistics.edge_quantiles", "0.5"});
  EXPECT_THAT(run({"gc", workspace().string(), "--dry-run"}).out, HasSubstr("would remove"));
  EXPECT_THAT(run({"gc", workspace().string()}).out, HasSubstr("removed"));
  EXPECT_THAT(run({"gc", workspace().string()}).out, HasSubstr("nothing to remove"));
}

TEST_F(Program, InspectSaysWhatAFileIs) {
  write_boxes(input(), 1);
  const ChildResult mesh = run({"inspect", (input() / "box_000.obj").string()});
  EXPECT_EQ(mesh.exit_code, 0) << mesh.err;
  EXPECT_THAT(mesh.out, AllOf(HasSubstr("vertices          8"), HasSubstr("1 m3")));
  run_statistics({});
  const ChildResult manifest =
      run({"inspect", (stage_folder() / "current/manifest.json").string()});
  EXPECT_THAT(manifest.out, HasSubstr("manifest of a result of 'statistics'"));
  const auto json =
      nlohmann::json::parse(run({"inspect", (input() / "box_000.obj").string(), "--json"}).out);
  EXPECT_EQ(json["vertices"], 8);
  EXPECT_EQ(json["area"], 6.0);
  EXPECT_EQ(json["units"]["area"], "m2");
  EXPECT_EQ(json["highest"], nlohmann::json({1.0, 1.0, 1.0}));
}

TEST_F(Program, InspectShowsTensorsAndNoControlCharacters) {
  const std::vector<float> values = {1, -2.5f, 3, std::nanf("")};
  Safetensors content;
  content.tensors["weights\x1b[31m"] = tensor_of(values, {2, 2});
  write_safetensors(root_ / "net.safetensors", content);
  write_npz(root_ / "data.npz", {{"weights", tensor_of(values, {2, 2})}});
  const ChildResult net = run({"inspect", (root_ / "net.safetensors").string()});
  EXPECT_EQ(net.exit_code, 0) << net.err;
  EXPECT_THAT(net.out, HasSubstr("weights?[31m"));
  EXPECT_THAT(net.out, Not(HasSubstr("\x1b")));
  EXPECT_THAT(net.out, HasSubstr("float32 [2,2], -2.5 to 3, 1 not finite"));
  EXPECT_THAT(run({"inspect", (root_ / "data.npz").string()}).out,
              HasSubstr("float32 [2,2], -2.5 to 3, 1 not finite"));
}

TEST_F(Program, MembersOverwriteNoFacts) {
  const std::vector<float> values = {1, 2};
  write_npz(root_ / "data.npz",
            {{"kind", tensor_of(values, {2})}, {"file", tensor_of(values, {2})}});
  const auto json =
      nlohmann::json::parse(run({"inspect", (root_ / "data.npz").string(), "--json"}).out);
  EXPECT_EQ(json["kind"], "npz");
  EXPECT_EQ(json["arrays"], 2);
  EXPECT_EQ(json["members"]["kind"]["shape"], nlohmann::json({2}));
  EXPECT_EQ(json["members"]["file"]["most"], 2.0);
}

TEST_F(Program, InspectShowsTheHdf5OfOthersThroughAWorker) {
  const std::filesystem::path corpus =
      std::filesystem::path(ATELIER_SOURCE_DIR) / "fuzz/corpus/foreign_hdf5";
  int shown = 0;
  for (const auto& entry : std::filesystem::directory_iterator(corpus)) {
    const std::filesystem::path copy = root_ / "foreign.h5";
    std::filesystem::copy_file(entry.path(), copy,
                               std::filesystem::copy_options::overwrite_existing);
    const ChildResult result = run({"inspect", copy.string(), "--json"});
    if (result.exit_code == 0) {
      const auto json = nlohmann::json::parse(result.out);
      EXPECT_EQ(json["kind"], "HDF5 of another program");
      EXPECT_TRUE(json["datasets"].is_number());
      ++shown;
    } else {
      EXPECT_EQ(result.exit_code, kExitBadData) << result.err;
    }
  }
  EXPECT_GT(shown, 0);
}

TEST_F(Program, InspectShowsSkinsAnimationsAndMorphTargetsOfGltf) {
  GltfScene scene;
  Mesh mesh;
  mesh.vertices = Points::Random(3, 3);
  mesh.faces.resize(1, 3);
  mesh.faces << 0, 1, 2;
  scene = gltf_scene(mesh, "cape");
  scene.meshes[0].primitives[0].targets = {{Points::Ones(3, 3), Points(0, 3)}};
  scene.meshes[0].target_names = {"billow"};
  GltfChannel channel;
  channel.node = 0;
  channel.path = GltfPath::Translation;
  channel.times = {0, 1.5};
  channel.values = Eigen::MatrixXd::Zero(2, 3);
  scene.animations.push_back({"sway", {channel}});
  write_gltf(root_ / "cape.glb", scene);
  const auto json =
      nlohmann::json::parse(run({"inspect", (root_ / "cape.glb").string(), "--json"}).out);
  EXPECT_EQ(json["vertices"], 3);
  EXPECT_EQ(json["skins"], 0);
  EXPECT_EQ(json["members"]["mesh 0"]["morph_targets"], 1);
  EXPECT_EQ(json["members"]["mesh 0"]["morph_target_names"][0], "billow");
  EXPECT_EQ(json["members"]["animation 0"]["seconds"], 1.5);
  EXPECT_EQ(json["members"]["animation 0"]["channels"]["translation"], 1);
}

TEST_F(Program, InspectShowsFoldersAndToml) {
  write_boxes(input(), 3);
  EXPECT_THAT(run({"inspect", input().string()}).out,
              AllOf(HasSubstr("meshes, one a frame"), HasSubstr("frames            3")));
  run_statistics({});
  EXPECT_THAT(run({"inspect", (stage_folder() / "current").string()}).out,
              HasSubstr("manifest of a result of 'statistics'"));
  std::ofstream(input() / "capture.toml")
      << "[consent]\nwho = 'P. Doe'\nscope = 'research'\nuntil = 2030-12-31\n";
  EXPECT_THAT(run({"inspect", input().string()}).out,
              AllOf(HasSubstr("a capture's description"), HasSubstr("P. Doe, research"),
                    HasSubstr("cameras.json      none")));
  std::ofstream(root_ / "options.toml") << "[input]\nunit = 'cm'\n";
  EXPECT_THAT(run({"inspect", (root_ / "options.toml").string()}).out,
              HasSubstr("input.unit      cm"));
}

TEST_F(Program, ReadsAteliersOwnSequences) {
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

TEST_F(Program, InspectFindsWhatIsDamaged) {
  write_boxes(input(), 1);
  run_statistics({});
  std::filesystem::remove(stage_folder() / "current/statistics.json");
  EXPECT_THAT(run({"inspect", (stage_folder() / "current/manifest.json").string()}).out,
              HasSubstr("output-missing"));
  EXPECT_EQ(run({"inspect", (stage_folder() / "current/manifest.json").string()}).exit_code,
            kExitBadData);
}

TEST_F(Program, ConvertKeepsTheMesh) {
  write_boxes(input(), 1);
  const std::string ply = (root_ / "box.ply").string();
  const ChildResult result =
      run({"convert", (input() / "box_000.obj").string(), ply, "--input.unit", "cm"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("8 vertices, 12 faces"));
  EXPECT_THAT(run({"inspect", ply}).out, HasSubstr("highest           0.01 0.01 0.01"));
}

TEST_F(Program, RenderMakesAPicture) {
  if (run({"--help"}).out.find("render") == std::string::npos) {
    GTEST_SKIP() << "built without core_render";
  }
  write_boxes(input(), 1);
  const std::string png = (root_ / "box.png").string();
  const ChildResult result = run({"render", (input() / "box_000.obj").string(), "--out", png,
                                  "--width", "64", "--height", "48", "--samples", "1"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(run({"inspect", png}).out,
              AllOf(HasSubstr("width             64 px"), HasSubstr("height            48 px")));
  const std::string jpg = (root_ / "box.JPG").string();
  EXPECT_EQ(run({"render", (input() / "box_000.obj").string(), "--out", jpg, "--width", "64",
                 "--height", "48", "--samples", "1"})
                .exit_code,
            0);
  EXPECT_THAT(run({"inspect", jpg}).out, HasSubstr("image, JPEG"));
  expect_refusal(run({"render", (input() / "box_000.obj").string(), "--out", "box.gif"}),
                 kExitUsage, "it takes a name with .png, .jpg");
  expect_refusal(
      run({"render", (input() / "box_000.obj").string(), "--out", "box.png", "--azimuth", "nan"}),
      kExitUsage, "azimuth cannot be 'nan': it takes a number in [-360, 360] (degrees)");
}

TEST_F(Program, ConvertTakesItsOptionsFromFilesAndFlagsAsStagesDo) {
  write_boxes(input(), 1);
  const std::string box = (input() / "box_000.obj").string();
  const std::string file = (root_ / "box.toml").string();
  const std::string ply = (root_ / "box.ply").string();
  std::ofstream(file) << "[input]\nunit = \"mm\"\n";
  ASSERT_EQ(run({"convert", box, ply, "--config", file}).exit_code, 0);
  EXPECT_THAT(run({"inspect", ply}).out, HasSubstr("highest           0.001 0.001 0.001"));
  ASSERT_EQ(run({"convert", box, ply, "--config", file, "--input.unit=dm"}).exit_code, 0);
  EXPECT_THAT(run({"inspect", ply}).out, HasSubstr("highest           0.1 0.1 0.1"));
  std::ofstream(file) << "[input]\nunits = \"mm\"\n";
  expect_refusal(run({"convert", box, ply, "--config", file}), kExitUsage,
                 "box.toml:2: there is no option 'input.units', did you mean 'input.unit'?");
}

TEST_F(Program, EveryOptionOfACommandIsInItsHelpAndTheDocument) {
  const std::string document = run({"options", "--markdown"}).out;
  EXPECT_THAT(document, HasSubstr("## atelier convert"));
  std::istringstream lines(document);
  std::string help;
  int options = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("## atelier ")) {
      help = run({line.substr(11), "--help"}).out;
    } else if (line.starts_with("| `")) {
      const std::string name = line.substr(3, line.find('`', 3) - 3);
      EXPECT_THAT(help, HasSubstr("--" + name + " "));
      ++options;
    }
  }
  EXPECT_GT(options, 4);
}

TEST_F(Program, TheDocumentOfOptionsIsUpToDate) {
  const ChildResult result = run({"options", "--markdown"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.out,
            read_file_text(std::string(ATELIER_SOURCE_DIR) + "/docs/options.md", 1 << 20))
      << "run: atelier options --markdown > docs/options.md";
}

TEST_F(Program, CompletionCompletes) {
  const std::string script = (root_ / "completion.bash").string();
  const ChildResult result = run({"completion", "bash"});
  ASSERT_EQ(result.exit_code, 0);
  std::ofstream(script) << result.out;
  const auto complete = [&](const std::string& words, int at) {
    const ChildResult shell = run_child({"bash", "-c",
                                         "source " + script + "; COMP_WORDS=(" + words +
                                             "); COMP_CWORD=" + std::to_string(at) +
                                             "; _atelier; echo \"${COMPREPLY[@]}\""});
    EXPECT_EQ(shell.exit_code, 0) << shell.err;
    EXPECT_THAT(shell.err, IsEmpty());
    return shell.out;
  };
  EXPECT_EQ(complete("atelier sta", 1), "statistics status\n");
  EXPECT_EQ(complete("atelier completion ba", 2), "bash\n");
  EXPECT_EQ(complete("atelier statistics --dry", 2), "--dry-run\n");
  EXPECT_EQ(complete("atelier statistics a b --statistics.e", 4), "--statistics.edge_quantiles\n");
  EXPECT_EQ(complete("atelier gc --j", 2), "--json\n");
  EXPECT_THAT(complete("atelier inspect " + (root_ / "compl").string(), 2), HasSubstr(script));
  EXPECT_EQ(complete("atelier nonsense --x", 2), "\n");
}

TEST_F(Program, AFullStandardOutputIsAnError) {
  const ChildResult result =
      run_child({"bash", "-c", std::string(ATELIER_SMALL_PROGRAM) + " --help > /dev/full"});
  EXPECT_EQ(result.exit_code, kExitEnvironment);
  EXPECT_THAT(result.err, HasSubstr("standard output"));
}

TEST_F(Program, TooLittleMemoryIsTheEnvironment) {
  write_boxes(input(), 1);
  // A mesh that needs a few hundred MB in an address space of less.
  std::ofstream(input() / "box_000.obj", std::ios::app) << std::string(300'000'000, '#');
  const ChildResult result =
      run_child({"bash", "-c",
                 "ulimit -v 400000; exec " + std::string(ATELIER_SMALL_PROGRAM) + " statistics " +
                     input().string() + " " + workspace().string() + " --jobs 1"});
  EXPECT_THAT(result.exit_code, ::testing::AnyOf(kExitEnvironment, kExitBadData)) << result.err;
  EXPECT_THAT(result.err, StartsWith("atelier: "));
}

// --- refusals of the command line

struct BadCommand {
  const char* name;
  std::vector<std::string> arguments;
  int code;
  const char* words;
};

void PrintTo(const BadCommand& bad, std::ostream* out) {
  *out << bad.name;
}

class Refused : public Program, public ::testing::WithParamInterface<BadCommand> {};

INSTANTIATE_TEST_SUITE_P(
    All, Refused,
    ::testing::Values(
        BadCommand{"UnknownCommand", {"statistcs"}, 2, "did you mean 'statistics'?"},
        BadCommand{"UnknownCommandFarAway", {"qqqqq"}, 2, "there is no command 'qqqqq'; see"},
        BadCommand{"FlagInsteadOfCommand", {"--workspace"}, 2, "there is no command"},
        BadCommand{"EmptyCommand", {""}, 2, "there is no command ''"},
        BadCommand{"NoInput", {"statistics"}, 2, "it takes an INPUT and a WORKSPACE"},
        BadCommand{"NoWorkspace", {"statistics", "IN"}, 2, "it takes an INPUT and a WORKSPACE"},
        BadCommand{"OneTooMany", {"statistics", "IN", "WS", "x"}, 2, "does not take 'x' as well"},
        BadCommand{
            "UnknownFlag",
            {"statistics", "IN", "WS", "--forse"},
            2,
            "has no option '--forse', did you mean '--force'? See atelier statistics --help"},
        BadCommand{"UnknownOption",
                   {"statistics", "IN", "WS", "--statistics.edge_quantile", "1"},
                   2,
                   "did you mean '--statistics.edge_quantiles'?"},
        BadCommand{"UnknownOptionWithEquals",
                   {"statistics", "IN", "WS", "--input.units=m"},
                   2,
                   "did you mean '--input.unit'?"},
        BadCommand{"OptionOutOfRange",
                   {"statistics", "IN", "WS", "--statistics.edge_quantiles", "2"},
                   2,
                   "it takes a list of numbers in [0, 1]"},
        BadCommand{"OptionNotANumber",
                   {"statistics", "IN", "WS", "--statistics.edge_quantiles", "half"},
                   2,
                   "statistics.edge_quantiles cannot be 'half'"},
        BadCommand{"OptionNaN",
                   {"statistics", "IN", "WS", "--statistics.edge_quantiles", "nan"},
                   2,
                   "cannot be 'nan'"},
        BadCommand{"UnknownChoice",
                   {"statistics", "IN", "WS", "--input.unit", "km"},
                   2,
                   "input.unit cannot be 'km': it takes m, dm, cm, mm, in, ft"},
        BadCommand{
            "OptionWithoutValue", {"statistics", "IN", "WS", "--input.unit"}, 2, "--input.unit"},
        BadCommand{"BadJobs", {"statistics", "IN", "WS", "--jobs", "-1"}, 2, "--jobs"},
        BadCommand{"JobsNoNumber", {"statistics", "IN", "WS", "--jobs", "many"}, 2, "--jobs"},
        BadCommand{"TooManyJobs", {"statistics", "IN", "WS", "--jobs", "1000000"}, 2, "--jobs"},
        BadCommand{"BadDevice", {"statistics", "IN", "WS", "--device", "tpu"}, 2, "--device"},
        BadCommand{"JobsNoWholeNumber",
                   {"statistics", "IN", "WS", "--jobs", "1.5"},
                   2,
                   "'1.5' is no whole number"},
        BadCommand{"CudaWithoutTwin",
                   {"statistics", "IN", "WS", "--device", "cuda"},
                   2,
                   "works on the processor alone"},
        BadCommand{
            "LongName", {"statistics", std::string(300, 'n'), "WS"}, 5, "File name too long"},
        BadCommand{
            "LongWorkspace", {"statistics", "IN", std::string(300, 'w')}, 5, "File name too long"},
        BadCommand{"LoopOfLinks", {"statistics", "loop", "WS"}, 3, "not a regular file"},
        BadCommand{"InspectALoop", {"inspect", "loop"}, 3, "not a regular file"},
        BadCommand{"InspectAPipe", {"inspect", "pipe.obj"}, 3, "not a regular file"},
        BadCommand{"InspectADevice", {"inspect", "/dev/null"}, 3, "not a regular file"},
        BadCommand{"ConvertAPipe", {"convert", "pipe.obj", "x.ply"}, 3, "not a regular file"},
        BadCommand{"ConvertALoop", {"convert", "loop.obj", "x.ply"}, 3, "not a regular file"},
        BadCommand{"ConvertADevice", {"convert", "null.obj", "x.ply"}, 3, "not a regular file"},
        BadCommand{"StatisticsOfAPipe", {"statistics", "pipe.obj", "WS"}, 3, "not a regular file"},
        BadCommand{"StatusOfALongName", {"status", std::string(300, 'w')}, 5, "File name too long"},
        BadCommand{"GcOfALoop", {"gc", "loop"}, 3, "no folder"},
        BadCommand{"StatusOfNoWorkspace", {"status", "IN"}, 3, "no stage has run"},
        BadCommand{"ConvertAFolder", {"convert", "IN", "x.ply"}, 3, "a folder"},
        BadCommand{"TerminalEscape", {"no\x1b[31m"}, 2, "'no?[31m'"},
        BadCommand{"BadFrames",
                   {"statistics", "IN", "WS", "--frames", "5:3"},
                   2,
                   "--frames cannot be '5:3'"},
        BadCommand{
            "BadShard", {"statistics", "IN", "WS", "--shard", "2/2"}, 2, "--shard cannot be '2/2'"},
        BadCommand{"FramesOfNothing",
                   {"statistics", "IN", "WS", "--frames", "100:200"},
                   3,
                   "expected some of frames 100:200"},
        BadCommand{"MissingConfig",
                   {"statistics", "IN", "WS", "--config", "nothing.toml"},
                   3,
                   "nothing.toml"},
        BadCommand{"MissingInput", {"statistics", "nothing", "WS"}, 3, "nothing there"},
        BadCommand{"WorkspaceInInput",
                   {"statistics", "IN", "IN/work"},
                   2,
                   "a workspace inside its own input"},
        BadCommand{"WorkspaceIsAFile", {"statistics", "IN", "IN/../file"}, 5, "file"},
        BadCommand{"WorkspaceInProc", {"statistics", "IN", "/proc/atelier"}, 5, "/proc"},
        BadCommand{"StatusOfNothing", {"status"}, 2, "it takes a WORKSPACE"},
        BadCommand{"StatusMissing", {"status", "nothing"}, 3, "no folder"},
        BadCommand{
            "StatusUnknownFlag", {"status", "WS", "--digest"}, 2, "did you mean '--digests'?"},
        BadCommand{"InspectNothing", {"inspect"}, 2, "it takes a FILE"},
        BadCommand{"InspectMissing", {"inspect", "nothing.obj"}, 3, "nothing there"},
        BadCommand{"InspectABareFolder", {"inspect", "bare"}, 3, "a folder of none of these"},
        BadCommand{"InspectNoToml", {"inspect", "no.toml"}, 3, "no.toml"},
        BadCommand{"InspectNoForeignHdf5", {"inspect", "half.h5"}, 3, "half.h5"},
        BadCommand{"InspectNoGltf", {"inspect", "no.glb"}, 3, "no.glb"},
        BadCommand{
            "InspectUnknownKind", {"inspect", "file"}, 3, "a kind of file that is not known"},
        BadCommand{"InspectNoImage", {"inspect", "no.png"}, 3, "no.png"},
        BadCommand{"InspectNoJson", {"inspect", "no.json"}, 3, "no.json"},
        BadCommand{"InspectNoArchive", {"inspect", "no.h5"}, 3, "no HDF5 file"},
        BadCommand{"InspectNoMesh", {"inspect", "no.ply"}, 3, "no.ply"},
        BadCommand{"InspectNoNpz", {"inspect", "no.npz"}, 3, "no.npz"},
        BadCommand{"GcOfNothing", {"gc"}, 2, "it takes a WORKSPACE"},
        BadCommand{"GcOfNoWorkspace", {"gc", "IN"}, 3, "no stage has run"},
        BadCommand{"GcMissing", {"gc", "nothing"}, 3, "no folder"},
        BadCommand{"ConvertNothing", {"convert"}, 2, "it takes two files"},
        BadCommand{"ConvertToUnknown",
                   {"convert", "IN/box_000.obj", "x.fbx"},
                   2,
                   "it takes a name with .obj, .ply or .glb"},
        BadCommand{"ConvertMissing", {"convert", "nothing.obj", "x.ply"}, 3, "nothing.obj"},
        BadCommand{"ConvertBadUnit",
                   {"convert", "a.obj", "b.obj", "--input.unit", "km"},
                   2,
                   "input.unit cannot be 'km'"},
        BadCommand{
            "ConvertIntoNothing", {"convert", "IN/box_000.obj", "no/where/x.ply"}, 5, "no/where"},
        BadCommand{"ConvertIntoNoFolder",
                   {"convert", "IN/box_000.obj", "nodir/x.obj"},
                   5,
                   "make the folder first"},
        BadCommand{"RenderIntoNoFolder",
                   {"render", "nothing.obj", "--out", "nodir/x.png"},
                   5,
                   "make the folder first"},
        BadCommand{"DrapeIntoAFile", {"drape", "--out", "file/x"}, 5, "name a"},
        BadCommand{"ShowIntoNoFolder",
                   {"body-model", "show", "default", "--out", "nodir/x.png"},
                   5,
                   "make the folder first"},
        BadCommand{
            "RenderTooManyPixels",
            {"render", "nothing.obj", "--out", "x.png", "--width", "16384", "--height", "16384"},
            2,
            "268435456 pixels: at most 64000000"},
        BadCommand{"ShowTooManyPixels",
                   {"body-model", "show", "default", "--out", "x.png", "--width", "6000",
                    "--height", "6000"},
                   2,
                   "144000000 pixels: at most 64000000"},
        BadCommand{"EmptyList",
                   {"statistics", "IN", "WS", "--statistics.edge_quantiles", ""},
                   2,
                   "statistics.edge_quantiles cannot be ''"},
        BadCommand{"CompletionOfAnotherShell", {"completion", "fish"}, 2, "of which there is bash"},
        BadCommand{"OptionsWithArgument", {"options", "x"}, 2, "does not take 'x' as well"}),
    [](const ::testing::TestParamInfo<BadCommand>& bad) { return bad.param.name; });

TEST_P(Refused, IsOneLineAndItsCode) {
  write_boxes(input(), 1);
  std::ofstream(root_ / "file") << "x";
  std::filesystem::create_symlink("loop", root_ / "loop");
  std::filesystem::create_symlink("loop.obj", root_ / "loop.obj");
  std::filesystem::create_symlink("/dev/null", root_ / "null.obj");
  ASSERT_EQ(mkfifo((root_ / "pipe.obj").c_str(), 0600), 0);
  std::filesystem::create_directory(root_ / "bare");
  std::ofstream(root_ / "half.h5") << "\x89HDF\r\n\x1a\n and no more";
  for (const char* name : {"no.png", "no.json", "no.h5", "no.ply", "no.npz", "no.toml", "no.glb"}) {
    std::ofstream(root_ / name) << "this is something else";
  }
  std::vector<std::string> arguments = GetParam().arguments;
  std::string command =
      "cd " + root_.path().string() + " && exec " +
      (arguments.empty() || arguments[0] == "statistics" || arguments[0] == "status"
           ? ATELIER_SMALL_PROGRAM
           : ATELIER_PROGRAM);
  for (std::string& argument : arguments) {
    if (argument.starts_with("IN")) {
      argument.replace(0, 2, "boxes");
    } else if (argument == "WS") {
      argument = "work";
    }
    command += " '" + argument + "'";
  }
  expect_refusal(run_child({"bash", "-c", command}), GetParam().code, GetParam().words);
  EXPECT_FALSE(std::filesystem::exists(stage_folder() / "current"));
}

// Files that cannot be used: one line with the file, code 3, no result.

struct BadInput {
  const char* name;
  const char* file;
  const char* text;
  const char* words;
};

void PrintTo(const BadInput& bad, std::ostream* out) {
  *out << bad.name;
}

class BadMeshes : public Program, public ::testing::WithParamInterface<BadInput> {};

INSTANTIATE_TEST_SUITE_P(
    All, BadMeshes,
    ::testing::Values(
        BadInput{"NaN", "box_001.obj", "v nan 0 0\n", "box_001.obj"},
        BadInput{"Infinity", "box_001.obj", "v inf 0 0\n", "box_001.obj"},
        BadInput{"IndexOutOfRange", "box_001.obj", "v 0 0 0\nf 1 2 3\n", "box_001.obj"},
        BadInput{"NoNumber", "box.obj", "v 0 0 0\n", "no frame number at its end"},
        BadInput{"SameNumber", "shape_0.obj", "v 0 0 0\n", "one file for each frame"},
        BadInput{"HugeNumber", "box_99999999999.obj", "v 0 0 0\n", "no frame number at its end"},
        BadInput{"NoPly", "box_001.ply", "hello", "box_001.ply"},
        BadInput{"NoToml", "capture.toml", "[consent", "capture.toml"},
        BadInput{"BadConsent", "capture.toml", "consent = 1", "capture.toml"}),
    [](const ::testing::TestParamInfo<BadInput>& bad) { return bad.param.name; });

TEST_P(BadMeshes, AreRefusedByName) {
  write_boxes(input(), 1);
  std::ofstream(input() / GetParam().file) << GetParam().text;
  const ChildResult result = run_statistics({"--jobs", "1"});
  EXPECT_EQ(result.exit_code, kExitBadData) << result.err;
  EXPECT_THAT(result.err, HasSubstr("atelier: "));
  EXPECT_THAT(result.err, HasSubstr(GetParam().words));
  EXPECT_FALSE(std::filesystem::exists(stage_folder() / "current"));
}

}  // namespace
}  // namespace atelier::testing
