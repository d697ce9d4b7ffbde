// What evaluate and report say of the stages personalize, track and body, and of which results they
// say nothing.
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL_TRACKING)

#include <array>
#include <fstream>
#include <map>

#include <gmock/gmock.h>

#include "bodymodel/formats/personal_body.h"
#include "core/store/commit.h"
#include "core/store/stage.h"
#include "tests/apps/person_fixture.h"
#include "tests/apps/program_versions.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

/// A stage's result as if a version of the stage had made it that is no more.
void age(const fs::path& workspace, const std::string& stage) {
  const fs::path folder = fs::canonical(workspace / stage / "current");
  Manifest manifest = read_manifest(folder, stage);
  --manifest.stage_version;
  manifest.key = stage_key(manifest.stage, manifest.stage_version, manifest.device,
                           manifest.canonical_options, manifest.inputs);
  const fs::path staging = folder.parent_path() / ".staging-aged";
  fs::rename(folder, staging);
  commit_result(staging, folder.parent_path() / folder_name(manifest.key), manifest);
}

TEST_F(Person, NothingExcluded_StillJudgesTheDetector) {
  ASSERT_EQ(run_stage("track", {"--exclude", "none"}).exit_code, 0);
  const ChildResult figures = evaluate({"--stage", "track", "--json"});
  ASSERT_EQ(figures.exit_code, 0) << figures.err;
  const nlohmann::json values = nlohmann::json::parse(figures.out);
  EXPECT_GT(values.at("track.dynamic_share"), 0.1);
  EXPECT_EQ(values.at("track.legs_none_mm"), values.at("track.legs_mm"));
  EXPECT_GT(values.at("track.legs_ratio"), 0);
  EXPECT_GT(values.at("track.auto_ratio"), 0);
}

TEST_F(Person, Comparison_IsTrackedWithTheSameOptions) {
  const std::vector<std::string> same = {"--input.capture.fps",     "40",    //
                                         "--input.keypoint-noise",  "0.01",  //
                                         "--motion.acceleration",   "35",    //
                                         "--weights.cloth-outlier", "0.05"};
  const std::vector<std::string> none = with_usual(same, {"--exclude", "none"});
  const auto figures = [&](const std::vector<std::string>& options) {
    const ChildResult tracked = run_stage("track", options);
    EXPECT_EQ(tracked.exit_code, 0) << tracked.err;
    return nlohmann::json::parse(evaluate({"--stage", "track", "--json"}).out);
  };
  const nlohmann::json automatic =
      figures(with_usual(same, {"--dynamic.swing", "0.012", "--dynamic.gap", "0.05"}));
  const nlohmann::json usual = figures(same);
  EXPECT_NE(automatic.at("track.legs_mm"), usual.at("track.legs_mm"));
  const nlohmann::json nothing = figures(none);
  EXPECT_EQ(automatic.at("track.legs_none_mm"), nothing.at("track.legs_mm"));
  EXPECT_EQ(nothing.at("track.legs_none_mm"), nothing.at("track.legs_mm"));
  EXPECT_DOUBLE_EQ(nothing.at("track.legs_ratio"), usual.at("track.legs_ratio"));
  EXPECT_DOUBLE_EQ(nothing.at("track.auto_ratio"), usual.at("track.auto_ratio"));
}

TEST_F(Person, ReferenceExcludingNothing_IsNotUsed) {
  const ChildResult tracked =
      run_stage("track", {"--exclude", "labels", "--input.excluded", "outer"});
  ASSERT_EQ(tracked.exit_code, 0) << tracked.err;
  EXPECT_THAT(tracked.err, HasSubstr("label-nowhere [scans]: no point is labelled outer"));
  const ChildResult figures = evaluate({"--stage", "track", "--json", "--check"});
  const nlohmann::json values = nlohmann::json::parse(figures.out);
  EXPECT_TRUE(values.contains("track.legs_ratio"));
  EXPECT_FALSE(values.contains("track.auto_ratio"));
  EXPECT_THAT(figures.out, HasSubstr("no ground-truth garment has a label of --input.excluded"));
}

