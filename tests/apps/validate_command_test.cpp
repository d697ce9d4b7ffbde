// `atelier validate`: its exit code alone and as a stage, what it refuses.
#ifdef ATELIER_HAS_CAPTURE

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/capture/small_capture.h"
#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

ChildResult validate(const std::vector<std::string>& arguments) {
  std::vector<std::string> command = {program_path(), "validate"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return run_child(command);
}

TEST(ValidateCommand, ExitsWithThreeOnErrorsAloneAndAsAStage) {
  const TemporaryDirectory folder;
  const SmallCapture small;
  const std::string capture = (folder / "capture").string();
  write_small_capture(capture, small);
  fs::resize_file(folder / "capture" / "images" / small.cameras[1].id / "000003.png", 20);
  const std::string page = (folder / "page.html").string();
  const ChildResult alone = validate({capture, "--html", page});
  EXPECT_EQ(alone.exit_code, 3) << alone.err;
  EXPECT_THAT(alone.out, HasSubstr("error image-damaged [" + small.cameras[1].id + " frame 3]"));
  EXPECT_THAT(alone.out, HasSubstr("it cannot be used as it is"));
  EXPECT_TRUE(fs::exists(page));
  const std::string workspace = (folder / "work").string();
  for (const char* time : {"first", "already done"}) {
    EXPECT_EQ(validate({capture, workspace}).exit_code, 3) << time;
    EXPECT_TRUE(fs::exists(fs::path(workspace) / "validate/current/findings.json"));
  }
}

TEST(ValidateCommand, PrintsJsonOfANameThatIsNoUtf8) {
  const TemporaryDirectory folder;
  const std::string capture = (folder / "c\xe9").string();
  write_small_capture(capture, SmallCapture());
  const ChildResult result = validate({capture, "--json"});
  EXPECT_NE(result.exit_code, 70) << result.err;
  EXPECT_THAT(result.out, HasSubstr("/c\xEF\xBF\xBD\""));
}

TEST(ValidateCommand, TellsOfConsentAsItIsNow) {
  const TemporaryDirectory folder;
  write_small_capture((folder / "capture").string(), SmallCapture());
  const auto findings = [&] {
    validate({(folder / "capture").string(), (folder / "work").string()});
    std::ifstream file(folder / "work/validate/current/findings.json");
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  const std::string before = findings();
  std::ofstream(folder / "capture/capture.toml", std::ios::app)
      << "\n[[consent]]\nwho = 'P. Doe'\nscope = 'new research'\n";
  EXPECT_THAT(before, Not(HasSubstr("new research")));
  EXPECT_THAT(findings(), HasSubstr("P. Doe, new research"));
}

TEST(ValidateCommand, SaysThatCamerasAreMissingBesideTheDescription) {
  const TemporaryDirectory folder;
  write_small_capture((folder / "capture").string(), SmallCapture());
  fs::remove(folder / "capture/cameras.json");
  const ChildResult result = validate({(folder / "capture").string()});
  EXPECT_THAT(result.out, HasSubstr("no cameras.json beside capture.toml"));
}

TEST(ValidateCommand, RefusesWhatIsNoCapture) {
  const TemporaryDirectory folder;
  const ChildResult nothing = validate({(folder / "nothing").string()});
  EXPECT_EQ(nothing.exit_code, 3);
  EXPECT_THAT(nothing.err, HasSubstr("nothing is there; expected a folder of a capture"));
  fs::create_directory(folder / "empty");
  const ChildResult empty = validate({(folder / "empty").string()});
  EXPECT_EQ(empty.exit_code, 3);
  EXPECT_THAT(empty.err, HasSubstr("easymocap"));  // the layouts that were tried
  std::ofstream(folder / "text.toml") << "no = 'calibration'";
  EXPECT_EQ(validate({(folder / "text.toml").string()}).exit_code, 3);
  EXPECT_EQ(validate({(folder / "empty").string(), "--capture.layout", "mine"}).exit_code, 2);
  EXPECT_EQ(validate({}).exit_code, 2);
}

}  // namespace
}  // namespace atelier::fixtures

#endif
