// How the page of `atelier view` is used: time, keys, views beside each other, addresses, names.

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/io/mesh_file.h"
#include "core/sequence_archive.h"
#include "tests/apps/dressed_workspace.h"
#include "tests/support/temporary_directory.h"
#include "tests/viewer/look.h"

namespace atelier::fixtures {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

namespace fs = std::filesystem;

class ViewControl : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryDirectory;
    write_dressed_workspace(folder_->path() / "capture", workspace());
    made_ = view({workspace().string(), "--out", (folder_->path() / "page").string()});
  }
  static void TearDownTestSuite() { delete folder_; }
  static fs::path workspace() { return folder_->path() / "workspace"; }
  static std::string page() { return "file://" + (folder_->path() / "page/index.html").string(); }
  void SetUp() override { ASSERT_EQ(made_.exit_code, 0) << made_.err; }
  static inline TemporaryDirectory* folder_ = nullptr;
  static inline ChildResult made_ = {};
  TemporaryDirectory own_;
};

const std::string kShownFrame = "eval:document.documentElement.dataset.frame";
const std::string kIsPlaying = "eval:atelier.timeline.playing";

TEST_F(ViewControl, Timeline_PlaysAtItsRateAndLoops) {
  SKIP_WITHOUT_BROWSER();
  // Twelve frames a second: which frame is due at which time, of a clock that the test has.
  const std::string due =
      "eval:(() => { const one = atelier.timeline; one.setPlaying(true); const begin = 5000; "
      "const frames = [0, 83, 84, 166, 167, 249, 251, 300, 334, 336].map(ms => one.index = "
      "one.due(begin + ms)); one.setPlaying(false); one.index = 0; return frames; })()";
  const std::string ends =
      "eval:(() => { const one = atelier.timeline; one.setPlaying(true); one.due(5000); const "
      "frame = one.due(5251); const left = one.playing; one.setPlaying(false); one.index = 0; "
      "return [frame, left]; })()";
  const Looked looked =
      look(page(), {kSettled, due, "key:r", ends, "key:r",
                    "key: ", "wait:document.documentElement.dataset.frame === '2'",
                    "wait:document.documentElement.dataset.frame === '0'", "key: ", kIsPlaying});
  ASSERT_EQ(looked.values.size(), 3) << looked.messages;
  EXPECT_EQ(looked.values[0], nlohmann::json({0, 0, 1, 1, 2, 2, 0, 0, 0, 1}));
  EXPECT_EQ(looked.values[1], nlohmann::json({2, false})) << "without the loop it ends";
  EXPECT_EQ(looked.values[2], false);
  EXPECT_THAT(looked.messages, IsEmpty());
}

/// The skirt, standing still, in frames of a rate.
void write_still(const fs::path& folder, double fps, const std::vector<int>& frame_ids) {
  Sequence skirt;
  skirt.fps = fps;
  skirt.frame_ids = frame_ids;
  skirt.faces = tube_skirt().mesh.faces;
  skirt.load = [](Index /*frame*/) { return tube_skirt().mesh; };
  write_sequence(folder, skirt);
}

TEST_F(ViewControl, SequencesOfTwoRates_ShowTheFramesThatAreDue) {
  SKIP_WITHOUT_BROWSER();
  write_still(own_.path() / "two/body", 30, {0, 1, 2, 3, 4, 5});
  write_still(own_.path() / "two/dress", 12, {0, 1, 2, 3});
  const fs::path out = own_.path() / "page";
  ASSERT_EQ(view({(own_.path() / "two").string(), "--out", out.string()}).exit_code, 0);
  const std::string shown =
      "eval:(async () => { const all = []; for (let i = 0; i < atelier.timeline.frames.length; "
      "++i) { await atelier.go(i); all.push(atelier.now.layers.map(layer => layer.shownFrame)); } "
      "return all; })()";
  const Looked looked = look("file://" + (out / "index.html").string(),
                             {kSettled, "eval:document.getElementById('layers').textContent", shown,
                              "eval:document.getElementById('time').textContent"});
  ASSERT_EQ(looked.values.size(), 3) << looked.messages;
  EXPECT_THAT(looked.values[0].get<std::string>(),
              AllOf(HasSubstr("body  30 fps"), HasSubstr("dress  12 fps")));
  EXPECT_EQ(looked.values[1],
            nlohmann::json::parse("[[0, 0], [1, 0], [2, 0], [3, 1], [4, 1], [5, 2], [null, 2], "
                                  "[null, 2], [null, 3], [null, 3]]"));
  EXPECT_EQ(looked.values[2], "0.30 s of 0.30");
  EXPECT_THAT(looked.messages, IsEmpty());
}

