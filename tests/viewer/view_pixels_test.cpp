// What each view of the page shows, by its pixels: layers in every colour, the pattern, the avatar
// with its light and its video, cameras with what lies over their images.

#include <array>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/io/mesh_file.h"
#include "tests/apps/dressed_workspace.h"
#include "tests/support/temporary_directory.h"
#include "tests/viewer/look.h"
#include "tests/viewer/person_capture.h"
#include "tests/viewer/server.h"

namespace atelier::fixtures {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

namespace fs = std::filesystem;

void write_obj(const fs::path& file, const Mesh& mesh) {
  const fs::path named = file.string() + ".obj";
  write_mesh(named, mesh);
  fs::rename(named, file);
}

/// The trunk as a scan: green, of the label dress, sure of itself.
Mesh coloured_scan() {
  Mesh scan = trunk_body().mesh;
  const Index count = scan.vertices.rows();
  scan.colors = Colors::Zero(count, 3);
  scan.colors.col(1).setConstant(0.7F);
  scan.labels.assign(static_cast<std::size_t>(count), 5);
  scan.confidence = Eigen::VectorXf::Ones(count);
  return scan;
}

/// The skirt with its pattern: a front and a back panel.
Mesh skirt_pattern() {
  Mesh mesh = tube_skirt().mesh;
  mesh.uvs.resize(2 * 11 * 7, 2);
  for (int panel = 0; panel < 2; ++panel) {
    for (int ring = 0; ring < 7; ++ring) {
      for (int column = 0; column < 11; ++column) {
        mesh.uvs.row(77 * panel + 11 * ring + column) << 0.06 * column + 0.8 * panel, -0.05 * ring;
      }
    }
  }
  mesh.uv_faces.resize(mesh.faces.rows(), 3);
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    const int first = static_cast<int>(f / 2) % 20;  // column of the face
    for (Index k = 0; k < 3; ++k) {
      const int ring = mesh.faces(f, k) / 20;
      const int column = (mesh.faces(f, k) % 20 - first + 20) % 20 + first;
      mesh.uv_faces(f, k) = 77 * (first / 10) + 11 * ring + column - 10 * (first / 10);
    }
  }
  return mesh;
}

TrackedMotion unsure_walk() {
  TrackedMotion tracked = short_walk();
  tracked.deviations.setConstant(0.004);
  tracked.deviations.row(1).setConstant(0.02);
  tracked.trusted = {1, 0, 1};
  return tracked;
}

fs::path film_file;  // NOLINT: stages take no captures

/// The trunk with the texture of an avatar.
void write_avatar(StageRun& run, const std::string& folder, const std::vector<Points>& frames) {
  SequenceHeader header;
  header.fps = 12;
  header.shared = trunk_body().mesh;
  header.shared.uvs = header.shared.vertices.leftCols<2>();
  header.shared.uv_faces = header.shared.faces;
  header.shared.vertices.resize(0, 3);
  header.frame_ids = {0, 1, 2};
  run.output(folder + "/sequence.h5",
             [&](const auto& file) { write_archive(file, archive_of(header)); });
  for (int i = 0; i < 3; ++i) {
    Mesh mesh;
    mesh.vertices = frames[static_cast<std::size_t>(i)];
    run.output(sequence_frame_path(folder, i).generic_string(),
               [&](const auto& file) { write_mesh_archive(file, mesh); });
  }
}