TEST_F(Person, TargetRange_IsTheSameWithAndWithoutCheck) {
  const std::string plain = evaluate({"--stage", "personalize"}).out;
  EXPECT_THAT(plain, HasSubstr("(at most 7)")) << "small images: the range of demo";
  EXPECT_THAT(evaluate({"--stage", "personalize", "--check"}).out, StartsWith(plain));
}

TEST_F(Person, OtherRestPose_IsNotMeasured) {
  const fs::path file = workspace_ / "personalize" / "current" / "person.npz";
  PersonalBody person = read_personal_body(file);
  person.model.skeleton.names[0] = "root";
  write_personal_body(file, person);
  const std::string figures = evaluate({"--stage", "personalize"}).out;
  EXPECT_THAT(
      figures,
      HasSubstr("personalize: not measured: the person's body model has another rest pose"));
  EXPECT_THAT(figures, Not(HasSubstr("personal.mean_mm")));
}

TEST_F(Person, ResultsOfAnotherCapture_AreRefused) {
  const fs::path other = own_.path() / "other";
  fs::copy(capture(), other, fs::copy_options::recursive);
  // The same capture elsewhere is no other.
  ASSERT_EQ(run_stage("track").exit_code, 0);
  ASSERT_EQ(run_child({program_path(), "body", other.string(), workspace_.string(), "--dry-run"})
                .exit_code,
            0);
  const auto judged = [&](const char* command) {
    return run_child(
        {program_path(), command, workspace_.string(), "--ground-truth", other.string()});
  };
  EXPECT_EQ(judged("evaluate").exit_code, 0);
  fs::remove(other / "images" / "00" / "000000.png");
  EXPECT_EQ(judged("evaluate").exit_code, 0) << "nor is one that lost an image";
  for (const fs::directory_entry& file : fs::recursive_directory_iterator(other)) {
    if (file.is_regular_file()) {
      std::ofstream(file.path(), std::ios::app) << "\n";
    }
  }
  for (const char* command : {"evaluate", "report"}) {
    const ChildResult refused = judged(command);
    EXPECT_EQ(refused.exit_code, 3);
    EXPECT_THAT(refused.err,
                AllOf(HasSubstr("another capture than the one that the result of"),
                      HasSubstr("--ground-truth " + fs::canonical(capture()).string())));
    EXPECT_THAT(refused.out, ::testing::IsEmpty());
  }
  for (const char* stage : {"personalize", "track", "body"}) {
    const ChildResult refused =
        run_child({program_path(), stage, other.string(), workspace_.string(), "--force"});
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_THAT(refused.err, AllOf(HasSubstr("it holds results of another capture, " +
                                             fs::canonical(capture()).string()),
                                   HasSubstr("give --replace")));
    EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1) << refused.err;
  }
}

TEST_F(Person, GroundTruthScans_AreJudgedMoreStrictly) {
  const auto figures = [&] {
    return evaluate({"--stage", "personalize", "--targets", "accuracy"}).out;
  };
  EXPECT_THAT(figures(), HasSubstr("at most 3"));
  ASSERT_EQ(run_stage("personalize", {"--input.scans", "ground_truth", "--samples", "800",
                                      "--shape-rounds", "1", "--surface-rounds", "1"})
                .exit_code,
            0);
  EXPECT_THAT(figures(), HasSubstr("at most 2"));
  const ChildResult body = run_stage("body");
  ASSERT_EQ(body.exit_code, 0) << body.err;
  EXPECT_THAT(body.err, HasSubstr("made with another person than that of 'personalize' now"));
  // Poses of another person are not held against what this one's would be.
  const std::string mended =
      "run 'atelier track " + capture().string() + " " + workspace_.string() + "'";
  const std::string old = evaluate({"--stage", "track", "--check"}).out;
  EXPECT_THAT(old, HasSubstr("track: not measured: outdated: its input person of 'personalize' "
                             "has changed since; " +
                             mended));
  EXPECT_THAT(old, Not(HasSubstr("track.dynamic_share")));
  EXPECT_THAT(old, HasSubstr("not measured  outdated"));
  const nlohmann::json json = nlohmann::json::parse(evaluate({"--stage", "track", "--json"}).out);
  EXPECT_THAT(json.at("not_measured").at("track").get<std::string>(), HasSubstr(mended));
  // Nor is what was made of them judged.
  const std::string after = evaluate({"--stage", "body", "--check"}).out;
  EXPECT_THAT(after, HasSubstr("body: not measured: outdated: 'track' before it is outdated; run "
                               "'atelier run " +
                               capture().string() + " " + workspace_.string() +
                               " --from track --to body'"));
  EXPECT_THAT(after, Not(HasSubstr("met ")));
}