TEST_F(ViewControl, Takes_ArePlayedAtRatesOfTheirOwnAndSaidOnTheTimeline) {
  SKIP_WITHOUT_BROWSER();
  write_still(own_.path() / "two/minimal", 0.5, {0, 1});
  write_still(own_.path() / "two/clothed", 12, {10, 11, 12});
  const fs::path out = own_.path() / "page";
  const fs::path video = own_.path() / "video.avi";
  ASSERT_EQ(view({(own_.path() / "two").string(), "--out", out.string()}).exit_code, 0);
  const std::string due =
      "eval:(() => { const one = atelier.timeline; one.setPlaying(true); const times = [0, 1999, "
      "2001, 3999, 4001, 4080, 4084, 4167, 4249, 4251].map(ms => one.index = one.due(5000 + ms)); "
      "one.setPlaying(false); one.index = 0; return times; })()";
  const std::string second =
      "(() => { const box = document.querySelectorAll('#takes button')[1].getBoundingClientRect(); "
      "return [box.x + 5, box.y + 5]; })()";
  const Looked looked = look(
      "file://" + (out / "index.html").string(),
      {kSettled, due,
       "eval:[...document.querySelectorAll('#takes button')].map(one => "
       "one.textContent)",
       "click:" + second, kSettled, kShownFrame, "eval:document.getElementById('time').textContent",
       "key:v", "took:" + video.string(), "eval:document.documentElement.dataset.saved",
       // Frames of two takes are not beside each other for what finds torn ones.
       "eval:(() => { const layer = atelier.now.layers[0]; return new layer.constructor("
       "{...layer.info, frames: [0, 1, 10, 11, 12]}, 0, 0, frame => frame < 10).runs.map("
       "({first, end}) => [first, end]); })()"});
  ASSERT_EQ(looked.values.size(), 6) << looked.messages;
  EXPECT_EQ(looked.values[0], nlohmann::json({0, 0, 1, 1, 2, 2, 3, 4, 4, 0}));
  EXPECT_EQ(looked.values[1], nlohmann::json({"minimal, 0.5 fps", "clothed, 12 fps"}));
  EXPECT_EQ(looked.values[2], "10");
  EXPECT_EQ(looked.values[3], "4.00 s of 4.17, clothed, 12 fps");
  EXPECT_EQ(looked.values[4], "51") << "4 s and 3 frames, 12 a second";
  EXPECT_EQ(looked.values[5], nlohmann::json::parse("[[0, 2], [2, 5]]"));
  EXPECT_THAT(looked.messages, IsEmpty());
}

TEST_F(ViewControl, Scrubbing_ShowsTheFrameAndKeysGoOnFromThere) {
  SKIP_WITHOUT_BROWSER();
  const std::string last =
      "(() => { const box = document.getElementById('scrub').getBoundingClientRect(); return "
      "[box.right - 3, box.y + box.height / 2]; })()";
  const Looked looked =
      look(page(), {kSettled, "click:" + last, kSettled, kShownFrame,
                    "eval:document.activeElement.id", "key:ArrowLeft", kSettled, kShownFrame,
                    "key: ", kIsPlaying, "key: ", kIsPlaying, "key:Home", kSettled, kShownFrame});
  ASSERT_EQ(looked.values.size(), 6) << looked.messages;
  EXPECT_EQ(looked.values[0], "2");
  EXPECT_EQ(looked.values[1], "scrub");
  EXPECT_EQ(looked.values[2], "1");
  EXPECT_EQ(looked.values[3], true) << "Space plays from the slider, too";
  EXPECT_EQ(looked.values[4], false);
  EXPECT_EQ(looked.values[5], "0");
  EXPECT_THAT(looked.messages, IsEmpty());
}

