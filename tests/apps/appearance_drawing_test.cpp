// `draw`: what networks that `appearance` has learnt show, as images and videos, and what it
// refuses.
#if defined(ATELIER_HAS_CAPTURE)

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "appearance/painted_scene.h"
#include "core/archive.h"
#include "core/atomic_file.h"
#include "core/io/file_bytes.h"
#include "core/io/image_file.h"
#include "core/io/mesh_file.h"
#include "core/io/safetensors.h"
#include "tests/apps/appearance_fixture.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// A workspace that has networks of the cloth and of the ball under it.
class AppearanceDrawing : public Appearance {
 protected:
  static void SetUpTestSuite() {
    if (!fs::exists(network_program())) {
      return;
    }
    shared_ = std::make_unique<TemporaryDirectory>();
    make_capture(*shared_ / "capture");
    find(*shared_ / "capture", workspace());
    // Gently: 24 quick steps end below the all but perfect texture of a grey body.
    const ChildResult done = learn("appearance", *shared_ / "capture", workspace(),
                                   {"--body", "true", "--learning-rate", "1e-3"});
    ASSERT_EQ(done.exit_code, 0) << done.err;
  }
  static void TearDownTestSuite() { shared_.reset(); }

  static fs::path workspace() { return *shared_ / "found"; }
  static fs::path capture() { return *shared_ / "capture"; }
  fs::path out(const std::string& name) const { return folder_ / name; }
  ChildResult draw(const fs::path& from, const std::string& name,
                   const std::vector<std::string>& more) const {
    std::vector<std::string> words = {program_path(), "render", "--neural",
                                      from.string(),  "--out",  out(name).string()};
    words.insert(words.end(), more.begin(), more.end());
    return run_child(words);
  }
  /// By the camera that is held out.
  ChildResult drawn(const std::string& name, std::vector<std::string> more = {}) const {
    more.insert(more.end(), {"--capture", capture().string(), "--camera", "09"});
    return draw(workspace(), name, more);
  }
  void expect_no(const ChildResult& result, int code, const std::string& words,
                 const std::string& name = "none") const {
    EXPECT_EQ(result.exit_code, code) << result.err;
    EXPECT_THAT(result.err, HasSubstr(words));
    EXPECT_FALSE(fs::exists(out(name)));
  }

  static std::unique_ptr<TemporaryDirectory> shared_;
};
std::unique_ptr<TemporaryDirectory> AppearanceDrawing::shared_;

/// Mean difference of two images, in steps of 8 bits.
double mean_difference(const ByteImage& one, const ByteImage& other) {
  EXPECT_EQ(one.data.size(), other.data.size());
  double differ = 0;
  for (std::size_t i = 0; i < one.data.size(); ++i) {
    differ += std::abs(one.data[i] - other.data[i]);
  }
  return differ / static_cast<double>(one.data.size());
}

TEST_F(AppearanceDrawing, HeldOutCamera_IsReproduced) {
  for (const char* surface : {"dress", "body"}) {
    EXPECT_TRUE(fs::exists(workspace() / "appearance" / "current" / surface / "model.safetensors"));
  }
  const ChildResult pictures = drawn("own");
  ASSERT_EQ(pictures.exit_code, 0) << pictures.err;
  const ByteImage own = read_byte_image(out("own") / "000002.png");
  EXPECT_EQ(own.width, kSide);
  // Near what the camera took: cloth and body, whose pixels labels tell from the background.
  const ByteImage taken = read_byte_image(capture() / "images" / "09" / "000002.png");
  const ByteImage labels = read_labels(capture() / "labels" / "09" / "000002.png");
  double off = 0;
  double count = 0;
  for (std::size_t i = 0; i < labels.data.size(); ++i) {
    if (labels.data[i] != 0) {
      off += std::abs(own.data[3 * i] - taken.data[3 * i]);
      count += 1;
    }
  }
  EXPECT_LT(off / count, 30);
}

