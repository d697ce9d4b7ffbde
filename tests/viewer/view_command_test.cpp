// `atelier view`: what a browser shows of a workspace and of a capture, who is served, what is
// refused.

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/exit_code.h"
#include "tests/apps/dressed_workspace.h"
#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"
#include "tests/viewer/look.h"
#include "tests/viewer/page_scene.h"
#include "tests/viewer/server.h"

namespace atelier::fixtures {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

namespace fs = std::filesystem;

class View : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryDirectory;
    SmallCapture small;
    small.frames = {0, 1, 2};
    small.consent = {{"P. Doe", "research", "", "", "", ""}};
    write_small_capture(capture(), small);
    write_dressed_workspace(capture(), workspace());
    made_ = view({workspace().string(), "--out", page().string()});
  }
  static void TearDownTestSuite() { delete folder_; }
  static fs::path capture() { return folder_->path() / "capture"; }
  static fs::path workspace() { return folder_->path() / "a \"<img src=x onerror=alert(1)>'"; }
  static fs::path page() { return folder_->path() / "page"; }
  static std::string file_address(const fs::path& folder) {
    return "file://" + (folder / "index.html").string();
  }
  void SetUp() override { ASSERT_EQ(made_.exit_code, 0) << made_.err; }
  static inline TemporaryDirectory* folder_ = nullptr;
  static inline ChildResult made_ = {};
  TemporaryDirectory own_;
};

TEST_F(View, Workspace_IsDrawnOfflineFromTheDiskWithoutAnError) {
  SKIP_WITHOUT_BROWSER();
  const Looked looked =
      look(file_address(page()),
           {"eval:document.documentElement.dataset.state", kSettled, "eval:" + kCounts, "key:1",
            kSettled, "eval:" + kCounts, "key:2", kSettled, "eval:" + kCounts});
  ASSERT_EQ(looked.values.size(), 4);
  EXPECT_EQ(looked.values[0], "ready");
  EXPECT_GT(looked.values[1]["blue"], 0.02) << "the skirt";
  EXPECT_GT(looked.values[1]["warm"], 0.02) << "the trunk";
  EXPECT_LT(looked.values[2]["warm"], 0.001) << "key 1 hides the body";
  EXPECT_GT(looked.values[2]["blue"], 0.02);
  EXPECT_LT(looked.values[3]["blue"], 0.001) << "key 2 hides the garment";
  EXPECT_THAT(looked.messages, IsEmpty());
  EXPECT_THAT(looked.outside, IsEmpty());
}

TEST_F(View, KeysAlone_LeadThroughFramesCamerasAndViews) {
  SKIP_WITHOUT_BROWSER();
  const std::string frame = "eval:document.documentElement.dataset.frame";
  const std::string focus =
      "eval:[...Array(60)].length && document.activeElement.tagName + '#' + "
      "document.activeElement.id";
  const Looked looked = look(
      file_address(page()),
      {"key:ArrowRight", kSettled, frame, "key:End", kSettled, frame, "key:Home", kSettled, frame,
       "key:c", "eval:atelier.panes[0].through", "key:Escape", "eval:atelier.panes[0].through",
       "key:b", "eval:atelier.isSplit", "key:b", "shift:ArrowLeft",
       "eval:atelier.orbit.azimuth > 0.55", "key: ", "eval:atelier.timeline.playing",
       "key: ", "key:?", "eval:document.getElementById('keys').hidden", "key:Tab", focus,
       // Everything that can be done is a button, a field or the view, and none leaves the order.
       "eval:[...document.querySelectorAll('[onclick],[role=button],[role=tab],button,input,select'"
       ")]"
       ".filter(one => one.tabIndex < 0).length"});
  ASSERT_EQ(looked.values.size(), 11);
  EXPECT_EQ(looked.values[0], "1");
  EXPECT_EQ(looked.values[1], "2");
  EXPECT_EQ(looked.values[2], "0");
  EXPECT_EQ(looked.values[3], 0);
  EXPECT_EQ(looked.values[4], -1);
  EXPECT_EQ(looked.values[5], true);
  EXPECT_EQ(looked.values[6], true) << "turned";
  EXPECT_EQ(looked.values[7], true);
  EXPECT_EQ(looked.values[8], false);
  EXPECT_THAT(looked.values[9], Not(HasSubstr("BODY"))) << "Tab reaches a control";
  EXPECT_EQ(looked.values[10], 0);
  EXPECT_THAT(looked.messages, IsEmpty());
}