TEST_F(ViewControl, WhatHasTheFocus_TakesItsOwnKeysAndKeepsTheFocus) {
  SKIP_WITHOUT_BROWSER();
  const std::string focus = "eval:document.activeElement.textContent.trim()";
  const Looked looked =
      look(page(), {kSettled, "wait:(document.getElementById('layer0').focus(), true)", "key: ",
                    "eval:[document.getElementById('layer0').checked, atelier.timeline.playing]",
                    "wait:(document.querySelectorAll('.cameras button')[1].focus(), true)",
                    "key:Enter", kSettled, "eval:atelier.now.cameras.selected", focus,
                    "wait:(document.getElementById('through').focus(), true)", "key:Enter",
                    kSettled, "eval:[atelier.panes[0].through, document.activeElement.id]",
                    "wait:(document.getElementById('frame').focus(), true)", "key:End", kShownFrame,
                    "key:Escape", "eval:atelier.panes[0].through"});
  ASSERT_EQ(looked.values.size(), 6) << looked.messages;
  EXPECT_EQ(looked.values[0], nlohmann::json({false, false})) << "the box, and nothing plays";
  EXPECT_EQ(looked.values[1], 1);
  EXPECT_EQ(looked.values[2], SmallCapture().cameras[1].id) << "of the button, drawn anew";
  EXPECT_EQ(looked.values[3], nlohmann::json({1, "through"}));
  EXPECT_EQ(looked.values[4], "0") << "End is the text's";
  EXPECT_EQ(looked.values[5], -1);
  EXPECT_THAT(looked.messages, IsEmpty());
}

TEST_F(ViewControl, ViewsBesideEachOther_HaveOneCameraAndLayersOfTheirOwn) {
  SKIP_WITHOUT_BROWSER();
  const fs::path out = own_.path() / "page";
  ASSERT_EQ(view({workspace().string(), "--beside", workspace().string(), "--out", out.string()})
                .exit_code,
            0);
  const std::string left = share("b > r + 25 && x < 0.5");
  const std::string right = share("b > r + 25 && x >= 0.5");
  const std::string through = "eval:atelier.drawnPanes.map(one => one.through?.camera.id)";
  const std::string right_view =
      "(() => { const box = document.getElementById('view').getBoundingClientRect(); return "
      "[box.x + 0.9 * box.width, box.y + 0.9 * box.height]; })()";
  const Looked looked = look("file://" + (out / "index.html").string(),
                             {kSettled,
                              left,
                              right,
                              "shift:ArrowLeft",
                              "key:+",
                              kSettled,
                              left,
                              right,
                              "key:c",
                              kSettled,
                              through,
                              "key:Escape",
                              kSettled,
                              through,
                              "key:p",
                              kSettled,
                              "eval:[atelier.active, atelier.now.number]",
                              "key:2",
                              kSettled,
                              left,
                              right,
                              "key:p",
                              "click:" + right_view,
                              kSettled,
                              "eval:atelier.active",
                              "key:ArrowRight",
                              kSettled,
                              "eval:atelier.timelines.map(one => one.layers[0].shownFrame)",
                              "eval:(atelier.writeAddress(true), location.hash)"});
  ASSERT_EQ(looked.values.size(), 12) << looked.messages;
  const auto value = [&](std::size_t i) { return looked.values[i].get<double>(); };
  EXPECT_GT(value(0), 0.01);
  EXPECT_NEAR(value(1), value(0), 0.02 * value(0));
  EXPECT_GT(value(2), 1.05 * value(0)) << "nearer";
  EXPECT_NEAR(value(3), value(2), 0.02 * value(2)) << "in both";
  EXPECT_EQ(looked.values[4],
            nlohmann::json({SmallCapture().cameras[0].id, SmallCapture().cameras[0].id}));
  EXPECT_EQ(looked.values[5], nlohmann::json({nullptr, nullptr}));
  EXPECT_EQ(looked.values[6], nlohmann::json({1, 1})) << "P";
  EXPECT_GT(value(7), 0.01);
  EXPECT_LT(value(8), 0.0005) << "2 hides the garment on the right alone";
  EXPECT_EQ(looked.values[9], 1) << "by a click";
  EXPECT_EQ(looked.values[10], nlohmann::json({1, 1})) << "one time for both";
  const Looked again =
      look("file://" + (out / "index.html").string() + looked.values[11].get<std::string>(),
           {kSettled, "eval:[atelier.active, atelier.isSplit]", right});
  EXPECT_EQ(again.values.at(0), nlohmann::json({1, true}));
  EXPECT_LT(again.values.at(1), 0.0005);
  EXPECT_THAT(looked.messages, IsEmpty());
}