TEST_F(AppearanceDrawing, DrawnImages_SayWhatTheyAre) {
  const auto verified = [&](const fs::path& file) {
    return run_child({program_path(), "verify", file.string()});
  };
  ASSERT_EQ(draw(workspace(), "large", {"--width", "420", "--height", "420"}).exit_code, 0);
  const fs::path image = out("large") / "000002.png";
  const ChildResult told = verified(image);
  EXPECT_EQ(told.exit_code, 0) << told.err;
  for (const char* words : {"synthetic (trainedAlgorithmicMedia), by atelier", "nobody, tests",
                            "made of: trained networks, ", "appearance ", "signature: valid, by RW",
                            "that of the credentials"}) {
    EXPECT_THAT(told.out, HasSubstr(words));
  }
  EXPECT_EQ(std::count(told.out.begin(), told.out.end(), '\n'), 5);
  // Without its credentials the mark is left, and the log knows it.
  const ByteImage pixels = read_byte_image(image);
  write_image(out("bare.jpg"), pixels, {.quality = 80});
  const ChildResult bare = verified(out("bare.jpg"));
  EXPECT_EQ(bare.exit_code, 1);
  EXPECT_THAT(bare.out, HasSubstr("synthetic, by its mark"));
  const std::string mark = bare.out.substr(bare.out.find("mark: ") + 6, 16);
  EXPECT_THAT(told.out, HasSubstr("mark: " + mark));
  EXPECT_THAT(bytes_of(workspace() / "access.log"), HasSubstr("mark " + mark));
  // A changed pixel is noticed.
  std::string changed = bytes_of(image);
  changed[changed.size() - 30] = static_cast<char>(changed[changed.size() - 30] ^ 1);
  write_file_atomically(out("changed.png"), changed);
  EXPECT_NE(verified(out("changed.png")).exit_code, 0);
  // A film has both, too.
  ASSERT_EQ(draw(workspace(), "film.mp4", {"--width", "420", "--height", "420"}).exit_code, 0);
  const ChildResult film = verified(out("film.mp4"));
  EXPECT_THAT(film.out, HasSubstr("signature: valid"));
  EXPECT_THAT(film.out, HasSubstr("mark: " + mark + ", that of the credentials"));
  // Left out where it is not wanted.
  ASSERT_EQ(draw(workspace(), "paper", {"--width", "420", "--height", "420", "--mark", "false"})
                .exit_code,
            0);
  const ChildResult paper = verified(out("paper") / "000002.png");
  EXPECT_EQ(paper.exit_code, 1);
  EXPECT_THAT(paper.out, AllOf(HasSubstr("nothing is known of it"), HasSubstr("mark: none found")));
  EXPECT_LT(mean_difference(read_byte_image(out("paper") / "000002.png"), pixels), 2);
  expect_no(draw(workspace(), "none", {"--mark", "false", "--sign", "key"}), 2,
            "--sign does nothing");
}

TEST_F(AppearanceDrawing, Body_IsMeasuredToo) {
  const ChildResult figures =
      run_child({program_path(), "evaluate", workspace().string(), "--ground-truth",
                 capture().string(), "--stage", "appearance"});
  EXPECT_THAT(figures.exit_code, ::testing::AnyOf(0, 1)) << figures.err;
  for (const char* key : {"appearance.psnr_db", "appearance.body_psnr_db",
                          "appearance.body_static_psnr_db", "appearance.body_covered"}) {
    EXPECT_THAT(figures.out, HasSubstr(key));
  }
}

TEST_F(AppearanceDrawing, MeshesOfTheNetworksTopology_AreDrawn) {
  for (const char* folder : {"meshes", "balls", "other"}) {
    fs::create_directories(out(folder));
  }
  for (int f = 0; f < kFrames; ++f) {
    Mesh mesh = waving_cloth();
    mesh.vertices = cloth_at(mesh, f);
    write_mesh(out("meshes") / (digits(f) + ".ply"), mesh);
    write_mesh(out("balls") / (digits(f) + ".ply"), ball());
    write_mesh(out("other") / (digits(f) + ".ply"), grid(3, 3));
  }
  const auto by_meshes = [&](const char* dress) {
    return drawn("plain",
                 {"--body", out("balls").string(), "--garment", "dress=" + out(dress).string()});
  };
  // Meshes of another topology are refused, and leave nothing in the way of the right ones.
  expect_no(by_meshes("other"), 3, "surface that it is to draw", "plain");
  const ChildResult pictures = by_meshes("meshes");
  ASSERT_EQ(pictures.exit_code, 0) << pictures.err;
  ASSERT_EQ(drawn("own").exit_code, 0);
  for (int f = 0; f < kFrames; ++f) {  // but for the single precision of PLY
    EXPECT_LT(mean_difference(read_byte_image(out("plain") / (digits(f) + ".png")),
                              read_byte_image(out("own") / (digits(f) + ".png"))),
              1);
  }
}