constexpr std::array kShownStages = {
    Stage{.name = "reconstruct",
          .summary = "scans",
          .inputs = {"capture"},
          .outputs = {"scans"},
          .options = option_set<NoOptions>,
          .run =
              [](StageRun& run) {
                for (const char* name : {"000000", "000001", "000002"}) {
                  run.output(std::string("scans/") + name + ".h5",
                             [](const auto& file) { write_mesh_archive(file, coloured_scan()); });
                }
              }},
    Stage{.name = "track",
          .summary = "a walk that is not sure",
          .inputs = {"capture"},
          .outputs = {"tracked"},
          .options = option_set<NoOptions>,
          .run =
              [](StageRun& run) {
                run.output("tracked/clothed.h5",
                           [](const auto& file) { write_tracked_motion(file, unsure_walk()); });
              }},
    kDressedStages[2],
    Stage{.name = "register",
          .summary = "the skirt in every frame, and its rest shape",
          .inputs = {"capture"},
          .outputs = {"registered"},
          .options = option_set<NoOptions>,
          .run =
              [](StageRun& run) {
                write_meshes(run, "registered/lower", tube_skirt().mesh.faces, walking_skirt());
                run.output("registered/lower/rest.obj",
                           [](const auto& file) { write_obj(file, tube_skirt().mesh); });
              }},
    Stage{.name = "flatten",
          .summary = "two panels",
          .inputs = {"capture"},
          .outputs = {"pattern"},
          .options = option_set<NoOptions>,
          .run =
              [](StageRun& run) {
                run.output("lower/garment.obj",
                           [](const auto& file) { write_obj(file, skirt_pattern()); });
              }},
    Stage{.name = "avatar",
          .summary = "the trunk in magenta",
          .inputs = {"capture"},
          .outputs = {"avatar"},
          .options = option_set<NoOptions>,
          .run =
              [](StageRun& run) {
                write_avatar(run, "surface", walking_trunk());
                ByteImage magenta(4, 4, 3, 220);
                for (int i = 0; i < 16; ++i) {
                  magenta.at(i % 4, i / 4, 1) = 0;
                }
                run.output_text("texture.png", image_bytes(magenta, ImageFormat::Png));
              }},
    Stage{.name = "animate",
          .summary = "the avatar and the skirt, and their film",
          .inputs = {"capture"},
          .outputs = {"animation"},
          .options = option_set<NoOptions>,
          .run =
              [](StageRun& run) {
                write_avatar(run, "seen", walking_trunk());
                write_meshes(run, "garments/lower", tube_skirt().mesh.faces, walking_skirt());
                if (!film_file.empty()) {
                  run.output("animation.mp4", [](const auto& file) {
                    fs::copy_file(film_file, file, fs::copy_options::overwrite_existing);
                  });
                }
              }},
};

/// A workspace with something of every kind, and its page.
class ViewPixels : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryDirectory;
    film_file = folder_->path() / "film.mp4";  // red, green, blue
    const ChildResult film = run_child({"ffmpeg",
                                        "-v",
                                        "error",
                                        "-f",
                                        "lavfi",
                                        "-i",
                                        "color=red:s=64x80:r=12:d=0.0834",
                                        "-f",
                                        "lavfi",
                                        "-i",
                                        "color=lime:s=64x80:r=12:d=0.0834",
                                        "-f",
                                        "lavfi",
                                        "-i",
                                        "color=blue:s=64x80:r=12:d=0.0834",
                                        "-filter_complex",
                                        "concat=n=3",
                                        "-pix_fmt",
                                        "yuv420p",
                                        film_file.string()});
    if (film.exit_code != 0) {
      film_file.clear();
    }
    SmallCapture small;
    small.frames = {0, 1, 2};
    write_small_capture(folder_->path() / "capture", small);
    for (const Stage& stage : kShownStages) {
      StageRequest request;
      request.input = folder_->path() / "capture";
      request.workspace = workspace();
      request.options = stage.options();
      run_stage(kShownStages, stage, request);
    }
    made_ = view({workspace().string(), "--out", (folder_->path() / "page").string()});
  }
  static void TearDownTestSuite() { delete folder_; }
  static fs::path workspace() { return folder_->path() / "workspace"; }
  static std::string address() {
    return "file://" + (folder_->path() / "page/index.html").string();
  }
  /// Step: the tab of that name, of timelines or at the side.
  static std::string tab(const std::string& name) {
    return "eval:[...document.querySelectorAll('[role=tab]')].find(one => "
           "one.textContent.startsWith('" +
           name + "')).click()";
  }
  /// Step: the layer of that name in another colour.
  static std::string colour(const std::string& layer, const std::string& coloring) {
    return "eval:(() => { const one = document.querySelector('[aria-label=\"Colour of " + layer +
           "\"]'); one.value = '" + coloring + "'; one.dispatchEvent(new Event('change')); })()";
  }
  void SetUp() override { ASSERT_EQ(made_.exit_code, 0) << made_.err; }
  static inline TemporaryDirectory* folder_ = nullptr;
  static inline ChildResult made_ = {};
};