/// A workspace of the skirt simulated on the trunk by one of the solvers.
fs::path simulated_by(const std::string& solver, const fs::path& root) {
  const fs::path scene = root / "scene";
  if (!fs::exists(scene)) {
    fs::create_directory(scene);
    write_mesh(scene / "garment.obj", tube_skirt().mesh);
    write_mesh(scene / "body.obj", trunk_body().mesh);
  }
  const fs::path workspace = root / solver;
  const ChildResult result =
      run_child({program_path(), "simulate", scene.string(), workspace.string(), "--length", "4",
                 "--settle", "0", "--pin-top", "0.02", "--solver", solver});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return workspace;
}

TEST_F(ViewControl, TwoSimulators_AreShownBesideEachOtherWithTheirStrain) {
  SKIP_WITHOUT_BROWSER();
  const fs::path out = own_.path() / "page";
  ASSERT_EQ(view({simulated_by("xpbd", own_.path()).string(), "--beside",
                  simulated_by("projective-friction", own_.path()).string(), "--out", out.string()})
                .exit_code,
            0);
  const std::string colour =
      "wait:(() => { const one = document.querySelector('[aria-label^=\"Colour of\"]'); one.value "
      "= "
      "'strain'; one.dispatchEvent(new Event('change')); return true; })()";
  const Looked looked =
      look("file://" + (out / "index.html").string(),
           {kSettled, share("b > r + 25 && x < 0.5"), share("b > r + 25 && x >= 0.5"),
            share("r > b + 25 && x < 0.5"), "key:End", kSettled,
            "eval:atelier.timelines.map(one => one.layers.map(layer => layer.shownFrame))",
            "eval:atelier.timelines.map(one => one.info.name)", colour, kSettled,
            "eval:document.getElementById('legend').textContent",
            "eval:[...document.getElementById('series').options].some(one => "
            "one.textContent.includes('kinetic energy'))",
            "wait:atelier.now.surveyed",
            "eval:atelier.now.info.marks.filter(mark => mark.text.includes('torn')).map(mark => "
            "mark.text)"});
  ASSERT_EQ(looked.values.size(), 8) << looked.messages;
  EXPECT_GT(looked.values[0], 0.005) << "the skirt of the one";
  EXPECT_GT(looked.values[1], 0.005) << "and of the other";
  EXPECT_GT(looked.values[2], 0.005) << "on its body";
  EXPECT_EQ(looked.values[3], nlohmann::json({{3, 3}, {3, 3}}));
  EXPECT_EQ(looked.values[4],
            nlohmann::json({"xpbd: Simulation", "projective-friction: Simulation"}));
  EXPECT_THAT(looked.values[5].get<std::string>(),
              AllOf(HasSubstr("strain"), HasSubstr("10 % and more")));
  EXPECT_EQ(looked.values[6], true);
  EXPECT_EQ(looked.values[7], nlohmann::json::array()) << "four sound frames";
  EXPECT_THAT(looked.messages, IsEmpty());
}