/// Seconds that a video says it lasts: the duration in the header of its movie, over its time
/// scale.
double seconds_of_video(const std::string& bytes) {
  const std::size_t at = bytes.find("mvhd");
  if (at == std::string::npos || bytes.size() < at + 24) {
    return 0;
  }
  const auto number = [&](std::size_t from) {
    double value = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      value = 256 * value + static_cast<unsigned char>(bytes[from + i]);
    }
    return value;
  };
  return number(at + 20) / number(at + 16);
}

TEST_F(AppearanceDrawing, VideoOfMeshes_HasTheirFrameRate) {
  for (const auto& [more, rate] :
       {std::pair{std::vector<std::string>{}, 12.0}, {{"--video.fps", "20"}, 20.0}}) {
    const std::string name = "film" + std::to_string(more.size()) + ".mp4";
    const ChildResult video = drawn(name, more);
    ASSERT_EQ(video.exit_code, 0) << video.err;
    EXPECT_NEAR(seconds_of_video(bytes_of(out(name))), kFrames / rate, 2e-3);
  }
  // A dress that goes at another rate than its body is another motion's.
  Sequence fast = open_sequence(workspace() / "register" / "current" / "registered" / "dress");
  std::vector<Mesh> meshes;
  for (Index i = 0; i < static_cast<Index>(fast.frame_ids.size()); ++i) {
    meshes.push_back(frame(fast, i));
  }
  write_sequence(out("fast"), sequence_of(meshes, 30, fast.frame_ids));
  expect_no(drawn("none", {"--garment", "dress=" + out("fast").string()}), 3,
            "meshes of dress: 30 frames a second; expected 12");
}

TEST_F(AppearanceDrawing, FramesMissingFromSome_AreLeftOutWithAWarning) {
  for (int f = 1; f < 3; ++f) {
    Mesh mesh = waving_cloth();
    mesh.vertices = cloth_at(mesh, f);
    fs::create_directories(out("two"));
    write_mesh(out("two") / (digits(f) + ".ply"), mesh);
  }
  const ChildResult two = drawn("pictures", {"--garment", "dress=" + out("two").string()});
  ASSERT_EQ(two.exit_code, 0) << two.err;
  EXPECT_THAT(two.out, HasSubstr("frame 000001\nframe 000002\n"));
  EXPECT_THAT(two.out, HasSubstr("warning: 2 of 4 frames are drawn"));
  EXPECT_FALSE(fs::exists(out("pictures") / "000000.png"));
}

TEST_F(AppearanceDrawing, NormalsOfChosenFrames_AreDrawnWithoutNetworks) {
  const ChildResult normals = drawn("normals", {"--normals", "--frames", "[1, 3]"});
  ASSERT_EQ(normals.exit_code, 0) << normals.err;
  EXPECT_THAT(normals.out, ::testing::EndsWith("frame 000001\nframe 000003\n"));
  EXPECT_THAT(normals.out, ::testing::Not(::testing::HasSubstr("frame 000002")));
  ASSERT_EQ(drawn("learnt", {"--frames", "[3]"}).exit_code, 0);
  EXPECT_FALSE(fs::exists(out("learnt") / "000001.png"));
  const ByteImage image = read_byte_image(out("normals") / "000003.png");
  EXPECT_GT(mean_difference(image, read_byte_image(out("learnt") / "000003.png")), 5);
  expect_no(drawn("none", {"--frames", "[77]"}), 3, "none that body and garments share");
  expect_no(drawn("none", {"--normals", "--device", "cpu"}), 2, "--device is of networks");
}

TEST_F(AppearanceDrawing, KilledDrawing_LeavesItsPlaceFree) {
  const fs::path place = out("killed");
  const fs::path unfinished = folder_ / ".killed.unfinished" / "killed" / "000000.png";
  {
    ChildProcess one({program_path(), "render", "--neural", workspace().string(), "--out",
                      place.string(), "--width", "900", "--height", "900"});
    while (!fs::exists(unfinished) && !one.has_ended()) {
      std::this_thread::yield();
    }
    one.kill(SIGKILL);
    ASSERT_EQ(one.wait().signal, SIGKILL) << "it ended before it was killed";
  }
  EXPECT_FALSE(fs::exists(place));
  const ChildResult again = drawn("killed");
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_TRUE(fs::exists(place / "000000.png"));
  EXPECT_FALSE(fs::exists(unfinished.parent_path().parent_path()));
}