const std::string kLegendText = "eval:document.getElementById('legend').textContent";

TEST_F(ViewPixels, Scan_IsSeenInItsColoursLabelsAndConfidence) {
  SKIP_WITHOUT_BROWSER();
  const std::string green = share("g > r + 40 && g > b + 40");
  const Looked looked = look(address(), {kSettled,
                                         tab("Capture"),
                                         kSettled,
                                         "key:2",
                                         "key:4",
                                         kSettled,
                                         green,
                                         "key:1",
                                         kSettled,
                                         green,
                                         colour("scan", "labels"),
                                         kSettled,
                                         share("r > g + 30 && b > g + 15"),
                                         kLegendText,
                                         colour("scan", "confidence"),
                                         kSettled,
                                         share("r > b + 90 && g > b + 90"),
                                         kLegendText,
                                         "key:1",
                                         kSettled,
                                         kLegendText});
  ASSERT_EQ(looked.values.size(), 10) << looked.messages;
  EXPECT_LT(looked.values[1], 0.001) << "hidden at first: the body is seen";
  EXPECT_GT(looked.values[2], 0.02);
  EXPECT_GT(looked.values[4], 0.02) << "the colour of dresses";
  EXPECT_THAT(looked.values[5].get<std::string>(), HasSubstr("dress"));
  EXPECT_GT(looked.values[7], 0.02) << "all of it is sure";
  EXPECT_THAT(looked.values[8].get<std::string>(), HasSubstr("scan: confidence01"));
  EXPECT_EQ(looked.values[9], "") << "no legend of what is hidden";
  EXPECT_THAT(looked.messages, IsEmpty());
}

TEST_F(ViewPixels, DistanceToTheScan_IsAColourWithALegend) {
  SKIP_WITHOUT_BROWSER();
  const Looked looked = look(address(), {kSettled, tab("Capture"), kSettled, "key:2", kSettled,
                                         colour("lower", "distance"), kSettled,
                                         share("r > b + 90 && g > b + 90"), kLegendText});
  ASSERT_EQ(looked.values.size(), 4) << looked.messages;
  EXPECT_GT(looked.values[2], 0.01) << "the hem is farther away than the legend goes";
  EXPECT_THAT(looked.values[3].get<std::string>(),
              AllOf(HasSubstr("lower: distance to the scan"), HasSubstr("20 mm and more")));
  EXPECT_THAT(looked.messages, IsEmpty());
}

TEST_F(ViewPixels, PanelUnderThePointer_LightsUpOnTheGarment) {
  SKIP_WITHOUT_BROWSER();
  const std::string lit = share("r > 120 && g > 90 && r > b + 70 && g > b + 40");
  const std::string place =
      "(() => { const box = document.querySelectorAll('#side-body svg path')[N]"
      ".getBoundingClientRect(); return [box.x + box.width / 2, box.y + box.height / 2]; })()";
  const auto over = [&](const char* number) {
    std::string one = place;
    return "move:" + one.replace(one.find('N'), 1, number);
  };
  const Looked looked = look(address(), {kSettled,
                                         tab("Capture"),
                                         kSettled,
                                         "key:2",
                                         tab("Pattern"),
                                         "wait:document.querySelector('#side-body svg')",
                                         kSettled,
                                         lit,
                                         over("0"),
                                         kSettled,
                                         lit,
                                         over("1"),
                                         kSettled,
                                         lit,
                                         "move:[400, 300]",
                                         kSettled,
                                         lit,
                                         colour("lower", "panels"),
                                         kSettled,
                                         share("b < r - 8 || g > r + 8")});
  ASSERT_EQ(looked.values.size(), 8) << looked.messages;
  EXPECT_LT(looked.values[2], 0.0005);
  EXPECT_GT(looked.values[3].get<double>() + looked.values[4].get<double>(), 0.01)
      << "one panel is in front, one behind";
  EXPECT_LT(looked.values[5], 0.0005) << "no longer";
  EXPECT_GT(looked.values[7], 0.01) << "a colour for each panel";
  EXPECT_THAT(looked.messages, IsEmpty());
}