TEST_F(ViewControl, Address_HoldsWhatLiesOverImagesAndWhichFigureIsChosen) {
  SKIP_WITHOUT_BROWSER();
  const std::string state =
      "eval:(() => { const one = atelier.now.cameras; return [one.selected, one.overlays, "
      "one.showFrusta, one.showSkeleton, atelier.opacity, atelier.timeline.looping, "
      "atelier.timeline.chosen, document.getElementById('series').selectedOptions[0].textContent]; "
      "})()";
  const Looked first = look(
      page(),
      {kSettled, "wait:atelier.now.surveyed && atelier.now.cameras.agreement", "key:r", "key:c",
       "key:Escape", "wait:(document.querySelector('#side-body .toggles input').click(), true)",
       "wait:(document.getElementById('toggle-cameras').click(), true)",
       "wait:(() => { const one = document.getElementById('opacity'); one.value = 30; "
       "one.dispatchEvent(new Event('input')); return true; })()",
       "wait:(() => { const one = document.getElementById('series'); one.value = "
       "one.options.length - 1; one.dispatchEvent(new Event('change')); return true; })()",
       kSettled, state, "eval:(atelier.writeAddress(true), location.hash)"});
  ASSERT_EQ(first.values.size(), 2) << first.messages;
  EXPECT_EQ(first.values[0][0], 0);
  EXPECT_EQ(first.values[0][1]["keypoints"], false);
  EXPECT_EQ(first.values[0][2], true);
  EXPECT_EQ(first.values[0][4], 0.3);
  EXPECT_EQ(first.values[0][5], false);
  const Looked again =
      look(page() + first.values[1].get<std::string>(),
           {kSettled, "wait:atelier.now.surveyed && atelier.now.cameras.agreement", state});
  EXPECT_EQ(again.values.at(0), first.values[0]);
  EXPECT_THAT(again.messages, IsEmpty());
}

TEST_F(ViewControl, KeyC_LooksThroughTheChosenCameraThenThroughTheNext) {
  SKIP_WITHOUT_BROWSER();
  // Of the last camera, behind which comes the first.
  const std::string through =
      "eval:[atelier.now.cameras.cameras.length - 1, -1, 0].indexOf(atelier.panes[0].through)";
  const Looked looked =
      look(page(), {kSettled,
                    "wait:([...document.querySelectorAll('.cameras button')].at(-1).click(), true)",
                    through, "key:c", kSettled, through, "key:c", kSettled, through, "key:Escape",
                    kSettled, through, "key:c", kSettled, through, "key:C", kSettled, through});
  const std::vector<nlohmann::json> expected = {1, 0, 2, 1, 2, 0};
  EXPECT_EQ(looked.values, expected) << looked.messages;
  EXPECT_THAT(looked.messages, IsEmpty());
}

TEST_F(ViewControl, Address_HoldsTheOverlaysOfBothViews) {
  SKIP_WITHOUT_BROWSER();
  const fs::path out = own_.path() / "page";
  ASSERT_EQ(view({workspace().string(), "--beside", (folder_->path() / "capture").string(), "--out",
                  out.string()})
                .exit_code,
            0);
  const std::string address = "file://" + (out / "index.html").string();
  const std::string state =
      "eval:[0, 1].map(i => { const one = atelier.timelines[atelier.panes[i].timeline].cameras; "
      "return [one.selected, one.overlays, one.showFrusta, one.showSkeleton]; })";
  const Looked first = look(
      address, {kSettled, "key:c", kSettled,
                "wait:([...document.querySelectorAll('#side-body .toggles label')].find(one => "
                "one.textContent.includes('detected')).click(), true)",
                "wait:(document.getElementById('toggle-cameras').click(), true)", kSettled, "key:p",
                kSettled, state, "eval:(atelier.writeAddress(true), location.hash)"});
  ASSERT_EQ(first.values.size(), 2) << first.messages;
  EXPECT_EQ(first.values[0][0][0], 0);
  EXPECT_EQ(first.values[0][0][1]["keypoints"], false);
  EXPECT_EQ(first.values[0][0][2], true);
  EXPECT_EQ(first.values[0][1][1]["keypoints"], true);
  const Looked again = look(address + first.values[1].get<std::string>(), {kSettled, state});
  EXPECT_EQ(again.values.at(0), first.values[0]);
  EXPECT_THAT(again.messages, IsEmpty());
}