TEST_F(Person, ResultOnOutdatedInput_IsNotMeasured) {
  ASSERT_EQ(run_stage("body").exit_code, 0);
  const std::string places = capture().string() + " " + workspace_.string();
  const auto unmeasured = [&](const std::string& stage) -> std::string {
    const nlohmann::json json = nlohmann::json::parse(evaluate({"--json", "--stage", stage}).out);
    return json.contains("not_measured") ? json["not_measured"].value(stage, "") : "";
  };
  EXPECT_EQ(unmeasured("body"), "");
  age(workspace_, "track");
  EXPECT_THAT(unmeasured("track"), AllOf(HasSubstr("outdated: made by version "),
                                         HasSubstr("run 'atelier track " + places + "'")));
  const std::string mended = "outdated: 'track' before it is outdated; run 'atelier run " + places +
                             " --from track --to body'";
  EXPECT_EQ(unmeasured("body"), mended);
  EXPECT_EQ(unmeasured("personalize"), "") << "track is behind it";
  const ChildResult judged = evaluate({"--stage", "body", "--check", "--complete"});
  EXPECT_EQ(judged.exit_code, 1);
  EXPECT_THAT(judged.out, AllOf(HasSubstr("not measured  " + mended), Not(HasSubstr("met "))));
  ASSERT_EQ(run_child({program_path(), "report", workspace_.string(), "--ground-truth",
                       capture().string()})
                .exit_code,
            0);
  EXPECT_THAT(read_text(workspace_ / "report" / "index.html"), HasSubstr("--from track --to body"));
  age(workspace_, "reconstruct");
  const nlohmann::json all = nlohmann::json::parse(evaluate({"--json"}).out);
  for (const char* stage : {"reconstruct", "personalize", "track", "body"}) {
    EXPECT_THAT(all.at("not_measured").value(stage, ""), StartsWith("outdated: ")) << stage;
  }
  for (const auto& [key, value] : all.items()) {
    EXPECT_TRUE(key == "not_measured" || key.starts_with("capture.")) << key;
  }
}

/// A result of `register`, of the capture's true garment in its first frame.
/// @param device  that it says it was made on: another one is another result
void register_true_garment(const fs::path& workspace, const fs::path& capture,
                           const std::string& device = "cpu") {
  const GroundTruth truth = read_ground_truth(capture);
  const fs::path staging = workspace / "register" / ".staging-true";
  fs::create_directories(staging / "frames");
  SequenceHeader header;
  header.fps = 12;
  header.shared.faces = truth.garments[0].garment.mesh.faces;
  header.frame_ids = {0};
  Mesh mesh;
  mesh.vertices = read_ground_truth_frame(capture, truth, 0).garments[0];
  write_mesh_archive(staging / sequence_frame_path("", 0), mesh);
  write_archive(staging / "sequence.h5", archive_of(header));
  Manifest manifest = read_manifest(fs::canonical(workspace / "body" / "current"), "body");
  manifest.stage = "register";
  std::array<Stage, 1> stages;
  stages.front().name = manifest.stage;
  manifest.stage_version = with_program_versions(stages).front().version;
  manifest.device = device;
  manifest.key = stage_key(manifest.stage, manifest.stage_version, manifest.device,
                           manifest.canonical_options, manifest.inputs);
  manifest.outputs.clear();
  for (const std::string& path :
       {sequence_frame_path("", 0).string(), std::string("sequence.h5")}) {
    const std::string bytes = read_text(staging / path);
    manifest.outputs.push_back({path, static_cast<std::int64_t>(bytes.size()), sha256(bytes)});
  }
  commit_result(staging, staging.parent_path() / folder_name(manifest.key), manifest);
}