TEST_F(ViewPixels, PanelUnderThePointer_StaysLitOverFramesAndGoesOutWithItsTab) {
  SKIP_WITHOUT_BROWSER();
  const std::string lit_in_3d = "atelier.now.layers.find(one => one.info.name === 'lower')";
  // Of the pattern the panels that are lit, and how much of the garment is.
  const std::string lit =
      "eval:[[...document.querySelectorAll('#side-body svg path')].filter(one => "
      "one.getAttribute('fill') === '#ffc740').map(one => one.dataset.panel), (one => one.mode === "
      "1 && one.tints.some((tint, i) => i % 3 === 0 && tint === 1))(" +
      lit_in_3d + ")]";
  const std::string over =
      "move:(() => { const box = document.querySelectorAll('#side-body svg path')[1]"
      ".getBoundingClientRect(); return [box.x + box.width / 2, box.y + box.height / 2]; })()";
  const std::string drawn = "wait:document.querySelector('#side-body svg')";
  const Looked looked = look(address(), {kSettled,
                                         tab("Capture"),
                                         kSettled,
                                         tab("Pattern"),
                                         drawn,
                                         over,
                                         kSettled,
                                         lit,
                                         "key:ArrowRight",
                                         kSettled,
                                         "eval:atelier.timeline.index",
                                         lit,
                                         "key: ",
                                         "wait:atelier.timeline.index !== 1",
                                         "key: ",
                                         kSettled,
                                         lit,
                                         tab("Findings"),
                                         kSettled,
                                         lit,
                                         tab("Pattern"),
                                         drawn,
                                         over,
                                         kSettled,
                                         lit});
  ASSERT_EQ(looked.values.size(), 10) << looked.messages;
  const nlohmann::json kBoth = {{"1"}, true};
  EXPECT_EQ(looked.values[2], kBoth);
  EXPECT_EQ(looked.values[3], 1);
  EXPECT_EQ(looked.values[4], kBoth) << "in the next frame";
  EXPECT_EQ(looked.values[5], kBoth) << "having played";
  EXPECT_EQ(looked.values[7], nlohmann::json({nlohmann::json::array(), false}))
      << "the pattern is not seen";
  EXPECT_EQ(looked.values[9], kBoth);
  EXPECT_THAT(looked.messages, IsEmpty());
}

TEST_F(ViewPixels, Avatar_HasItsTextureAndALightThatMoves) {
  SKIP_WITHOUT_BROWSER();
  const auto light = [](int degrees) {
    return "eval:(() => { const one = document.querySelector('[aria-label=\"Direction of the "
           "light\"]'); one.value = " +
           std::to_string(degrees) + "; one.dispatchEvent(new Event('input')); })()";
  };
  const std::string right = share("(r > g + 60 && b > g + 60) * (x > 0.5 ? r : -r) / 255");
  const Looked looked =
      look(address(), {kSettled, tab("Capture"), kSettled, "key:2", "key:4", "key:3", kSettled,
                       "eval:(atelier.orbit.azimuth = 0, atelier.touch())", kSettled,
                       share("r > g + 60 && b > g + 60"), light(90), right, light(-90), right});
  ASSERT_EQ(looked.values.size(), 7) << looked.messages;
  EXPECT_GT(looked.values[2], 0.02) << "magenta";
  EXPECT_GT(looked.values[4], 0.003) << "lit from the right";
  EXPECT_LT(looked.values[6], -0.003) << "lit from the left";
  EXPECT_THAT(looked.messages, IsEmpty());
}