TEST_F(ViewControl, AddressOfAFrameAlone_GoesThere) {
  SKIP_WITHOUT_BROWSER();
  const std::string typed =
      "wait:(addEventListener('hashchange', () => globalThis.hasTyped = true), location.hash = "
      "'#frame=1', true)";
  const Looked looked =
      look(page() + "#frame=2",
           {kSettled, kShownFrame, "eval:atelier.orbit.text()", typed, "wait:globalThis.hasTyped",
            kSettled, kShownFrame, "eval:atelier.orbit.text()",
            "eval:document.getElementById('frame').value"});
  ASSERT_EQ(looked.values.size(), 5) << looked.messages;
  EXPECT_EQ(looked.values[0], "2");
  EXPECT_EQ(looked.values[2], "1");
  EXPECT_EQ(looked.values[3], looked.values[1]) << "seen from where it was";
  EXPECT_EQ(looked.values[4], "1");
  EXPECT_THAT(looked.messages, IsEmpty());
}

/// A plate, 4 m wide and 1 m high, with colours of its vertices if they are given (" R G B").
fs::path plate(const fs::path& file, const std::string& color) {
  std::ofstream ply(file);
  ply << "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
         "property float z\n"
      << (color.empty() ? "" : "property uchar red\nproperty uchar green\nproperty uchar blue\n")
      << "element face 2\nproperty list uchar int vertex_indices\nend_header\n";
  for (const char* place : {"0 0 0", "4 0 0", "4 1 0", "0 1 0"}) {
    ply << place << color << "\n";
  }
  ply << "3 0 1 2\n3 0 2 3\n";
  return file;
}

TEST_F(ViewControl, Mesh_OffersTheColoursThatItHasAndOpensInThem) {
  SKIP_WITHOUT_BROWSER();
  const std::string offered =
      "eval:[...document.querySelectorAll('#layers select')].map(one => [one.value, "
      "...[...one.options].map(option => option.value)])";
  const std::string green = share("g > r + 60 && g > b + 60");
  for (const bool has_colors : {true, false}) {
    const fs::path out = own_.path() / (has_colors ? "green" : "grey");
    const fs::path file = plate(out.string() + ".ply", has_colors ? " 20 200 20" : "");
    ASSERT_EQ(view({file.string(), "--out", out.string()}).exit_code, 0);
    const Looked looked =
        look("file://" + (out / "index.html").string() + (has_colors ? "" : "#frame=0"),
             {kSettled, offered, green, "eval:document.getElementById('legend').hidden"});
    ASSERT_EQ(looked.values.size(), 3) << looked.messages;
    if (has_colors) {
      EXPECT_EQ(looked.values[0], nlohmann::json::parse(R"([["colors", "plain", "colors"]])"));
      EXPECT_GT(looked.values[1], 0.05);
    } else {
      EXPECT_EQ(looked.values[0], nlohmann::json::array());
      EXPECT_LT(looked.values[1], 0.0001);
    }
    EXPECT_EQ(looked.values[2], true);
    EXPECT_THAT(looked.messages, IsEmpty());
  }
}

TEST_F(ViewControl, ViewsBesideEachOther_ShowAllOfAWideMesh) {
  SKIP_WITHOUT_BROWSER();
  const fs::path file = plate(own_.path() / "plate.ply", "");
  const fs::path out = own_.path() / "page";
  ASSERT_EQ(view({file.string(), "--beside", file.string(), "--out", out.string()}).exit_code, 0);
  const Looked looked =
      look("file://" + (out / "index.html").string(),
           {kSettled,
            "wait:(atelier.orbit.azimuth = atelier.orbit.elevation = 0, atelier.touch(), true)",
            kSettled,
            "eval:atelier.drawnPanes.flatMap(pane => [[0, 0, 0], [4, 0, 0], [4, 1, 0], [0, 1, "
            "0]].map(place => { const x = atelier.view.pixelOf(place, pane, atelier.orbit)[0] / "
            "atelier.view.width; return x > pane.x && x < pane.x + pane.width; }))"});
  EXPECT_EQ(looked.values.at(0), nlohmann::json(std::vector<bool>(8, true)));
  EXPECT_THAT(looked.messages, IsEmpty());
}

