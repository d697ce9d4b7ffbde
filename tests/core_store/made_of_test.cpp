#include "core/store/made_of.h"

#include "tests/core_store/run_stage_fixture.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;

/// "template 0011223344556677, body ..." of an INPUT.
std::string behind(const fs::path& workspace, const fs::path& input) {
  std::string text;
  for (const ResultName& name : results_behind(workspace, input)) {
    text += (text.empty() ? "" : ", ") + name.stage + " " + name.key16;
  }
  return text;
}

/// A workspace with a folder that was made of two results.
class MadeOf : public ::testing::Test {
 protected:
  void SetUp() override {
    write(work() / "scene" / kMadeOfFile,
          "3\nregister 0011223344556677\nbody 8899aabbccddeeff\nbody.obj 01\nstates/0.obj 02\n");
    write(work() / "scene" / "body.obj", "");
    write(work() / "scene" / "mine.obj", "");
    write(work() / "scene" / "states" / "0.obj", "");
  }

  fs::path work() const { return root_ / "work"; }

  const std::string made_ = "register 0011223344556677, body 8899aabbccddeeff";
  TemporaryDirectory root_;
};

TEST_F(MadeOf, InputPath_IsRecognizedHoweverWritten) {
  fs::create_directory_symlink(work() / "scene", root_ / "link");
  const fs::path relative = fs::relative(work() / "scene");
  ASSERT_TRUE(relative.is_relative());
  for (const fs::path& input :
       {work() / "scene", work() / "scene/", work() / "scene/.", work() / "scene/states/..",
        work() / "../work/scene", relative, relative / "", root_ / "link"}) {
    EXPECT_EQ(behind(work(), input), made_) << input;
    EXPECT_EQ(behind(fs::relative(work()), input), made_) << input;
  }
  EXPECT_EQ(behind(root_.path(), work() / "scene"), "") << "another workspace";
  EXPECT_EQ(behind(work(), root_.path()), "");
  EXPECT_EQ(behind(work(), work()), "");
}

TEST_F(MadeOf, FileOfStageResult_HasTheSameOrigin) {
  EXPECT_EQ(behind(work(), work() / "scene" / "body.obj"), made_);
  EXPECT_EQ(behind(work(), work() / "scene" / ".." / "scene" / "body.obj"), made_);
  EXPECT_EQ(behind(work(), work() / "scene" / "mine.obj"), "") << "somebody put it there";
}

TEST_F(MadeOf, CopiedOrMovedWorkspace_HasItsOwnInputs) {
  const fs::path copy = root_ / "copy";
  fs::copy(work(), copy, fs::copy_options::recursive);
  write(copy / "scene" / kMadeOfFile, "3\nregister ffffffffffffffff\nbody.obj 01\n");
  const std::string changed = "register ffffffffffffffff";
  EXPECT_EQ(behind(copy, work() / "scene"), changed) << "not those of the original";
  EXPECT_EQ(behind(copy, work() / "scene" / "body.obj"), changed);
  EXPECT_EQ(place_now(copy, work() / "scene"), fs::canonical(copy) / "scene");
  EXPECT_EQ(behind(work(), work() / "scene"), made_);
  fs::rename(work(), root_ / "elsewhere");
  EXPECT_EQ(behind(copy, work() / "scene"), changed);
}

TEST_F(MadeOf, InputOutsideOfEveryWorkspace_StaysWhereItIs) {
  const fs::path outside = root_ / "outside" / "scene";
  write(outside / "body.obj", "");
  EXPECT_EQ(place_now(work(), outside), outside);
  EXPECT_EQ(behind(work(), outside), "");
  const fs::path result = root_ / "other" / "template" / "0123456789abcdef";
  fs::create_directories(result);
  EXPECT_EQ(place_now(work(), result), result);
}

TEST_F(MadeOf, RemovedResult_IsRecognizedByItsPath) {
  const fs::path gone = work() / "template" / "0123456789abcdef";
  for (const fs::path& input : {gone, gone / "", gone / "garments" / "upper.obj",
                                work() / "scene" / ".." / "template" / "0123456789abcdef"}) {
    EXPECT_EQ(behind(work(), input), "template 0123456789abcdef") << input;
  }
}

}  // namespace
}  // namespace atelier::fixtures