TEST_F(Person, RegisteringAgain_OutdatesRefineInEveryCommand) {
  ASSERT_EQ(run_stage("body").exit_code, 0);
  register_true_garment(workspace_, capture());
  const std::string places = capture().string() + " " + workspace_.string();
  const std::string garment = (workspace_ / "register" / "current").string();
  const std::vector<std::string> refine = {program_path(), "refine", garment, workspace_.string()};
  ASSERT_EQ(run_child(refine).exit_code, 0);
  const auto said = [&](const std::string& command) -> std::string {
    std::vector<std::string> words = {program_path(), command};
    if (command == "run") {
      words.insert(words.end(), {capture().string(), workspace_.string(), "--to", "validate"});
    } else {
      words.push_back(workspace_.string());
    }
    if (command == "evaluate") {
      words.insert(words.end(), {"--ground-truth", capture().string(), "--stage", "refine"});
    }
    const ChildResult result = run_child(words);
    EXPECT_EQ(result.exit_code, 0) << command << result.err;
    std::string text = result.out;
    if (command == "report") {
      const std::string page = read_text(workspace_ / "report" / "index.html");
      text = page.substr(0, page.find("</ul>"));  // what it says first
      for (std::size_t at = 0; (at = text.find("&#39;", at)) != std::string::npos; ++at) {
        text.replace(at, 5, "'");
      }
    }
    return text;
  };
  using Commands = std::vector<std::string>;
  const auto sound = [&](const Commands& commands) {
    for (const std::string& command : commands) {
      EXPECT_THAT(said(command), Not(HasSubstr("outdated"))) << command;
    }
  };
  std::map<std::string, std::string> last;
  const auto outdated = [&](const Commands& commands) {
    for (const std::string& command : commands) {
      last[command] = said(command);
      EXPECT_THAT(last[command], AllOf(HasSubstr("outdated"),
                                       HasSubstr("is made from a result of 'register' that is no "
                                                 "longer the current one")))
          << command;
    }
  };
  sound({"status", "evaluate", "report", "run"});
  register_true_garment(workspace_, capture(), "cuda");
  outdated({"status", "evaluate", "report", "run"});
  EXPECT_THAT(last["evaluate"],
              HasSubstr("run 'atelier refine " + garment + " " + workspace_.string() + "'"));
  EXPECT_THAT(last["run"], HasSubstr("warning: the result of 'refine' is outdated: "));
  ASSERT_EQ(run_child(refine).exit_code, 0);
  sound({"status", "evaluate", "run"});
  age(workspace_, "register");  // and the one that it was made of is gone
  outdated({"status", "evaluate", "report"});
  EXPECT_THAT(last["evaluate"], HasSubstr("run 'atelier run " + places +
                                          " --from register --to register' and 'atelier refine " +
                                          garment + " " + workspace_.string() + "'"));
}

TEST_F(Person, OutdatedBody_WarnsInRefineAndNamesTheRerun) {
  ASSERT_EQ(run_stage("body").exit_code, 0);
  register_true_garment(workspace_, capture());
  const std::string garment = (workspace_ / "register" / "current").string();
  const std::vector<std::string> refine = {program_path(), "refine", garment, workspace_.string()};
  const ChildResult fresh = run_child(refine);
  ASSERT_EQ(fresh.exit_code, 0) << fresh.err;
  EXPECT_THAT(fresh.err, Not(HasSubstr("outdated")));
  age(workspace_, "body");
  const std::string mended = evaluate({"--stage", "refine"}).out;
  EXPECT_THAT(mended,
              HasSubstr("run 'atelier run " + capture().string() + " " + workspace_.string() +
                        " --from body --to body' and 'atelier refine " + garment + " " +
                        workspace_.string() + "'"));
  const ChildResult old = run_child(refine);
  ASSERT_EQ(old.exit_code, 0) << old.err;
  EXPECT_THAT(old.err + old.out, HasSubstr("the result of 'body' is outdated: made by version"));
}

}  // namespace
}  // namespace atelier::fixtures

#endif