TEST_F(ViewControl, ViewsBesideEachOther_AreFramedTogether) {
  SKIP_WITHOUT_BROWSER();
  const fs::path wide = plate(own_.path() / "wide.ply", "");
  const fs::path skirt = own_.path() / "skirt.obj";
  write_mesh(skirt, tube_skirt().mesh);
  const fs::path out = own_.path() / "page";
  ASSERT_EQ(view({skirt.string(), "--beside", wide.string(), "--out", out.string()}).exit_code, 0);
  const Looked looked =
      look("file://" + (out / "index.html").string(),
           {kSettled,
            "wait:(atelier.orbit.azimuth = atelier.orbit.elevation = 0, atelier.touch(), true)",
            kSettled,
            "eval:[[0, 0, 0], [4, 0, 0], [4, 1, 0], [0, 1, 0]].map(place => { const pane = "
            "atelier.drawnPanes[1]; const x = atelier.view.pixelOf(place, pane, "
            "atelier.orbit)[0] / atelier.view.width; return x > pane.x && x < pane.x + pane.width; "
            "})"});
  EXPECT_EQ(looked.values.at(0), nlohmann::json(std::vector<bool>(4, true)))
      << "the right one, though the left one is active";
  EXPECT_THAT(looked.messages, IsEmpty());
}

TEST_F(ViewControl, PlacesOfOneName_HaveTabsThatTellThemApart) {
  SKIP_WITHOUT_BROWSER();
  write_still(own_.path() / "monday/walk", 12, {0, 1});
  write_still(own_.path() / "tuesday/walk", 12, {0, 1});
  const fs::path out = own_.path() / "page";
  ASSERT_EQ(view({(own_.path() / "monday/walk").string(), "--beside",
                  (own_.path() / "tuesday/walk").string(), "--out", out.string()})
                .exit_code,
            0);
  const Looked looked = look("file://" + (out / "index.html").string(),
                             {kSettled,
                              "eval:[...document.querySelectorAll('#tabs button')].map("
                              "one => one.textContent)"});
  EXPECT_EQ(looked.values.at(0),
            nlohmann::json({"monday/walk: Sequence", "tuesday/walk: Sequence"}));
}