TEST_F(ViewPixels, Video_IsAtTheFrameOfTheGeometry) {
  SKIP_WITHOUT_BROWSER();
  if (film_file.empty()) {
    GTEST_SKIP() << "no program ffmpeg (scripts/setup)";
  }
  const TemporaryDirectory own;
  const Server server(workspace(), own.path() / "log");
  const std::string pixel =
      "eval:(() => { const canvas = document.createElement('canvas'); canvas.width = 64; "
      "canvas.height = 80; const context = canvas.getContext('2d'); "
      "context.drawImage(document.querySelector('video'), 0, 0); "
      "return [...context.getImageData(30, 40, 1, 1).data].map(c => c > 120); })()";
  const std::string sought =
      "wait:document.querySelector('video').readyState >= 2 && "
      "!document.querySelector('video').seeking";
  const Looked looked =
      look(server.address(),
           {kSettled, tab("Video"), "wait:document.querySelector('video')?.readyState >= 2", sought,
            pixel, "key:ArrowRight", kSettled, sought, pixel, "key:End", kSettled, sought, pixel,
            share("r > g + 60 && b > g + 60")});
  ASSERT_EQ(looked.values.size(), 5) << looked.messages;
  EXPECT_EQ(looked.values[1], nlohmann::json({true, false, false, true})) << "red";
  EXPECT_EQ(looked.values[2], nlohmann::json({false, true, false, true})) << "green";
  EXPECT_EQ(looked.values[3], nlohmann::json({false, false, true, true})) << "blue";
  EXPECT_GT(looked.values[4], 0.005) << "the avatar beside it";
  EXPECT_THAT(looked.messages, IsEmpty());
  EXPECT_THAT(looked.outside, IsEmpty());
}

TEST_F(ViewPixels, UncertaintyOfTheTrack_IsAFigureAndFindings) {
  SKIP_WITHOUT_BROWSER();
  const Looked looked = look(
      address(), {kSettled, tab("Capture"), kSettled,
                  "eval:[...document.getElementById('series').options].map(o => o.textContent)",
                  "eval:atelier.now.info.series.find(s => s.name.startsWith('standard "
                  "deviation of joints, mean')).values",
                  "eval:atelier.now.info.marks.filter(m => m.stage === 'track' && m.frame === "
                  "1).map(m => m.text)"});
  ASSERT_EQ(looked.values.size(), 4) << looked.messages;
  EXPECT_THAT(looked.values[1].get<std::vector<std::string>>(),
              AllOf(Contains("track: standard deviation of joints, mean (m)"),
                    Contains("track: standard deviation of joints, largest (m)")));
  EXPECT_NEAR(looked.values[2][1].get<double>(), 0.02, 1e-9);
  ASSERT_EQ(looked.values[3].size(), 1) << looked.values[3];
  EXPECT_THAT(looked.values[3][0].get<std::string>(), HasSubstr("frame 1: bridged"));
}

TEST_F(ViewPixels, Report_LeadsToThePageBesideIt) {
  const fs::path report = workspace() / "report";
  const auto written = [&] {
    EXPECT_EQ(run_child({program_path(), "report", workspace().string()}).exit_code, 0);
    std::ifstream file(report / "index.html");
    return std::string{std::istreambuf_iterator<char>(file), {}};
  };
  EXPECT_THAT(written(), HasSubstr("--out workspace/report/view</code>"));
  ASSERT_EQ(view({workspace().string(), "--out", (report / "view").string()}).exit_code, 0);
  EXPECT_THAT(written(),
              AllOf(HasSubstr("href=\"view/index.html\""), Not(HasSubstr("made before"))));
  EXPECT_TRUE(fs::exists(report / "view/index.html"));
  fs::last_write_time(
      report / "view/index.html",
      fs::last_write_time(folder_->path() / "capture/capture.toml") - std::chrono::hours(1));
  EXPECT_THAT(written(), HasSubstr("(made before these results)"));
  fs::remove_all(report);
}

/// A capture of three cameras with a mask of the right half of each image.
fs::path masked_capture(const fs::path& folder) {
  const SmallCapture small;
  write_small_capture(folder, small);
  for (const Camera& camera : small.cameras) {
    for (const int frame : small.frames) {
      make_private_directory(folder / "masks" / camera.id);
      ByteImage mask(camera.width, camera.height, 1);
      for (int y = 0; y < mask.height; ++y) {
        for (int x = mask.width / 2; x < mask.width; ++x) {
          mask.at(x, y) = 255;
        }
      }
      write_image(folder / "masks" / camera.id / (frame_name(frame) + ".png"), mask);
    }
  }
  return folder;
}

