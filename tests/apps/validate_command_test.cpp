// `atelier validate`: its exit code alone and as a stage, what it refuses.
#ifdef ATELIER_HAS_CAPTURE

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/store/result.h"
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

TEST(ValidateCommand, CaptureErrors_GiveExitCodeThreeAloneAndAsAStage) {
  const TemporaryDirectory folder;
  const SmallCapture small;
  const std::string capture = (folder / "capture").string();
  write_small_capture(capture, small);
  fs::resize_file(folder / "capture" / "images" / small.cameras[1].id / "000003.png", 20);
  const std::string page = (folder / "page.html").string();
  const ChildResult alone = validate({capture, "--html", page});
  EXPECT_EQ(alone.exit_code, 3) << alone.err;
  EXPECT_THAT(alone.out, HasSubstr("error image-damaged [" + small.cameras[1].id + " frame 3]"));
  EXPECT_THAT(alone.out, HasSubstr("the capture cannot be used as it is"));
  EXPECT_TRUE(fs::exists(page));
  const std::string workspace = (folder / "work").string();
  for (const char* time : {"first", "already done"}) {
    EXPECT_EQ(validate({capture, workspace}).exit_code, 3) << time;
    EXPECT_TRUE(fs::exists(fs::path(workspace) / "validate/current/findings.json"));
  }
}

TEST(ValidateCommand, ConsentThatRefuses_IsExplainedAloneAndAsAStage) {
  const TemporaryDirectory folder;
  SmallCapture small;
  small.consent = {{"P. Doe", "research", "2020-01-01"}};
  const std::string capture = (folder / "capture").string();
  const std::string workspace = (folder / "work").string();
  write_small_capture(capture, small);
  EXPECT_THAT(validate({capture}).out,
              ::testing::AllOf(HasSubstr("consent-ended"), HasSubstr("ended with 2020-01-01"),
                               HasSubstr("renew the consent")));
  EXPECT_THAT(validate({capture, "--purpose", "product"}).out, HasSubstr("warning consent-scope"));
  const ChildResult told = run_child({program_path(), "verify", capture});
  const std::string id = told.out.substr(told.out.find("consent: ") + 9, 16);
  const std::string list = (folder / "revoked.txt").string();
  std::ofstream(list) << "# nobody\n";
  EXPECT_THAT(validate({capture, workspace, "--revoked", list}).out, Not(HasSubstr("revoked (")));
  std::ofstream(list) << id << " withdrawn\n";
  for (const std::vector<std::string>& words :
       {std::vector{capture}, std::vector{capture, workspace}}) {  // another list is another result
    std::vector<std::string> all = words;
    all.insert(all.end(), {"--revoked", list});
    const ChildResult revoked = validate(all);
    EXPECT_EQ(revoked.exit_code, 3) << revoked.err;
    EXPECT_THAT(revoked.out + revoked.err,
                ::testing::AllOf(HasSubstr("was revoked (" + id + " in " + list),
                                 HasSubstr("ask for a new one")));
  }
}

TEST(ValidateCommand, NonUtf8Name_IsPrintedAsValidJson) {
  const TemporaryDirectory folder;
  const std::string capture = (folder / "c\xe9").string();
  write_small_capture(capture, SmallCapture());
  const ChildResult result = validate({capture, "--json"});
  EXPECT_NE(result.exit_code, 70) << result.err;
  EXPECT_THAT(result.out, HasSubstr("/c\xEF\xBF\xBD\""));
}