/// A person of boxes that faces -z: shoulders across x, toes before the shins.
Mesh person_of_boxes() {
  Mesh mesh;
  const auto box = [&](const Eigen::RowVector3d& low, const Eigen::RowVector3d& high) {
    const Index first = mesh.vertices.rows();
    mesh.vertices.conservativeResize(first + 8, 3);
    for (int i = 0; i < 8; ++i) {
      mesh.vertices.row(first + i) << (i & 1 ? high : low)[0], (i & 2 ? high : low)[1],
          (i & 4 ? high : low)[2];
    }
    const int faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                              {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    for (const auto& face : faces) {
      mesh.faces.conservativeResize(mesh.faces.rows() + 1, 3);
      mesh.faces.row(mesh.faces.rows() - 1) << face[0] + static_cast<int>(first),
          face[1] + static_cast<int>(first), face[2] + static_cast<int>(first);
    }
  };
  for (const double x : {-0.1, 0.1}) {
    box({x - 0.05, 0, -0.2}, {x + 0.05, 0.15, 0.05});
    box({x - 0.05, 0.15, -0.05}, {x + 0.05, 0.9, 0.05});
  }
  box({-0.2, 0.9, -0.1}, {0.2, 1.4, 0.1});
  box({-0.1, 1.5, -0.1}, {0.1, 1.75, 0.1});
  return mesh;
}

TEST_F(ViewControl, ScanAlone_IsSeenFromTheFront) {
  SKIP_WITHOUT_BROWSER();
  const fs::path scan = own_.path() / "scan.ply";
  write_mesh(scan, person_of_boxes());
  const fs::path out = own_.path() / "page";
  ASSERT_EQ(view({scan.string(), "--out", out.string()}).exit_code, 0);
  const Looked looked =
      look("file://" + (out / "index.html").string(), {kSettled,
                                                       "eval:[Math.sin(atelier.orbit.azimuth), "
                                                       "Math.cos(atelier.orbit.azimuth)]"});
  EXPECT_LT(looked.values.at(0).at(1), -0.7) << "where it faces";
}

TEST_F(ViewControl, Legend_HidesNothingOfTheView) {
  SKIP_WITHOUT_BROWSER();
  const std::string strain =
      "eval:(() => { const one = [...document.querySelectorAll('#layers select')].find(one => "
      "[...one.options].some(option => option.value === 'strain')); one.value = 'strain'; "
      "one.dispatchEvent(new Event('change')); })()";
  const fs::path out = own_.path() / "page";
  ASSERT_EQ(view({simulated_by("xpbd", own_.path()).string(), "--out", out.string()}).exit_code, 0);
  const Looked looked =
      look("file://" + (out / "index.html").string(),
           {kSettled, strain, kSettled,
            "eval:(() => { const [legend, view] = ['legend', 'view'].map(id => "
            "document.getElementById(id).getBoundingClientRect()); return [legend.width > 100, "
            "legend.right <= view.left, legend.bottom <= view.bottom + 1]; })()"});
  EXPECT_EQ(looked.values.at(1), nlohmann::json({true, true, true}));
  EXPECT_THAT(looked.messages, IsEmpty());
}

TEST_F(ViewControl, HelpThatIsLeftByEscape_IsToldAsClosed) {
  SKIP_WITHOUT_BROWSER();
  const std::string told = "eval:document.getElementById('help').getAttribute('aria-expanded')";
  const Looked looked = look(page(), {kSettled, "key:?", told, "key:Escape", told});
  EXPECT_EQ(looked.values.at(0), "true");
  EXPECT_EQ(looked.values.at(1), "false");
}

TEST_F(ViewControl, NamesOfLayersAndFindings_AreText) {
  SKIP_WITHOUT_BROWSER();
  const std::string name = "<img src=x onerror=alert(1)>\"'&amp;";
  const fs::path sequence = own_.path() / "names" / name;
  Sequence skirt;
  skirt.fps = 12;
  skirt.frame_ids = {0, 1, 2, 3, 4, 5, 6, 7};
  skirt.faces = tube_skirt().mesh.faces;
  skirt.load = [](Index i) {
    Mesh mesh = tube_skirt().mesh;
    mesh.vertices.row(50).array() += i == 4 ? 0.5 : 0.0;
    return mesh;
  };
  write_sequence(sequence, skirt);
  ASSERT_EQ(
      view({(own_.path() / "names").string(), "--out", (own_.path() / "page").string()}).exit_code,
      0);
  const std::string count = "eval:document.querySelectorAll('img, script:not([src])').length";
  const Looked looked =
      look("file://" + (own_.path() / "page/index.html").string(),
           {kSettled, "eval:document.querySelector('#layers label').textContent",
            "wait:atelier.now.surveyed",
            "eval:[...document.querySelectorAll('.finding, #marks button')].map(one => "
            "one.textContent || one.title).join()",
            "eval:document.getElementById('series').textContent", count});
  ASSERT_EQ(looked.values.size(), 4) << looked.messages;
  EXPECT_THAT(looked.values[0].get<std::string>(), HasSubstr(name));
  EXPECT_THAT(looked.values[1].get<std::string>(), HasSubstr(name + ": torn"));
  EXPECT_THAT(looked.values[2].get<std::string>(), HasSubstr(name));
  EXPECT_EQ(looked.values[3], 0);
  EXPECT_THAT(looked.messages, IsEmpty());
}

}  // namespace
}  // namespace atelier::fixtures