TEST_F(View, NamesOfFiles_AreText) {
  SKIP_WITHOUT_BROWSER();
  const Looked looked =
      look(file_address(page()),
           {"eval:document.getElementById('title').textContent", "eval:document.images.length"});
  EXPECT_EQ(looked.values.at(0), workspace().filename().string());
  EXPECT_EQ(looked.values.at(1), 0);
  EXPECT_THAT(looked.messages, IsEmpty());
}

TEST_F(View, Address_RestoresWhatIsSeen) {
  SKIP_WITHOUT_BROWSER();
  const Looked first =
      look(file_address(page()), {"key:End", "key:1", "shift:ArrowLeft", kSettled,
                                  "eval:(atelier.writeAddress(true), location.hash)"});
  const Looked again =
      look(file_address(page()) + first.values.at(0).get<std::string>(),
           {kSettled, "eval:document.documentElement.dataset.frame", "eval:" + kCounts,
            "eval:(atelier.writeAddress(true), location.hash)"});
  EXPECT_EQ(again.values.at(0), "2");
  EXPECT_LT(again.values.at(1)["warm"], 0.001);
  EXPECT_EQ(again.values.at(2), first.values.at(0));
  const Looked odd = look(file_address(page()) + "#view=x,1&panes=9/9/9,a&frame=zz&color=q&light=z",
                          {"eval:document.documentElement.dataset.state"});
  EXPECT_EQ(odd.values.at(0), "ready") << "an address of nonsense shows the page";
  EXPECT_THAT(odd.messages, IsEmpty());
}

TEST_F(View, Camera_ShowsItsImageBehindTheMeshes) {
  SKIP_WITHOUT_BROWSER();
  const Looked looked =
      look(file_address(page()),
           {"key:c", kSettled, "wait:atelier.timelines[0].cameras.canvas.width === 64",
            "eval:[...atelier.timelines[0].cameras.canvas.getContext('2d').getImageData(7, 9, 1, "
            "1).data]",
            "wait:atelier.timelines[0].cameras.agreement",
            "eval:atelier.timelines[0].cameras.agreement.cameras.length"});
  ASSERT_EQ(looked.values.size(), 2);
  EXPECT_EQ(looked.values[0], nlohmann::json({100, 0, 40, 255}));
  EXPECT_EQ(looked.values[1], 3);
  EXPECT_THAT(looked.messages, IsEmpty());
}

TEST_F(View, ImageAndVideo_AreFilesThatOthersRead) {
  SKIP_WITHOUT_BROWSER();
  const std::string image = (own_.path() / "image.png").string();
  const std::string video = (own_.path() / "video.avi").string();
  look(file_address(page()), {"key:i", "took:" + image, "key:v", "took:" + video});
  std::ifstream file(image, std::ios::binary);
  const std::string start{std::istreambuf_iterator<char>(file), {}};
  EXPECT_EQ(start.substr(1, 3), "PNG");
  const ChildResult probed =
      run_child({"ffprobe", "-v", "error", "-count_frames", "-show_entries",
                 "stream=codec_name,r_frame_rate,nb_read_frames", "-of", "csv=p=0", video});
  if (probed.exit_code != -1 && probed.exit_code != 127) {
    EXPECT_THAT(probed.out, HasSubstr("mjpeg,12/1,3")) << probed.err;
  }
}