TEST_F(AppearanceDrawing, TransparentBackgroundAndMovingCamera_AreDrawn) {
  ASSERT_EQ(drawn("own").exit_code, 0);
  ChildResult pictures = drawn("clear", {"--alpha", "true"});
  ASSERT_EQ(pictures.exit_code, 0) << pictures.err;
  EXPECT_EQ(read_image_header(out("clear") / "000002.png").channels, 4);
  EXPECT_NE(bytes_of(out("clear") / "000002.png"), bytes_of(out("own") / "000002.png"));
  pictures = draw(workspace(), "turned", {"--turn", "true", "--width", "32", "--height", "40"});
  ASSERT_EQ(pictures.exit_code, 0) << pictures.err;
  EXPECT_GT(mean_difference(read_byte_image(out("turned") / "000000.png"),
                            read_byte_image(out("turned") / "000002.png")),
            1);
}

TEST_F(AppearanceDrawing, Occlusion_IsMeasuredAsInTraining) {
  // Learnt with 3 strata (small_network), which the network's file says.
  const fs::path network =
      fs::canonical(workspace() / "appearance" / "current") / "dress" / "model.safetensors";
  EXPECT_EQ(read_safetensors(network).metadata.at("occlusion.strata"), "3");
  ASSERT_EQ(drawn("own").exit_code, 0);
  ASSERT_EQ(drawn("said", {"--occlusion.strata", "3", "--occlusion.reach", "1"}).exit_code, 0);
  EXPECT_EQ(bytes_of(out("said") / "000001.png"), bytes_of(out("own") / "000001.png"));
  expect_no(drawn("none", {"--occlusion.strata", "8"}), 2,
            "occlusion.strata cannot be 8: body learnt with 3; leave it out");
  expect_no(drawn("none", {"--occlusion.reach", "0.5"}), 2, "occlusion.reach cannot be 0.5");
  // A network of an older program does not say it: it is drawn as it comes, or as asked.
  const fs::path old = out("old");
  fs::copy(workspace(), old, fs::copy_options::recursive | fs::copy_options::copy_symlinks);
  for (const char* surface : {"dress", "body"}) {
    const fs::path file = old / "appearance" / "current" / surface / "model.safetensors";
    Safetensors content = read_safetensors(file);
    std::erase_if(content.metadata, [](const auto& text) {
      return text.first.starts_with("occlusion.") || text.first == "digest";
    });
    write_safetensors(file, content);
  }
  const std::vector<std::string> camera = {"--capture", capture().string(), "--camera", "09"};
  ASSERT_EQ(draw(old, "as_it_comes", camera).exit_code, 0);
  std::vector<std::string> three = camera;
  three.insert(three.end(), {"--occlusion.strata", "3"});
  ASSERT_EQ(draw(old, "three", three).exit_code, 0);
  EXPECT_EQ(bytes_of(out("three") / "000001.png"), bytes_of(out("own") / "000001.png"));
  EXPECT_NE(bytes_of(out("as_it_comes") / "000001.png"), bytes_of(out("own") / "000001.png"));
}

TEST_F(AppearanceDrawing, MisspelledOrUnusedOptions_AreRefused) {
  expect_no(drawn("none", {"--garment", "dres=x"}), 2, "did you mean 'dress'?");
  expect_no(drawn("none", {"--width", "64"}), 2, "--width does nothing");
  expect_no(drawn("none", {"--video.fps", "12"}), 2, "--video.fps is of a video");
  expect_no(drawn("none", {"--alpha", "true", "--background", "[0, 1, 0]"}), 2,
            "--background does nothing with --alpha");
  expect_no(draw(workspace(), "none", {"--capture", capture().string(), "--camera", "99"}), 2,
            "no camera '99'; it has 00, 01, 02");
  const ChildResult figures =
      run_child({program_path(), "evaluate", workspace().string(), "--ground-truth",
                 capture().string(), "--stage", "apearance"});
  EXPECT_EQ(figures.exit_code, 2);
  EXPECT_THAT(figures.err, HasSubstr("did you mean 'appearance'?"));
}