/// Where a camera's image stands in space, on the page.
std::string image_place(int camera) {
  return "(() => { const c = atelier.now.cameras, box = "
         "document.getElementById('view').getBoundingClientRect(); const q = "
         "c.corners(c.cameras[" +
         std::to_string(camera) +
         "]).map(p => atelier.view.pixelOf(p, atelier.drawnPanes[0], atelier.orbit)); return "
         "[0, 1].map(k => [box.x, box.y][k] + q.reduce((sum, p) => sum + p[k] / 4, 0)); })()";
}

/// Step: a pixel of the selected camera's image with what lies over it.
std::string image_pixel(int x, int y) {
  return "eval:[...atelier.now.cameras.canvas.getContext('2d').getImageData(" + std::to_string(x) +
         ", " + std::to_string(y) + ", 1, 1).data]";
}

std::string overlay(const std::string& words) {
  return "eval:[...document.querySelectorAll('#side-body label')].find(one => "
         "one.textContent.trim() === '" +
         words + "').click()";
}

TEST(ViewCapture, Cameras_StandInSpaceWithTheirImagesAndAreChosenByAClick) {
  SKIP_WITHOUT_BROWSER();
  const TemporaryDirectory root;
  ASSERT_EQ(view({masked_capture(root.path() / "capture").string(), "--out",
                  (root.path() / "page").string()})
                .exit_code,
            0);
  const std::string dark = share("r < 60 && g < 60 && b < 60");
  const std::string chosen =
      "eval:[atelier.now.cameras.selected, atelier.panes[0].through, atelier.orbit.azimuth]";
  const std::string drag =
      "drag:(() => { const [x, y] = " + image_place(1) + "; return [x, y, x + 30, y]; })()";
  const Looked looked =
      look("file://" + (root.path() / "page/index.html").string(),
           {"wait:atelier.now.cameras.planes.children.filter(one => one.visible).length === 3",
            "wait:(atelier.orbit.distance = 12, atelier.touch(), true)", kSettled, dark,
            "click:" + image_place(1), kSettled, chosen, drag, kSettled, chosen,
            "click:" + image_place(1), kSettled, chosen, dark, "key:Escape", kSettled,
            "eval:document.getElementById('toggle-cameras').click()", kSettled, dark});
  ASSERT_EQ(looked.values.size(), 7) << looked.messages;
  EXPECT_GT(looked.values[0], 0.0005) << "the images are nearly black";
  EXPECT_EQ(looked.values[1][0], 1);
  EXPECT_EQ(looked.values[1][1], -1);
  EXPECT_EQ(looked.values[2][0], 1);
  EXPECT_EQ(looked.values[2][1], -1) << "a drag is no click";
  EXPECT_NE(looked.values[2][2], looked.values[1][2]) << "it turns the view";
  EXPECT_EQ(looked.values[3][1], 1) << "another click looks through it";
  EXPECT_GT(looked.values[4], 0.2) << "its image fills the view";
  EXPECT_LT(looked.values[6], 0.0001) << "no cameras";
  EXPECT_THAT(looked.messages, IsEmpty());
}