TEST(ValidateCommand, Consent_IsReportedAsItIsNow) {
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

TEST(ValidateCommand, MissingCameraFile_IsReported) {
  const TemporaryDirectory folder;
  write_small_capture((folder / "capture").string(), SmallCapture());
  fs::remove(folder / "capture/cameras.json");
  const ChildResult result = validate({(folder / "capture").string()});
  EXPECT_THAT(result.out, HasSubstr("no cameras.json beside capture.toml"));
}

TEST(ValidateCommand, SymbolicLinks_AreFollowedOrRefusedAsAsked) {
  const TemporaryDirectory folder;
  const fs::path capture = folder / "capture";
  const SmallCapture small;
  write_small_capture(capture.string(), small);
  write_small_capture((folder / "sound").string(), small);
  const fs::path picture = capture / "images" / small.cameras[0].id / "000004.png";
  fs::rename(picture, folder / "elsewhere.png");
  fs::create_symlink(folder / "elsewhere.png", picture);
  const int sound = validate({(folder / "sound").string()}).exit_code;
  for (const std::vector<std::string>& places :
       {std::vector{capture.string()}, {capture.string(), (folder / "work").string()}}) {
    const ChildResult followed = validate(places);
    EXPECT_EQ(followed.exit_code, sound) << followed.out << followed.err;
    EXPECT_THAT(followed.out, Not(HasSubstr("image-broken")));
    std::vector<std::string> strictly = places;
    strictly.insert(strictly.end(), {"--capture.links", "refuse"});
    const ChildResult refused = validate(strictly);
    EXPECT_EQ(refused.exit_code, 3);
    EXPECT_THAT(refused.out + refused.err, HasSubstr(picture.string() + ": a symbolic link to"));
  }
  const ChildResult converted =
      run_child({program_path(), "convert-capture", capture.string(), (folder / "out").string()});
  EXPECT_EQ(converted.exit_code, 0) << converted.err;
  fs::remove(folder / "elsewhere.png");
  const ChildResult broken = validate({capture.string()});
  EXPECT_EQ(broken.exit_code, 3);
  EXPECT_THAT(broken.out, HasSubstr("error symbolic-link [" + picture.string() + "]"));
}

TEST(ValidateCommand, WorkspaceOfAnotherCapture_IsReplacedOnlyWhenAsked) {
  const TemporaryDirectory folder;
  const fs::path first = folder / "first";
  const fs::path second = folder / "second";
  const fs::path work = folder / "work";
  write_small_capture(first, SmallCapture());
  SmallCapture other;
  other.frames = {0, 1, 2};
  other.detections = false;
  write_small_capture(second, other);
  fs::remove_all(second / "labels");
  validate({first.string(), work.string()});
  const std::string before = *current_name(work / "validate");
  for (const char* stage : {"validate", "reconstruct", "track", "animate"}) {
    for (const char* more : {"--force", "--dry-run"}) {
      const ChildResult refused =
          run_child({program_path(), stage, second.string(), work.string(), more});
      EXPECT_EQ(refused.exit_code, 2) << stage;
      EXPECT_THAT(refused.err, HasSubstr("it holds results of another capture, " +
                                         fs::canonical(first).string() + " (validate): "));
      EXPECT_THAT(refused.err, HasSubstr("there that were compared 1 is here; name another folder, "
                                         "or give --replace"));
    }
  }
  const std::vector<std::string> asked = {second.string(), work.string(), "--replace"};
  std::vector<std::string> plan = asked;
  plan.push_back("--dry-run");
  EXPECT_THAT(validate(plan).out, HasSubstr("would be set aside: validate"));
  EXPECT_EQ(*current_name(work / "validate"), before);
  EXPECT_THAT(validate(asked).out,
              HasSubstr("validate: results of " + fs::canonical(first).string() +
                        " are set aside: validate"));
  EXPECT_NE(*current_name(work / "validate"), before);
  EXPECT_TRUE(fs::exists(work / "validate" / before)) << "aside, not gone";
  EXPECT_NE(validate({second.string(), work.string()}).exit_code, 2);
  const ChildResult alone = validate({second.string(), "--replace"});
  EXPECT_EQ(alone.exit_code, 2);
  EXPECT_THAT(alone.err, HasSubstr("--replace goes with INPUT and WORKSPACE"));
}

TEST(ValidateCommand, CaptureThatCannotBeRead_SetsNothingAside) {
  const TemporaryDirectory folder;
  write_small_capture(folder / "first", SmallCapture());
  const std::string work = (folder / "work").string();
  validate({(folder / "first").string(), work});
  const std::string before = *current_name(fs::path(work) / "validate");
  fs::create_directory(folder / "empty");
  fs::create_directory(folder / "wrong");
  std::ofstream(folder / "wrong" / "notes.txt") << "no capture\n";
  write_small_capture(folder / "damaged", SmallCapture());
  std::ofstream(folder / "damaged" / "cameras.json") << "{";
  for (const char* second : {"nothing", "empty", "wrong", "damaged"}) {
    for (const char* stage : {"validate", "reconstruct", "personalize", "animate", "run"}) {
      for (const std::string more : {"--force", "--dry-run"}) {
        if (std::string(second) == "damaged" && more == "--dry-run") {
          continue;  // what a capture's files hold is read by the work itself
        }
        std::vector<std::string> words = {program_path(), stage, (folder / second).string(), work,
                                          "--replace"};
        if (more == "--dry-run" || std::string(stage) != "run") {
          words.emplace_back(more);
        }
        const ChildResult refused = run_child(words);
        EXPECT_EQ(refused.exit_code, 3) << stage << " " << second << ": " << refused.err;
        EXPECT_THAT(refused.out, Not(HasSubstr("set aside")));
        EXPECT_EQ(current_name(fs::path(work) / "validate"), before) << stage << " " << second;
      }
    }
  }
}

TEST(ValidateCommand, StageThatCouldNotGoOn_SetsNothingAside) {
  const TemporaryDirectory folder;
  write_small_capture(folder / "first", SmallCapture());
  SmallCapture other;
  other.frames = {0, 1, 2};
  write_small_capture(folder / "second", other);
  const std::string second = (folder / "second").string();
  const std::string work = (folder / "work").string();
  validate({(folder / "first").string(), work});
  const auto expect_refused = [&](const std::vector<std::string>& words, int code,
                                  const std::string& why) {
    std::vector<std::string> command = {program_path()};
    command.insert(command.end(), words.begin(), words.end());
    const ChildResult refused = run_child(command);
    EXPECT_EQ(refused.exit_code, code) << refused.err;
    EXPECT_THAT(refused.err, HasSubstr(why));
    EXPECT_TRUE(current_name(fs::path(work) / "validate")) << words.front();
  };
  // What it reads is not there, or is another capture's.
  expect_refused({"personalize", second, work, "--replace"}, 3,
                 "no result of this capture, which personalize reads");
  expect_refused({"run", second, work, "--replace", "--from", "track"}, 3, "which track reads");
  expect_refused({"validate", second, work, "--replace", "--capture.sync", "09=1"}, 2,
                 "--capture.sync cannot be '09'");
  expect_refused({"reconstruct", second, work, "--replace", "--frames", "70:80"}, 2,
                 "--frames cannot be '70:80'");
}

TEST(ValidateCommand, CaptureBehindALink_IsNoLinkInside) {
  const TemporaryDirectory folder;
  const fs::path capture = folder / "capture";
  write_small_capture(capture.string(), SmallCapture());
  fs::create_directory_symlink(capture, folder / "link");
  EXPECT_THAT(validate({(folder / "link").string()}).out, Not(HasSubstr("symbolic-link")));
}

TEST(ValidateCommand, DamagedFirstImage_BlamesNoOther) {
  const TemporaryDirectory folder;
  const fs::path capture = folder / "capture";
  const SmallCapture small;
  write_small_capture(capture.string(), small);
  const std::string camera = small.cameras[0].id;
  std::string first;
  for (const auto& entry : fs::directory_iterator(capture / "images" / camera)) {
    const std::string path = entry.path().string();
    first = first.empty() ? path : std::min(first, path);
  }
  fs::resize_file(first, 20);
  const ChildResult result = validate({capture.string()});
  EXPECT_EQ(result.exit_code, 3);
  const std::size_t at = result.out.find("error image-damaged [" + camera + " frame ");
  EXPECT_NE(at, std::string::npos) << result.out;
  EXPECT_THAT(result.out, Not(HasSubstr("frame-size")));
  const std::size_t name = result.out.find(first);
  EXPECT_NE(name, std::string::npos) << result.out;
  EXPECT_EQ(result.out.find(first, name + 1), std::string::npos) << result.out;
}

TEST(ValidateCommand, PageInTheCapture_IsNotWritten) {
  const TemporaryDirectory folder;
  const fs::path capture = folder / "capture";
  write_small_capture(capture.string(), SmallCapture());
  const ChildResult result =
      validate({capture.string(), "--html", (capture / "page.html").string()});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("--html lies in the capture"));
  EXPECT_FALSE(fs::exists(capture / "page.html"));
}

TEST(ValidateCommand, NonCapture_IsRefused) {
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