TEST_F(View, DamagedFrame_IsSaidWhereItIsAndTheOthersAreShown) {
  SKIP_WITHOUT_BROWSER();
  const fs::path copy = own_.path() / "w";
  fs::copy(workspace(), copy, fs::copy_options::recursive | fs::copy_options::copy_symlinks);
  const fs::path frame = copy / "register/current/registered/lower/frames/000001.h5";
  {
    std::fstream file(frame, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(-40, std::ios::end);
    file << "damage";
  }
  const fs::path out = own_.path() / "page";
  ASSERT_EQ(view({copy.string(), "--out", out.string()}).exit_code, 0);
  const Looked looked =
      look(file_address(out), {kSettled, "eval:" + kCounts, "key:ArrowRight", kSettled,
                               "eval:document.getElementById('message').textContent",
                               "eval:" + kCounts, "key:ArrowRight", kSettled, "eval:" + kCounts});
  ASSERT_EQ(looked.values.size(), 4);
  EXPECT_GT(looked.values[0]["blue"], 0.02);
  EXPECT_THAT(looked.values[1].get<std::string>(),
              AllOf(HasSubstr("lower: frame 1 cannot be read"), HasSubstr("000001.h5")));
  EXPECT_LT(looked.values[2]["blue"], 0.001);
  EXPECT_GT(looked.values[3]["blue"], 0.02);
}

TEST_F(View, DamagedFileOfAPage_IsSaid) {
  SKIP_WITHOUT_BROWSER();
  const fs::path copy = own_.path() / "page";
  fs::copy(page(), copy, fs::copy_options::recursive);
  for (const auto& entry : fs::recursive_directory_iterator(copy / "data")) {
    if (entry.path().filename() == "0.js") {
      fs::resize_file(entry.path(), fs::file_size(entry.path()) / 2);
    }
  }
  const Looked looked =
      look(file_address(copy), {"wait:!atelier.loading",  // nothing waits for it for ever
                                "eval:document.documentElement.dataset.state",
                                "eval:document.getElementById('message').textContent"});
  ASSERT_EQ(looked.values.size(), 2);
  EXPECT_EQ(looked.values[0], "failed");
  EXPECT_THAT(looked.values[1].get<std::string>(), HasSubstr("0.js is damaged"));
}

TEST_F(View, TwoPlaces_AreShownBesideEachOther) {
  SKIP_WITHOUT_BROWSER();
  const fs::path out = own_.path() / "page";
  const fs::path registered = workspace() / "register/current/registered/lower";
  ASSERT_EQ(view({workspace().string(), "--beside", registered.string(), "--out", out.string()})
                .exit_code,
            0);
  const Looked looked = look(file_address(out),
                             {"key:ArrowRight", kSettled, "eval:atelier.drawnPanes.length",
                              "eval:atelier.timelines[1].layers[0].shownFrame", "eval:" + kCounts});
  EXPECT_EQ(looked.values.at(0), 2);
  EXPECT_EQ(looked.values.at(1), 1);
  EXPECT_GT(looked.values.at(2)["blue"], 0.02);
  EXPECT_THAT(looked.messages, IsEmpty());
}

/// The files of a page, which are their owner's alone and name no folder of the machine.
void expect_private(const fs::path& page, const fs::path& machine) {
  for (const auto& entry : fs::recursive_directory_iterator(page)) {
    EXPECT_EQ(entry.status().permissions() & (fs::perms::group_all | fs::perms::others_all),
              fs::perms::none)
        << entry.path();
    if (entry.is_regular_file() && entry.path().filename() != "three.js") {
      std::ifstream file(entry.path());
      const std::string text{std::istreambuf_iterator<char>(file), {}};
      EXPECT_EQ(text.find(machine.string()), std::string::npos) << entry.path();
    }
  }
}

TEST_F(View, Page_HoldsNoPlaceOfTheMachineAndIsItsOwnersAlone) {
  expect_private(page(), folder_->path());
  const fs::path damaged = folder_->path() / "damaged workspace";
  fs::copy(workspace(), damaged, fs::copy_options::recursive | fs::copy_options::copy_symlinks);
  fs::resize_file(damaged / "register/current/registered/lower/frames/000001.h5", 100);
  fs::remove(damaged / "body/current/frames/000002.h5");
  const fs::path out = own_.path() / "page";
  ASSERT_EQ(view({damaged.string(), "--out", out.string()}).exit_code, 0);
  expect_private(out, folder_->path());
  std::ifstream file(out / "scene.js");
  const std::string scene{std::istreambuf_iterator<char>(file), {}};
  EXPECT_THAT(scene, AllOf(HasSubstr("output-size [register/"), HasSubstr("000001.h5")));
  EXPECT_THAT(scene, HasSubstr("output-missing [body/"));
}

TEST_F(View, Server_GivesThePageToWhoeverHasItsTokenAlone) {
  const Server server(workspace(), own_.path() / "log");
  ASSERT_THAT(server.address(), HasSubstr("http://127.0.0.1:"));
  EXPECT_EQ(server.path().size(), 34) << "32 digits between slashes";
  const std::string index = server.get(server.path());
  EXPECT_THAT(index, AllOf(HasSubstr("HTTP/1.1 200"), HasSubstr("<!doctype html>"),
                           HasSubstr("Content-Security-Policy: default-src 'none'"),
                           HasSubstr("Referrer-Policy: no-referrer")));
  EXPECT_THAT(server.get(server.path() + "data/0/0/0.js"), HasSubstr("atelierData("));
  std::string wrong = server.path();
  wrong[5] = wrong[5] == '0' ? '1' : '0';
  for (const std::string& path :
       {std::string("/"), std::string("/index.html"), wrong, wrong + "scene.js",
        server.path() + "../../etc/passwd", server.path() + "%2e%2e/%2e%2e/etc/passwd",
        server.path() + "nothing.js", server.path().substr(0, 33)}) {
    EXPECT_THAT(server.get(path), AllOf(HasSubstr("HTTP/1.1 404"), Not(HasSubstr("root:"))))
        << path;
  }
  EXPECT_THAT(server.get(server.path(), "", "evil.example"), HasSubstr("HTTP/1.1 404"))
      << "another name that leads here";
  const std::string part = server.get(server.path() + "viewer.js", "Range: bytes=1-10\r\n");
  EXPECT_THAT(part, AllOf(HasSubstr("HTTP/1.1 206"), HasSubstr("Content-Length: 10\r\n")));
  const std::string beyond = server.get(server.path() + "viewer.js", "Range: bytes=99999999-\r\n");
  EXPECT_THAT(beyond, AllOf(HasSubstr("HTTP/1.1 416"), HasSubstr("Content-Range: bytes */")));
}

TEST_F(View, Server_IsSeenByABrowserAsTheFilesAre) {
  SKIP_WITHOUT_BROWSER();
  const Server server(workspace(), own_.path() / "log");
  const Looked looked = look(server.address(), {kSettled, "eval:" + kCounts});
  EXPECT_GT(looked.values.at(0)["blue"], 0.02);
  EXPECT_THAT(looked.messages, IsEmpty());
  EXPECT_THAT(looked.outside, IsEmpty());
}

TEST_F(View, WhatCannotBeShown_IsRefusedWithAHint) {
  const fs::path empty = own_.path() / "empty";
  fs::create_directory(empty);
  std::ofstream(own_.path() / "notes.txt") << "x";
  std::ofstream(own_.path() / "point.obj") << "v 0 0 0\n";
  const auto refused = [&](const fs::path& place) {
    const ChildResult result = view({place.string(), "--out", (own_.path() / "p").string()});
    EXPECT_EQ(result.exit_code, kExitBadData) << place << result.out;
    EXPECT_FALSE(fs::exists(own_.path() / "p"));
    return result.err;
  };
  EXPECT_THAT(refused(own_.path() / "nowhere"), HasSubstr("nothing is there"));
  EXPECT_THAT(refused(empty), HasSubstr("an empty folder"));
  EXPECT_THAT(refused(own_.path() / "notes.txt"), HasSubstr("a workspace, a capture"));
  EXPECT_THAT(refused(own_.path() / "point.obj"), HasSubstr("no faces"));
  EXPECT_THAT(refused(workspace() / "track/"),
              AllOf(HasSubstr("stage track"), HasSubstr("atelier view ")));
  EXPECT_EQ(view({}).exit_code, kExitUsage);
  EXPECT_EQ(view({workspace().string(), "--out", page().string()}).exit_code, kExitUsage)
      << "the folder is there";
  EXPECT_EQ(view({workspace().string(), "--out", (own_.path() / "p").string(), "--port", "9000"})
                .exit_code,
            kExitUsage);
}

TEST_F(View, StageFolder_IsAnsweredWithTheWorkspace) {
  const ChildResult result =
      view({(workspace() / "body").string(), "--out", (own_.path() / "p").string()});
  EXPECT_EQ(result.exit_code, kExitBadData);
  EXPECT_THAT(result.err,
              AllOf(HasSubstr("stage body of a workspace"), HasSubstr("atelier view ")));
}

TEST_F(View, ResultOfAStage_IsNamedByTheStageAndShownOnce) {
  const fs::path out = own_.path() / "p";
  ASSERT_EQ(view({(workspace() / "body/current").string(), "--out", out.string()}).exit_code, 0);
  EXPECT_EQ(layers_of(out), "body: body ");
  // Beside it lies a result that is no longer current; the folder around the workspace has both.
  const fs::path around = own_.path() / "around";
  fs::create_directories(around / "w");
  fs::copy(workspace() / "body", around / "w/body",
           fs::copy_options::recursive | fs::copy_options::copy_symlinks);
  fs::copy(fs::canonical(workspace() / "body/current"), around / "w/body/0000000000000000",
           fs::copy_options::recursive);
  const fs::path whole = own_.path() / "whole";
  ASSERT_EQ(view({around.string(), "--out", whole.string()}).exit_code, 0);
  EXPECT_EQ(layers_of(whole), "body: body ");
}

TEST_F(View, OutIsRefused_InWhatIsShownOnEitherSide) {
  const auto refused = [&](const std::vector<std::string>& arguments) {
    const ChildResult result = view(arguments);
    EXPECT_EQ(result.exit_code, kExitUsage) << result.out;
    return result.err;
  };
  const std::string in_results = (workspace() / "track/page").string();
  const std::string in_capture = (capture() / "page").string();
  EXPECT_THAT(refused({capture().string(), "--beside", workspace().string(), "--out", in_results}),
              HasSubstr("the results of 'track'"));
  EXPECT_THAT(refused({capture().string(), "--out", in_capture}), HasSubstr("lies in the capture"));
  EXPECT_THAT(refused({workspace().string(), "--beside", capture().string(), "--out", in_capture}),
              HasSubstr("lies in the capture"));
  const fs::path lower = workspace() / "register/current/registered/lower";
  EXPECT_THAT(refused({lower.string(), "--out", (lower / "page").string()}),
              HasSubstr("lies in the sequence"));
  EXPECT_FALSE(fs::exists(in_results));
  EXPECT_FALSE(fs::exists(in_capture));
}

TEST_F(View, WhatExportWrites_IsOpened) {
  for (const std::string format : {"h5", "usda", "ply", "obj"}) {
    const fs::path place = own_.path() / format;
    const ChildResult made =
        run_child({program_path(), "export", workspace().string(), place.string(), "--stage",
                   "register", "--format", format, "--purpose", "research"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    const fs::path folder = place / "register/registered/lower";
    const fs::path out = own_.path() / ("page_" + format);
    const bool one_file = format == "h5" || format == "usda";
    const ChildResult viewed =
        view({one_file ? folder.string() + "." + format : folder.string(), "--out", out.string()});
    ASSERT_EQ(viewed.exit_code, 0) << format << viewed.err << made.out;
    EXPECT_EQ(layers_of(out), "lower: garment ") << format;
    EXPECT_EQ(page_scene(out)["timelines"][0]["frames"], nlohmann::json({0, 1, 2})) << format;
    const ChildResult whole = view({place.string(), "--out", (own_.path() / "w").string()});
    EXPECT_EQ(whole.exit_code, kExitBadData);
    EXPECT_THAT(whole.err, HasSubstr("atelier view " + folder.string())) << "a place in it";
  }
}

TEST_F(View, CaptureThatIsGone_IsSaidOnceWithAdvice) {
  const fs::path gone = own_.path() / "capture";
  fs::copy(capture(), gone, fs::copy_options::recursive);
  write_dressed_workspace(gone, own_.path() / "w");
  fs::rename(gone, own_.path() / "elsewhere");
  const ChildResult result =
      view({(own_.path() / "w").string(), "--out", (own_.path() / "p").string()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const std::size_t first = result.out.find("cannot be shown");
  ASSERT_NE(first, std::string::npos) << result.out;
  EXPECT_EQ(result.out.find("cannot be shown", first + 1), std::string::npos) << result.out;
  EXPECT_THAT(result.out, HasSubstr("if the capture was moved, move it back"));
}

TEST_F(View, EmptyPlaces_AreRefused) {
  const ChildResult out = view({workspace().string(), "--out", ""});
  EXPECT_EQ(out.exit_code, kExitUsage);
  EXPECT_THAT(out.err, HasSubstr("--out is empty"));
  const ChildResult beside =
      view({workspace().string(), "--beside", "", "--out", (own_.path() / "p").string()});
  EXPECT_EQ(beside.exit_code, kExitUsage);
  EXPECT_THAT(beside.err, HasSubstr("--beside is empty"));
}

TEST_F(View, SealedWorkspace_HasTheNameOfItsFile) {
  const std::string key = (own_.path() / "one").string();
  const std::string sealed = (own_.path() / "walk.sealed").string();
  const ChildResult made = run_child({program_path(), "key", "--out", key});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const ChildResult closed = run_child({program_path(), "seal", workspace().string(), "--to",
                                        made.out.substr(0, made.out.find('\n')), "--out", sealed});
  ASSERT_EQ(closed.exit_code, 0) << closed.err;
  const ChildResult shown =
      view({sealed, "--identity", key, "--out", (own_.path() / "page").string()});
  ASSERT_EQ(shown.exit_code, 0) << shown.err;
  EXPECT_EQ(page_scene(own_.path() / "page").at("title"), "walk.sealed");
  const ChildResult beside = view({workspace().string(), "--beside", sealed});
  EXPECT_EQ(beside.exit_code, kExitUsage);
  EXPECT_THAT(beside.err, HasSubstr("name the sealed one first"));
}

TEST_F(View, EndedConsent_RefusesThePage) {
  const fs::path ended = own_.path() / "capture";
  SmallCapture small;
  small.consent = {{"P. Doe", "research", "2020-01-01", "", "", ""}};
  write_small_capture(ended, small);
  const ChildResult result = view({ended.string(), "--out", (own_.path() / "p").string()});
  EXPECT_NE(result.exit_code, 0);
  EXPECT_THAT(result.err, HasSubstr("2020-01-01"));
  EXPECT_FALSE(fs::exists(own_.path() / "p"));
  const ChildResult other =
      view({capture().string(), "--out", (own_.path() / "p").string(), "--purpose", "product"});
  EXPECT_NE(other.exit_code, 0) << "research is agreed to, and nothing else";
}

TEST_F(View, HeldOutCamera_IsThereWithoutItsImages) {
  const fs::path held = own_.path() / "capture";
  fs::copy(capture(), held, fs::copy_options::recursive);
  CaptureInfo info = read_capture_info(held);
  const std::string id = SmallCapture().cameras[1].id;
  info.held_out_cameras = {id};
  fs::remove(held / "capture.toml");
  write_file_atomically(held / "capture.toml", capture_toml(info));
  ASSERT_EQ(view({held.string(), "--out", (own_.path() / "p").string()}).exit_code, 0);
  std::ifstream file(own_.path() / "p/data/0/capture/1/0.js");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  EXPECT_THAT(text, AllOf(HasSubstr("keypoints"), Not(HasSubstr("image"))));
  EXPECT_THAT(text, Not(HasSubstr("labels")));
}

}  // namespace
}  // namespace atelier::fixtures