TEST_F(AppearanceDrawing, Report_ShowsHeldOutImagesBesideDrawnOnes) {
  const auto page = [&](const fs::path& workspace) {
    const fs::path file = out("page.html");
    const ChildResult done =
        run_child({program_path(), "report", workspace.string(), "--out", file.string()});
    EXPECT_EQ(done.exit_code, 0) << done.err;
    return bytes_of(file);
  };
  const std::string caption = "Held-out cameras in held-out frames";
  EXPECT_THAT(page(workspace()), HasSubstr(caption));
  // Without them there is nothing to show, and nothing to complain of.
  const fs::path images = capture() / "images" / "09";
  fs::rename(images, out("images"));
  const std::string without = page(workspace());
  fs::rename(out("images"), images);
  EXPECT_THAT(without, Not(HasSubstr(caption)));
  EXPECT_THAT(without, Not(HasSubstr("could not be drawn")));
}

TEST_F(AppearanceDrawing, OutputAmongResultsOrCapture_IsRefused) {
  for (const char* place : {"appearance/current/pictures", "register/film.mp4", "body/new/deep"}) {
    const ChildResult refused =
        run_child({program_path(), "render", "--neural", workspace().string(), "--out",
                   (workspace() / place).string()});
    EXPECT_EQ(refused.exit_code, 2) << place;
    EXPECT_THAT(refused.err, HasSubstr("--out lies among the results of '")) << place;
    EXPECT_FALSE(fs::exists(workspace() / place));
  }
  for (const char* place : {"pictures", "register.mp4", "report/pictures"}) {
    const ChildResult refused =
        run_child({program_path(), "render", "--neural", workspace().string(), "--out",
                   (workspace() / place).string()});
    EXPECT_EQ(refused.exit_code, 2) << place;
    EXPECT_THAT(refused.err, HasSubstr("--out lies in the WORKSPACE")) << place;
    EXPECT_FALSE(fs::exists(workspace() / place));
  }
  const ChildResult refused = run_child({program_path(), "render", "--neural", workspace().string(),
                                         "--out", (capture() / "pictures").string()});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("--out lies in the capture"));
  EXPECT_FALSE(fs::exists(capture() / "pictures"));
  // Results are as they were.
  const ChildResult status = run_child({program_path(), "status", workspace().string()});
  EXPECT_THAT(status.out, Not(HasSubstr("damaged")));
}

TEST_F(AppearanceDrawing, MissingOrCorruptNetwork_IsNotDrawn) {
  const fs::path copy = out("copy");
  fs::copy(workspace(), copy, fs::copy_options::recursive | fs::copy_options::copy_symlinks);
  // One in which a bit has flipped draws nothing, and is not judged.
  const fs::path network = copy / "appearance" / "current" / "dress" / "model.safetensors";
  flip_last_bit(network);
  for (const ChildResult& refused :
       {draw(copy, "none", {}),
        run_child({program_path(), "evaluate", copy.string(), "--ground-truth", capture().string(),
                   "--stage", "appearance"})}) {
    expect_no(refused, 3, "dress/model.safetensors");
    EXPECT_THAT(refused.err, HasSubstr("run 'atelier appearance' again"));
    EXPECT_EQ(refused.err.find("expected"), refused.err.rfind("expected")) << refused.err;
  }
  // Nor does one whose header is no text any more, or which was cut short.
  const std::string whole = bytes_of(network);
  std::string torn = whole;
  torn[9] ^= 1;  // the first quote
  for (const std::string& bytes : {torn, whole.substr(0, 100), whole.substr(0, whole.size() / 2)}) {
    write_file_atomically(network, bytes);
    const ChildResult refused = draw(copy, "none", {});
    expect_no(refused, 3, "dress/model.safetensors");
    EXPECT_THAT(refused.err, HasSubstr("run 'atelier appearance' again"));
  }
  write_file_atomically(network, whole);
  // So is a mesh of another stage's, with the stage.
  const fs::path mesh = copy / "body" / "current" / "frames" / "000002.h5";
  const std::string sound = bytes_of(mesh);
  fs::remove(mesh);
  expect_no(draw(copy, "none", {}), 3, "000002.h5");
  expect_no(draw(copy, "none", {}), 3, "run 'atelier body' again");
  write_file_atomically(mesh, sound);
  // Of a sound result that is no sequence nobody is told to make it anew.
  const ChildResult folder =
      draw(copy, "none", {"--garment", "dress=" + (copy / "register" / "current").string()});
  expect_no(folder, 3, "one in every frame, as the results of 'body' and 'register'");
  EXPECT_THAT(folder.err, Not(HasSubstr("again")));
  // Without its network a garment is not drawn grey, as a body is.
  fs::remove(network);
  expect_no(draw(copy, "none", {}), 3, "no network");
  // Nor is one left out whose folder is gone.
  fs::remove_all(network.parent_path());
  expect_no(draw(copy, "none", {}), 3, "no network");
}

