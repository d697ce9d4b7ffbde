#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/error.h"
#include "core/store/result.h"
#include "core/store/run_stage.h"
#include "tests/core_store/run_stage_fixture.h"

namespace atelier::fixtures {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using End = StageReport::End;

TEST_F(RunStage, MissingInput_IsRefused) {
  StageRequest what = request("count");
  what.input = root_ / "nothing";
  EXPECT_THAT(refusal<DataError>("count", what), HasSubstr("nothing there"));
  EXPECT_FALSE(std::filesystem::exists(root_ / "work"));
}

TEST_F(RunStage, EmptyInputFolder_IsRefused) {
  std::filesystem::create_directory(root_ / "empty");
  StageRequest what = request("count");
  what.input = root_ / "empty";
  EXPECT_THAT(refusal<DataError>("count", what), HasSubstr("an empty folder"));
}

TEST_F(RunStage, LinksInsideInput_AreFollowed) {
  std::filesystem::create_directories(root_ / "far/deep");
  write(root_ / "far/deep/c.txt", "c");
  std::filesystem::copy(root_ / "far", root_ / "in/far", std::filesystem::copy_options::recursive);
  ASSERT_EQ(run("count").end, End::Done);
  std::filesystem::remove_all(root_ / "in/far");
  std::filesystem::create_directory_symlink(root_ / "far", root_ / "in/far");
  EXPECT_EQ(run("count").end, End::AlreadyDone) << "as if what it leads to lay there";
  write(root_ / "far/deep/c.txt", "d");
  EXPECT_EQ(run("count").end, End::Done);
}

TEST_F(RunStage, LinkThatLeadsNowhereOrInACircle_IsRefused) {
  std::filesystem::create_symlink("gone.txt", root_ / "in/link.txt");
  EXPECT_THAT(refusal<DataError>("count", request("count")),
              HasSubstr("link.txt: a symbolic link to gone.txt, where nothing is"));
  std::filesystem::remove(root_ / "in/link.txt");
  std::filesystem::create_symlink("link.txt", root_ / "in/link.txt");
  EXPECT_THAT(refusal<DataError>("count", request("count")), HasSubstr("neither file nor folder"));
  std::filesystem::remove(root_ / "in/link.txt");
  std::filesystem::create_directory(root_ / "other");
  std::filesystem::create_directory_symlink(root_ / "in", root_ / "other/back");
  std::filesystem::create_directory_symlink(root_ / "other", root_ / "in/there");
  EXPECT_THAT(refusal<DataError>("count", request("count")),
              HasSubstr("there/back: a symbolic link that leads in a circle"));
}

TEST_F(RunStage, LinkToADevice_IsRefused) {
  std::filesystem::create_symlink("/dev/zero", root_ / "in/link.txt");
  EXPECT_THAT(refusal<DataError>("count", request("count")), HasSubstr("neither file nor folder"));
}

TEST_F(RunStage, PipeInsideInput_IsRefused) {
  ASSERT_EQ(mkfifo((root_ / "in/pipe").c_str(), 0600), 0);
  EXPECT_THAT(refusal<DataError>("count", request("count")), HasSubstr("neither file nor folder"));
}

TEST_F(RunStage, InputThatIsALink_IsFollowed) {
  std::filesystem::create_directory_symlink(root_ / "in", root_ / "link");
  StageRequest what = request("count");
  what.input = root_ / "link";
  EXPECT_EQ(run("count", what).end, End::Done);
  EXPECT_EQ(run("count").end, End::AlreadyDone) << "the same input by another name";
}

TEST_F(RunStage, HiddenInputFiles_DoNotCount) {
  run("count");
  write(root_ / "in/.DS_Store", "x");
  EXPECT_EQ(run("count").end, End::AlreadyDone);
}

TEST_F(RunStage, WorkspaceInsideInput_IsRefused) {
  StageRequest what = request("count");
  what.workspace = root_ / "in/work";
  EXPECT_THAT(refusal<DataError>("count", what), HasSubstr("a workspace inside its own input"));
  what.workspace = root_ / "in";
  EXPECT_THAT(refusal<DataError>("count", what), HasSubstr("a workspace inside its own input"));
  what.workspace = root_ / "in/../in/x";
  EXPECT_THAT(refusal<DataError>("count", what), HasSubstr("a workspace inside its own input"));
}

TEST_F(RunStage, FolderOfOtherThingsAsWorkspace_IsRefused) {
  write(root_ / "work/capture.toml", "x");
  EXPECT_THAT(refusal<DataError>("count", request("count")),
              HasSubstr("no workspace: it holds capture.toml, and no stage's results; expected a "
                        "workspace, or a new or empty folder"));
  write(root_ / "work/images/a.png", "x");
  write(root_ / "work/labels/a.png", "x");
  EXPECT_THAT(refusal<DataError>("count", request("count")),
              HasSubstr("it holds capture.toml, images and 1 more"));
  EXPECT_THAT(names(root_ / "work"), ElementsAre("capture.toml", "images", "labels"));
}

TEST_F(RunStage, HiddenFilesAndNotesInWorkspace_AreAccepted) {
  write(root_ / "work/.gitignore", "*");
  std::filesystem::create_directory(root_ / "work/lost+found");
  EXPECT_EQ(run("count").end, End::Done);
  write(root_ / "work/notes.txt", "x");
  EXPECT_EQ(run("frames").end, End::Done);
}

TEST_F(RunStage, WorkspaceThatIsAFile_IsRefused) {
  StageRequest what = request("count");
  what.workspace = root_ / "file";
  write(what.workspace, "x");
  EXPECT_THAT(refusal<EnvironmentError>("count", what), HasSubstr("file"));
}

TEST_F(RunStage, StageFolderThatIsALink_IsRefused) {
  std::filesystem::create_directories(root_ / "work");
  std::filesystem::create_directories(root_ / "elsewhere");
  std::filesystem::create_directory_symlink(root_ / "elsewhere", root_ / "work/count");
  EXPECT_THAT(refusal<DataError>("count", request("count")),
              HasSubstr("a symbolic link; expected a folder: a workspace holds no links"));
  EXPECT_THAT(names(root_ / "elsewhere"), IsEmpty());
}

TEST_F(RunStage, LockThatIsALink_IsRefused) {
  std::filesystem::create_directories(root_ / "work/count");
  write(root_ / "precious", "x");
  std::filesystem::create_symlink(root_ / "precious", root_ / "work/count/.lock");
  EXPECT_THAT(refusal<EnvironmentError>("count", request("count")), HasSubstr(".lock"));
}

TEST_F(RunStage, StagingThatIsALink_IsRemovedWithoutFollowing) {
  write(root_ / "precious/file", "x");
  const StagePlan plan =
      plan_stage(kTestStages, *find_stage(kTestStages, "frames"), request("frames"));
  std::filesystem::create_directories(plan.stage_folder);
  std::filesystem::create_directory_symlink(root_ / "precious", plan.staging_folder);
  EXPECT_EQ(run("frames").end, End::Done);
  EXPECT_THAT(names(root_ / "precious"), ElementsAre("file"));
}

TEST_F(RunStage, ReadOnlyWorkspace_IsRefused) {
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

TEST_F(RunStage, ShardsOfStageWithoutFrames_AreRefused) {
  StageRequest what = request("count");
  what.selection.shards = 2;
  EXPECT_THROW(run("count", what), LogicError);
}

TEST_F(RunStage, OptionOutOfRange_IsRefused) {
  StageRequest what = request("count");
  static_cast<CountOptions*>(what.options.values.get())->scale = -1;
  EXPECT_THROW(run("count", what), LogicError);
}

TEST_F(RunStage, MissingUpstreamResult_IsRefused) {
  EXPECT_THAT(refusal<DataError>("double", request("double")),
              HasSubstr("run 'atelier count' first"));
}

TEST_F(RunStage, DamagedUpstreamResult_IsRefused) {
  run("count");
  write(current("count") / "count.txt", "9 files");
  EXPECT_THAT(refusal<DataError>("double", request("double")),
              HasSubstr("run 'atelier count' first"));
}

TEST_F(RunStage, InputChangedDuringRun_IsRefused) {
  behaviour().during = [this] { write(root_ / "in/late.txt", "x"); };
  EXPECT_THAT(refusal<DataError>("count", request("count")),
              HasSubstr("files that changed while the stage ran"));
  EXPECT_FALSE(current_name(folder("count")));
}

TEST_F(RunStage, TooLittleDiskSpace_IsRefused) {
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
        Misuse{"MetricNaN", [](StageRun& run) { run.metric("files", 0.0 / 0.0); }},
        Misuse{"MetricUndeclared", [](StageRun& run) { run.metric("m", 1); }},
        Misuse{"FramesUnsaid",
               [](StageRun& run) { run.each_frame("f", ".t", {1}, [](int, const auto&) {}); }}),
    [](const ::testing::TestParamInfo<Misuse>& misuse) { return misuse.param.name; });

TEST_P(StageMisuse, MisbehavingStage_IsRefused) {
  Stage stage = *find_stage(kTestStages, "count");
  stage.run = GetParam().run;
  EXPECT_THROW(run_stage(kTestStages, stage, request("count")), LogicError);
  EXPECT_FALSE(std::filesystem::exists(root_ / "work")) << "nothing is left of a refused first run";
}

struct FrameMisuse {
  const char* name;
  std::vector<int> frame_ids;
};

class StageFrameMisuse : public RunStage, public ::testing::WithParamInterface<FrameMisuse> {};

INSTANTIATE_TEST_SUITE_P(All, StageFrameMisuse,
                         ::testing::Values(FrameMisuse{"Negative", {-1, 2}},
                                           FrameMisuse{"Twice", {1, 1}},
                                           FrameMisuse{"Backwards", {3, 2}}),
                         [](const ::testing::TestParamInfo<FrameMisuse>& misuse) {
                           return misuse.param.name;
                         });

TEST_P(StageFrameMisuse, BadFrameIds_AreRefused) {
  behaviour().frame_ids = GetParam().frame_ids;
  EXPECT_THROW(run("frames"), LogicError);
}

}  // namespace
}  // namespace atelier::fixtures