TEST(ViewCapture, KeypointsMasksAndLabels_LieOverTheImage) {
  SKIP_WITHOUT_BROWSER();
  const TemporaryDirectory root;
  ASSERT_EQ(view({masked_capture(root.path() / "capture").string(), "--out",
                  (root.path() / "page").string()})
                .exit_code,
            0);
  const Looked looked = look("file://" + (root.path() / "page/index.html").string(),
                             {"key:c",
                              kSettled,
                              "wait:atelier.now.cameras.canvas.width === 64",
                              overlay("keypoints in space"),
                              kSettled,
                              image_pixel(13, 20),
                              overlay("detected keypoints"),
                              kSettled,
                              image_pixel(13, 20),
                              image_pixel(2, 70),
                              overlay("mask"),
                              kSettled,
                              image_pixel(2, 70),
                              image_pixel(60, 70),
                              overlay("mask"),
                              overlay("labels"),
                              kSettled,
                              image_pixel(5, 6),
                              image_pixel(2, 70),
                              "eval:document.getElementById('side-body').innerText"});
  ASSERT_EQ(looked.values.size(), 13) << looked.messages;
  EXPECT_EQ(looked.values[1], nlohmann::json({255, 176, 0, 255})) << "the nose";
  EXPECT_EQ(looked.values[3], nlohmann::json({40, 40, 40, 255}));
  EXPECT_EQ(looked.values[4], nlohmann::json({40, 40, 40, 255}));
  EXPECT_GT(looked.values[6][0], 150) << "who is not on the mask is pale";
  EXPECT_EQ(looked.values[7], nlohmann::json({40, 40, 40, 255}));
  EXPECT_GT(looked.values[10][2], looked.values[10][0].get<int>() + 50)
      << "upper garments are blue";
  EXPECT_EQ(looked.values[11], nlohmann::json({40, 40, 40, 255})) << "background";
  EXPECT_THAT(looked.values[12].get<std::string>(), HasSubstr("upper")) << "what the colours mean";
  EXPECT_THAT(looked.messages, IsEmpty());
}

TEST(ViewCapture, OverlaysThatAreOffered_AreThoseThatTheImageHas) {
  SKIP_WITHOUT_BROWSER();
  const TemporaryDirectory root;
  write_small_capture(root.path() / "capture", SmallCapture());
  fs::remove_all(root.path() / "capture/masks");
  fs::remove_all(root.path() / "capture/labels");
  ASSERT_EQ(view({(root.path() / "capture").string(), "--out", (root.path() / "page").string()})
                .exit_code,
            0);
  const Looked looked =
      look("file://" + (root.path() / "page/index.html").string(),
           {"key:c", kSettled, "wait:atelier.now.cameras.canvas.width === 64", kSettled,
            "eval:[...document.querySelectorAll('#side-body .toggles label')].filter(one => "
            "one.checkVisibility()).map(one => one.textContent.trim())"});
  EXPECT_THAT(
      looked.values.at(0).get<std::vector<std::string>>(),
      AllOf(Contains("detected keypoints"), Not(Contains("labels")), Not(Contains("mask"))));
  EXPECT_THAT(looked.messages, IsEmpty());
}

TEST(ViewCapture, KeypointsInSpace_HaveCrossesAsWideAsTheirDeviation) {
  SKIP_WITHOUT_BROWSER();
  const TemporaryDirectory root;
  write_person(root.path() / "capture", person_capture());
  ASSERT_EQ(view({(root.path() / "capture").string(), "--out", (root.path() / "page").string()})
                .exit_code,
            0);
  const std::string red = share("r > 150 && g < 90 && b < 90");
  const Looked looked = look("file://" + (root.path() / "page/index.html").string(),
                             {"wait:atelier.now.cameras.agreement", kSettled,
                              "eval:(atelier.orbit.zoom(0.4), atelier.touch())", kSettled, red,
                              R"(eval:(() => {
              const {agreement, skeleton} = atelier.now.cameras;
              const points = agreement.frames.find(one => one.frame === atelier.frameId).points;
              const isThere = i => points[i]?.[3] > 0;
              const limbs = agreement.limbs.filter(([a, b]) => isThere(a) && isThere(b)).length;
              const place = skeleton.geometry.attributes.position.array;
              const wide = (place[6 * limbs + 3] - place[6 * limbs]) / 2;
              return Math.abs(wide - Math.max(points.find(one => one[3] > 0)[4], 0.004)) < 1e-5;
            })())",
                              "eval:document.getElementById('toggle-keypoints-in-space').focus()",
                              "key: ", kSettled, red});
  ASSERT_EQ(looked.values.size(), 5) << looked.messages;
  EXPECT_GT(looked.values[1], 0.0005);
  EXPECT_EQ(looked.values[2], true);
  EXPECT_LT(looked.values[4], 0.0001) << "Space takes them away";
  EXPECT_THAT(looked.messages, IsEmpty());
}

}  // namespace
}  // namespace atelier::fixtures