TEST_F(AppearanceDrawing, GarmentMeshesAsBody_AreRefused) {
  // A body without its network is grey, whatever faces it has.
  const fs::path copy = out("copy");
  fs::copy(workspace(), copy, fs::copy_options::recursive | fs::copy_options::copy_symlinks);
  fs::remove(copy / "appearance" / "current" / "body" / "model.safetensors");
  const fs::path dress = copy / "register" / "current" / "registered" / "dress";
  expect_no(draw(copy, "none", {"--body", dress.string()}), 3,
            "those of dress; expected meshes of the body");
  fs::create_directories(out("other"));
  write_mesh(out("other") / "000001.ply", grid(3, 3));
  const ChildResult other = draw(copy, "other_body", {"--body", out("other").string()});
  EXPECT_EQ(other.exit_code, 0) << other.err;
  EXPECT_THAT(other.out, HasSubstr("warning: --body has 18 triangles, the workspace's body 128"));
}

TEST_F(AppearanceDrawing, BadCamerasAndSizes_AreRefusedBeforeReadingMeshes) {
  const std::vector<std::string> unread = {"--body", out("nowhere").string()};
  const auto refused = [&](std::vector<std::string> more, const char* words) {
    more.insert(more.end(), unread.begin(), unread.end());
    expect_no(draw(workspace(), "none", more), 2, words);
  };
  refused({"--capture", capture().string(), "--camera", "77"}, "no camera '77'");
  refused({"--width", "16384", "--height", "16384"}, "268435456 pixels: at most");
}

TEST_F(AppearanceDrawing, NetworkAsCheckpoint_IsRefusedWithAdvice) {
  const fs::path dress = workspace() / "appearance" / "current" / "dress";
  const ChildResult refused = run_child(
      {network_program().string(), "train", (dress / "data.h5").string(),
       out("x.safetensors").string(), "--checkpoint", (dress / "model.safetensors").string()});
  expect_no(refused, 3, "a finished network", "x.safetensors");
  EXPECT_THAT(refused.err,
              HasSubstr("name another --checkpoint, or give --force to the stage that trains it"));
}

TEST_F(Appearance, OracleNetworks_RenderGroundTruth) {
  ASSERT_EQ(oracle("ws").exit_code, 0);
  const auto draw = [&](const std::string& name, std::vector<std::string> more) {
    more.insert(more.begin(), {program_path(), "render", "--neural", (folder_ / "ws").string(),
                               "--networks", "oracle", "--out", (folder_ / name).string()});
    return run_child(more);
  };
  const std::vector<std::string> camera = {"--capture", capture_.string(), "--camera", "09"};
  const ChildResult done = draw("drawn", camera);
  ASSERT_EQ(done.exit_code, 0) << done.err;
  // Near what the camera took of the cloth, which the grey ball under it is not.
  const ByteImage drawn = read_byte_image(folder_ / "drawn" / "000002.png");
  const ByteImage taken = read_byte_image(capture_ / "images" / "09" / "000002.png");
  const ByteImage labels = read_labels(capture_ / "labels" / "09" / "000002.png");
  double off = 0;
  double count = 0;
  for (std::size_t i = 0; i < labels.data.size(); ++i) {
    if (labels.data[i] == static_cast<std::uint8_t>(Label::Dress)) {
      off += std::abs(drawn.data[3 * i] - taken.data[3 * i]);
      count += 1;
    }
  }
  EXPECT_LT(off / count, 30);
  const ChildResult nowhere = draw("none", {});
  EXPECT_EQ(nowhere.exit_code, 2);
  EXPECT_THAT(nowhere.err, HasSubstr("give --capture and --camera"));
  std::vector<std::string> other = camera;
  other.insert(other.end(), {"--body", folder_.path().string()});
  EXPECT_THAT(draw("none", other).err, HasSubstr("--body and --garment do nothing"));
  fs::resize_file(result("ws", "model.safetensors"), 100);
  const ChildResult torn = draw("none", camera);
  EXPECT_EQ(torn.exit_code, 3);
  EXPECT_THAT(torn.err, HasSubstr("run 'atelier oracle' again"));
  fs::remove_all(folder_ / "ws" / "oracle");
  EXPECT_THAT(draw("none", camera).err, HasSubstr("run 'atelier oracle' first"));
  EXPECT_FALSE(fs::exists(folder_ / "none"));
}

/// A ball in six frames, for `atelier-appearance paint`.
PaintedScene rolling_ball(const Mesh& ball, const Camera& camera) {
  PaintedScene scene;
  scene.layers = {{"ball", "", {0.5F, 0.2F, 0.1F}, ball.faces}};
  scene.cameras = {camera};
  for (int f = 0; f < 6; ++f) {
    Points vertices = ball.vertices;
    vertices.col(0).array() += 0.02 * f;
    scene.frame_ids.push_back(f);
    scene.vertices.push_back({vertices});
  }
  return scene;
}

TEST_F(Appearance, PainterAhead_WaitsUntilImagesAreTaken) {
  const fs::path scene = folder_ / "scene.h5";
  write_archive(scene, archive_of(rolling_ball(ball(), camera_of(2))));
  const auto paint = [&](const char* folder, const char* ahead) {
    fs::create_directories(folder_ / folder);
    return std::vector<std::string>{network_program().string(),  "paint",   scene.string(),
                                    (folder_ / folder).string(), "--ahead", ahead};
  };
  ChildProcess two(paint("two", "2"));
  const auto picture = [&](int f) { return folder_ / "two" / (digits(f) + ".h5"); };
  for (int f = 0; f < 6; ++f) {
    while (!fs::exists(picture(std::min(f + 1, 5))) && !two.has_ended()) {
      std::this_thread::yield();
    }
    EXPECT_TRUE(fs::exists(picture(f)));
    EXPECT_FALSE(fs::exists(picture(f + 2))) << "two lie there already";
    fs::remove(picture(f));
  }
  EXPECT_EQ(two.wait().exit_code, 0);
  // One that waits can be told to end; one that is not told to wait does not.
  ChildProcess one(paint("one", "1"));
  while (!fs::exists(folder_ / "one" / "000000.h5") && !one.has_ended()) {
    std::this_thread::yield();
  }
  one.kill(SIGTERM);
  EXPECT_EQ(one.wait().exit_code, 4);
  EXPECT_EQ(run_child(paint("all", "0")).exit_code, 0);
  EXPECT_TRUE(fs::exists(folder_ / "all" / "000000.h5"));
  EXPECT_TRUE(fs::exists(folder_ / "all" / "000005.h5"));
}

TEST_F(Appearance, VideoOfOtherFormat_IsRefused) {
  for (const char* name : {"p.avi", "p.gif", "p.png"}) {
    const ChildResult refused =
        run_child({program_path(), "render", "--neural", (folder_ / "any").string(), "--out",
                   (folder_ / name).string()});
    EXPECT_EQ(refused.exit_code, 2) << name;
    EXPECT_THAT(refused.err, HasSubstr("a folder or a video .mp4"));
    EXPECT_FALSE(fs::exists(folder_ / name));
  }
}

TEST_F(Appearance, WorkspaceWithoutNetworks_IsRefused) {
  fs::create_directories(folder_ / "empty");
  const ChildResult refused =
      run_child({program_path(), "render", "--neural", (folder_ / "empty").string(), "--out",
                 (folder_ / "out").string()});
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("run 'atelier appearance' first"));
  EXPECT_FALSE(fs::exists(folder_ / "out"));
  const ChildResult nowhere =
      run_child({program_path(), "render", "--neural", (folder_ / "nowhere").string(), "--out",
                 (folder_ / "out").string()});
  EXPECT_EQ(nowhere.exit_code, 3);
  EXPECT_THAT(nowhere.err, HasSubstr("nowhere: no folder; expected a workspace"));
}

}  // namespace
}  // namespace atelier::fixtures

#endif
