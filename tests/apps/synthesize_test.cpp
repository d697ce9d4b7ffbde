// A small synthetic capture: whole, private, repeatable, and its ground truth agrees with itself.
#ifdef ATELIER_HAS_CAPTURE

#include <cmath>
#include <fstream>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/stat.h>

#include "capture/capture_info.h"
#include "capture/capture_measures.h"
#include "capture/detector.h"
#include "capture/garment_fabric.h"
#include "capture/label_taxonomy.h"
#include "core/archive.h"
#include "core/error.h"
#include "core/io/cameras_file.h"
#include "core/io/file_bytes.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/image_file.h"
#include "core/io/npz.h"
#include "core/raster.h"
#include "core/sha256.h"
#include "core/tensor.h"
#include "tests/support/child_process.h"
#include "tests/support/flags.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::vector<std::string> small(const fs::path& out, std::vector<std::string> more = {}) {
  std::vector<std::string> command = {program_path(), "synthesize", out.string()};
  const std::vector<std::string> sizes = {"--dome.cameras",
                                          "2",
                                          "--dome.width",
                                          "240",
                                          "--dome.height",
                                          "320",
                                          "--frames",
                                          "2",
                                          "--minimal_frames",
                                          "1",
                                          "--held_out_cameras",
                                          "0",
                                          "--edge_length",
                                          "0.05",
                                          "--substeps",
                                          "6",
                                          "--fabric.resolution",
                                          "256",
                                          "--start",
                                          "0",
                                          "--skin_resolution",
                                          "256",
                                          "--samples",
                                          "2",
                                          "--ground_truth_maps",
                                          "true",
                                          "--light-samples",
                                          "6"};
  more = fixtures::with_usual(sizes, more);
  command.insert(command.end(), more.begin(), more.end());
  return command;
}

/// Digest of every file by its path.
std::map<std::string, std::string> digests(const fs::path& folder) {
  std::map<std::string, std::string> result;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) {
      const std::vector<std::byte> bytes = read_file_bytes(entry.path(), 1 << 28);
      Sha256 hash;
      hash.update(bytes.data(), bytes.size());
      result[fs::relative(entry.path(), folder).string()] = hex(hash.finish());
    }
  }
  return result;
}

/// One capture for all tests of this file.
class Synthesize : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryDirectory;
    result_ = new ChildResult(run_child(small(capture())));
  }
  static void TearDownTestSuite() {
    delete folder_;
    delete result_;
  }
  void SetUp() override { ASSERT_EQ(result_->exit_code, 0) << result_->err; }
  static fs::path capture() { return folder_->path() / "capture"; }

  static TemporaryDirectory* folder_;
  static ChildResult* result_;
};

TemporaryDirectory* Synthesize::folder_ = nullptr;
ChildResult* Synthesize::result_ = nullptr;

TEST_F(Synthesize, Capture_IsCompleteAndPrivate) {
  const CaptureInfo info = read_capture_info(capture());
  EXPECT_EQ(info.sequences.size(), 2U);
  EXPECT_TRUE(info.synthetic);
  EXPECT_FALSE(fs::exists(capture() / ".unfinished"));
  for (const Camera& camera : read_cameras(capture())) {
    for (const int id : {0, 1, 2}) {
      const std::string name = frame_name(id);
      const ByteImage image = read_byte_image(capture() / "images" / camera.id / (name + ".png"));
      EXPECT_EQ(image.width, 240);
      EXPECT_EQ(image.height, 320);
      EXPECT_TRUE(fs::exists(capture() / "keypoints2d" / camera.id / (name + ".json")));
      EXPECT_TRUE(fs::exists(capture() / "labels" / camera.id / (name + ".png")));
    }
  }
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(capture())) {
    struct stat status {};
    ASSERT_EQ(stat(entry.path().c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, entry.is_directory() ? 0700U : 0600U) << entry.path();
  }
}

TEST_F(Synthesize, GroundTruth_IsSelfConsistent) {
  const GroundTruth truth = read_ground_truth(capture());
  ASSERT_EQ(truth.garments.size(), 1U);
  for (const int id : {0, 1, 2}) {
    const GroundTruthFrame frame = read_ground_truth_frame(capture(), truth, id);
    for (std::size_t c = 0; c < truth.cameras.size(); ++c) {
      const Camera& camera = truth.cameras[c];
      const std::string name = frame_name(id);
      const ByteImage labels =
          read_labels(capture() / "truth/labels" / camera.id / (name + ".png"));
      const Archive maps = read_archive(capture() / "truth/maps" / camera.id / (name + ".h5"),
                                        "atelier.truth.maps", 1);
      const std::span<const float> depth = values_of<float>(maps.datasets.at("depth"));
      // Joints project onto the person.
      int on_person = 0;
      for (Index j = 0; j < frame.joints.rows(); ++j) {
        const auto pixel = project(camera, frame.joints.row(j).transpose());
        ASSERT_TRUE(pixel.has_value());
        on_person += labels.at(std::clamp(static_cast<int>(pixel->x()), 0, camera.width - 1),
                               std::clamp(static_cast<int>(pixel->y()), 0, camera.height - 1)) != 0
                         ? 1
                         : 0;
      }
      EXPECT_GE(on_person, frame.joints.rows() * 9 / 10);
      // Vertices that are seen have the depth of their pixel, within what a pixel spans.
      const auto expect_seen = [&](const Points& vertices, const ByteImage& sees) {
        ASSERT_EQ(sees.width, vertices.rows());
        ASSERT_EQ(sees.height, static_cast<int>(truth.cameras.size()));
        int seen = 0;
        int agree = 0;
        for (Index v = 0; v < vertices.rows(); ++v) {
          if (sees.at(static_cast<int>(v), static_cast<int>(c)) == 0) {
            continue;
          }
          const auto pixel = project(camera, vertices.row(v).transpose());
          ASSERT_TRUE(pixel.has_value());
          const double z = camera_from_world(camera, vertices.row(v).transpose()).z();
          ++seen;
          // A pixel spans 8 mm here: the vertex's own, or one beside it at an outline.
          bool agrees = false;
          for (int j = -1; j <= 1; ++j) {
            for (int i = -1; i <= 1; ++i) {
              const int x = std::clamp(static_cast<int>(pixel->x()) + i, 0, camera.width - 1);
              const int y = std::clamp(static_cast<int>(pixel->y()) + j, 0, camera.height - 1);
              const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) +
                              static_cast<std::size_t>(x);
              agrees = agrees || std::abs(depth[at] - z) < 0.04;
            }
          }
          agree += agrees ? 1 : 0;
        }
        EXPECT_GT(seen, 200);
        EXPECT_LT(seen, vertices.rows());
        EXPECT_GT(agree, 0.97 * seen);
      };
      expect_seen(frame.body, frame.body_seen);
      if (frame.garments[0].rows() > 0) {
        expect_seen(frame.garments[0], frame.garments_seen[0]);
      }
      // Labels and depth tell the same pixels apart from the background.
      for (std::size_t p = 0; p < labels.data.size(); ++p) {
        ASSERT_EQ(labels.data[p] != 0, depth[p] > 0);
      }
      // Where another renderer draws the body and cloth, the labels do.
      const Raster cloth =
          frame.garments[0].rows() > 0
              ? rasterize(frame.garments[0], truth.garments[0].garment.mesh.faces, camera)
              : Raster{};
      int drawn = 0;
      int labelled = 0;
      for (std::size_t p = 0; p < cloth.face.data.size(); ++p) {
        if (cloth.face.data[p] >= 0) {
          ++drawn;
          labelled += labels.data[p] != 0 ? 1 : 0;
        }
      }
      EXPECT_GE(labelled, 0.97 * drawn);
    }
  }
}

/// Redness of the dress as a camera sees it and as its albedo says at the surface map's uvs, both
/// as means over 3x3 pixels: one pixel is a texel wide here, so that single ones alias. Only where
/// all nine are cloth of one piece that faces the camera: at a slant gloss and sheen, which have
/// the lamps' colour, outweigh the cloth's. `shift` displaces the lookup, in uv.
struct Redness {
  std::vector<double> seen, looked_up;
};

Redness redness_of_dress(const fs::path& capture, const Camera& camera, double shift) {
  const Image light = read_image(capture / "truth/images" / camera.id / "000000.png");
  const Image albedo = read_image(capture / "truth/albedo/dress.png");
  const ByteImage labels = read_labels(capture / "truth/labels" / camera.id / "000000.png");
  const Archive maps =
      read_archive(capture / "truth/maps" / camera.id / "000000.h5", "atelier.truth.maps", 1);
  const std::span<const float> uv = values_of<float>(maps.datasets.at("uv"));
  const std::span<const float> normal = values_of<float>(maps.datasets.at("normal"));
  const Eigen::Vector3d forward = camera.camera_from_world_rotation.row(2).transpose();
  const auto redness = [](const float* c) { return c[0] / (c[0] + c[1] + c[2] + 1e-4F); };
  Redness result;
  for (int y = 1; y + 1 < camera.height; ++y) {
    for (int x = 1; x + 1 < camera.width; ++x) {
      const std::size_t middle = static_cast<std::size_t>(y) * camera.width + x;
      double seen = 0;
      double looked_up = 0;
      bool whole = true;
      for (int k = 0; k < 9 && whole; ++k) {
        const auto p = static_cast<std::size_t>((y + k / 3 - 1) * camera.width + x + k % 3 - 1);
        const Eigen::Vector3d n(normal[3 * p], normal[3 * p + 1], normal[3 * p + 2]);
        whole = labels.data[p] == static_cast<std::uint8_t>(Label::Dress) &&
                n.dot(forward) < -0.5 &&
                std::hypot(uv[2 * p] - uv[2 * middle], uv[2 * p + 1] - uv[2 * middle + 1]) < 0.04;
        const int u = std::clamp(static_cast<int>((uv[2 * p] + shift) * 256), 0, 255);
        const int v = std::clamp(static_cast<int>((1 - uv[2 * p + 1]) * 256), 0, 255);
        seen += redness(&light.data[3 * p]) / 9;
        looked_up += redness(&albedo.at(u, v)) / 9;
      }
      if (whole) {
        result.seen.push_back(seen);
        result.looked_up.push_back(looked_up);
      }
    }
  }
  return result;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const auto n = static_cast<Index>(a.size());
  const Eigen::Map<const Eigen::ArrayXd> x(a.data(), n);
  const Eigen::Map<const Eigen::ArrayXd> y(b.data(), n);
  const Eigen::ArrayXd dx = x - x.mean();
  const Eigen::ArrayXd dy = y - y.mean();
  return (dx * dy).sum() / std::sqrt(dx.square().sum() * dy.square().sum());
}

TEST_F(Synthesize, UvLookup_GivesTheImageColor) {
  // Hue and not brightness: light differs from place to place, the cloth's redness does not.
  const Camera camera = read_ground_truth(capture()).cameras[0];
  const Redness right = redness_of_dress(capture(), camera, 0);
  ASSERT_GT(right.seen.size(), 300U);
  const double agree = correlation(right.seen, right.looked_up);
  RecordProperty("correlation", std::to_string(agree));
  EXPECT_GT(agree, 0.9);
  // And a lookup that misses by four texels, two flowers' radius, does not agree.
  const Redness wrong = redness_of_dress(capture(), camera, 4.0 / 256);
  RecordProperty("displaced", std::to_string(correlation(wrong.seen, wrong.looked_up)));
  EXPECT_LT(correlation(wrong.seen, wrong.looked_up), 0.5);
}

TEST_F(Synthesize, Cloth_IsOutsideTheBodyWithEqualSeams) {
  std::map<std::string, double> values;
  for (const Measure& measure : measure_capture(capture())) {
    values[measure.key] = measure.value;
  }
  EXPECT_LE(values.at("capture.cloth_depth_mm"), 0.1);
  EXPECT_LE(values.at("capture.seam_mismatch"), 0.003);
  EXPECT_NEAR(values.at("capture.calibration_px"), 0.2 * 320 / 1000, 0.002);
  EXPECT_GT(values.at("capture.label_miou"), 0.7);
  EXPECT_LT(values.at("capture.label_miou"), 1);
  EXPECT_GT(values.at("capture.keypoint_found"), 0.5);
}

TEST_F(Synthesize, Evaluate_PrintsAndChecksFigures) {
  const ChildResult printed = run_child({program_path(), "evaluate", capture().string(),
                                         "--ground-truth", capture().string(), "--json"});
  EXPECT_EQ(printed.exit_code, 0) << printed.err;
  EXPECT_THAT(printed.out, HasSubstr("capture.seam_mismatch"));
  EXPECT_EQ(
      run_child({program_path(), "evaluate", "/nowhere", "--ground-truth", capture().string()})
          .exit_code,
      3);
  // Another folder that is no workspace holds no results to measure.
  const ChildResult truth = run_child({program_path(), "evaluate", (capture() / "truth").string(),
                                       "--ground-truth", capture().string()});
  EXPECT_EQ(truth.exit_code, 3);
  EXPECT_THAT(truth.err, HasSubstr("expected a workspace"));
}

TEST_F(Synthesize, OtherLayouts_AreReadBack) {
  for (const std::string layout :
       {"easymocap", "colmap", "panoptic", "dna", "actorshq", "nerfstudio"}) {
    // The capture is whole: the same command adds the layout.
    const ChildResult added = run_child(small(capture(), {"--layout", layout}));
    ASSERT_EQ(added.exit_code, 0) << layout << ": " << added.err;
    EXPECT_FALSE(fs::exists(capture() / ("." + layout + ".unfinished")));
    for (const char* sequence : {"clothed", "minimal"}) {
      const fs::path folder = capture() / layout / sequence;
      EXPECT_THAT(added.out, HasSubstr(folder.string()));
      const ChildResult opened = run_child({program_path(), "validate", folder.string()});
      EXPECT_EQ(opened.exit_code, 0) << layout << ": " << opened.out << opened.err;
      EXPECT_THAT(opened.out, HasSubstr("2 cameras")) << layout;
    }
    fs::remove_all(capture() / layout);
  }
}

TEST_F(Synthesize, InterruptedLayout_IsWrittenAgain) {
  const fs::path unfinished = capture() / ".easymocap.unfinished";
  fs::create_directories(unfinished / "clothed");
  std::ofstream(unfinished / "clothed" / "half.txt") << "x";
  const ChildResult added = run_child(small(capture(), {"--layout", "easymocap"}));
  EXPECT_EQ(added.exit_code, 0) << added.err;
  EXPECT_FALSE(fs::exists(unfinished));
  EXPECT_FALSE(fs::exists(capture() / "easymocap" / "clothed" / "half.txt"));
  EXPECT_TRUE(fs::exists(capture() / "easymocap" / "clothed" / "intri.yml"));
  fs::remove_all(capture() / "easymocap");
}

TEST_F(Synthesize, ResimulatedSubject_JudgesTheNetworks) {
  if (!fs::exists(fs::path(program_path()).parent_path() / "atelier-appearance")) {
    GTEST_SKIP() << "built without libtorch";
  }
  const TemporaryDirectory root;
  const fs::path held = root / "capture";
  fs::copy(capture(), held, fs::copy_options::recursive);
  CaptureInfo info = read_capture_info(held);
  info.held_out_cameras = {read_cameras(held).back().id};
  info.held_out_frames = {1};
  std::ofstream(held / "capture.toml") << capture_toml(info);
  const auto train = [&](const std::string& body) {
    const ChildResult trained = run_child(
        {program_path(), "oracle", held.string(), (root / "ws").string(), "--resolution", "64",
         "--channels", "2", "--iterations", "10", "--occlusion.strata", "3", "--body", body});
    ASSERT_EQ(trained.exit_code, 0) << trained.err;
  };
  train("true");
  EXPECT_TRUE(fs::exists(root / "ws" / "oracle" / "current" / "body" / "model.safetensors"));
  const auto figures = [&] {
    const ChildResult result = run_child({program_path(), "evaluate", (root / "ws").string(),
                                          "--ground-truth", held.string(), "--stage", "oracle"});
    EXPECT_THAT(result.exit_code, ::testing::AnyOf(0, 1)) << result.err;
    return result.out;
  };
  const std::string first = figures();
  const auto value = [&](const std::string& key) {
    const std::size_t line = first.find(key);
    return line == std::string::npos ? -1 : std::stod(first.substr(line + key.size()));
  };
  // The network knows as much of one motion as of the other: a scene that is shifted, or lit or
  // exposed otherwise than the capture's, would be far off.
  EXPECT_GT(value("oracle.psnr_db"), 10) << first;
  EXPECT_NEAR(value("oracle.simulated_psnr_db"), value("oracle.psnr_db"), 1.5) << first;
  EXPECT_THAT(first, HasSubstr("a simulated motion that the capture does not show: stride"));
  // What does not say how it was made cannot be played again; the rest is measured as before.
  fs::remove(held / "synthesis.json");
  EXPECT_THAT(figures(), HasSubstr("oracle: not measured: outdated: input capture changed"));
  train("false");
  const std::string without = figures();
  EXPECT_THAT(without, HasSubstr("oracle.psnr_db"));
  EXPECT_THAT(without, ::testing::Not(HasSubstr("simulated")));
}

TEST_F(Synthesize, PerfectCapture_HasNoError) {
  const fs::path out = folder_->path() / "perfect";
  const ChildResult result =
      run_child(small(out, {"--perfect", "true", "--frames", "0", "--ground_truth_maps", "false"}));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  std::map<std::string, double> values;
  for (const Measure& measure : measure_capture(out)) {
    values[measure.key] = measure.value;
  }
  EXPECT_LT(values.at("capture.calibration_px"), 1e-9);
  EXPECT_LT(values.at("capture.keypoint_median_px"), 0.01);
  EXPECT_EQ(values.at("capture.keypoint_found"), 1);
  EXPECT_EQ(values.at("capture.label_miou"), 1);
  const GroundTruth truth = read_ground_truth(out);
  for (const Camera& camera : truth.cameras) {
    EXPECT_EQ(camera.gain, Eigen::Vector3d::Ones());
    // Without noise the image is the noise-free one.
    const std::string name = frame_name(0) + ".png";
    EXPECT_EQ(read_byte_image(out / "images" / camera.id / name).data,
              read_byte_image(out / "truth/images" / camera.id / name).data);
  }
  // The shot, the rig and the calibration alone, where the rest is to stay.
  const GroundTruth noisy = read_ground_truth(capture());
  EXPECT_NE(noisy.cameras[0].gain, Eigen::Vector3d(Eigen::Vector3d::Ones()));
}

void expect_same_files(const fs::path& found_in, const fs::path& expected_in) {
  const std::map<std::string, std::string> expected = digests(expected_in);
  const std::map<std::string, std::string> found = digests(found_in);
  EXPECT_EQ(found.size(), expected.size());
  for (const auto& [file, digest] : expected) {
    EXPECT_TRUE(found.contains(file) && found.at(file) == digest) << file;
  }
}

TEST_F(Synthesize, OneThread_GivesIdenticalBytes) {
  cpu_set_t all;
  ASSERT_EQ(sched_getaffinity(0, sizeof(all), &all), 0);
  if (CPU_COUNT(&all) < 2) {
    GTEST_SKIP() << "one processor: the capture was made on one thread";
  }
  int first = 0;
  while (!CPU_ISSET(first, &all)) {
    ++first;
  }
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(first, &one);
  ASSERT_EQ(sched_setaffinity(0, sizeof(one), &one), 0);  // the program counts what it may use
  const ChildResult result = run_child(small(folder_->path() / "one_thread"));
  ASSERT_EQ(sched_setaffinity(0, sizeof(all), &all), 0);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  expect_same_files(folder_->path() / "one_thread", capture());
}

TEST_F(Synthesize, KilledRun_ResumesWithIdenticalBytes) {
  const fs::path other = folder_->path() / "killed";
  {
    // Killed as soon as the second clothed frame is being simulated.
    ChildProcess child(small(other));
    for (int i = 0; i < 60000 && !fs::exists(other / ".unfinished/state.h5"); ++i) {
      usleep(1000);
    }
    child.kill(SIGKILL);
    child.wait();
  }
  ASSERT_FALSE(fs::exists(other / "capture.toml")) << "it was finished before it was killed";
  EXPECT_THROW(read_capture_info(other), DataError);
  {
    // And again among the photographs.
    ChildProcess child(small(other));
    const fs::path photographed = other / "truth/frames/000000.h5";
    for (int i = 0; i < 60000 && !fs::exists(photographed); ++i) {
      usleep(1000);
    }
    child.kill(SIGKILL);
    child.wait();
  }
  const ChildResult result = run_child(small(other));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  expect_same_files(other, capture());
}

/// A sequence of meshes as other programs write it.
void write_obj(const fs::path& file, const Points& vertices, const Triangles& faces) {
  fs::create_directories(file.parent_path());
  std::ofstream out(file);
  out.precision(9);
  for (Index v = 0; v < vertices.rows(); ++v) {
    out << "v " << vertices.row(v) << "\n";
  }
  for (Index f = 0; f < faces.rows(); ++f) {
    out << "f " << (faces.row(f).array() + 1) << "\n";
  }
}

TEST_F(Synthesize, ForeignMeshSequences_AreAccepted) {
  const GroundTruth truth = read_ground_truth(capture());
  for (const int id : {0, 1}) {
    const GroundTruthFrame frame = read_ground_truth_frame(capture(), truth, id);
    const std::string name = "frame" + std::to_string(id) + ".obj";
    write_obj(folder_->path() / "bodies" / name, frame.body, truth.body.faces);
    write_obj(folder_->path() / "cloths" / name, frame.garments[0],
              truth.garments[0].garment.mesh.faces);
  }
  const fs::path out = folder_->path() / "from_files";
  const std::string bodies = (folder_->path() / "bodies").string();
  const std::string cloths = (folder_->path() / "cloths").string();
  const ChildResult result =
      run_child(small(out, {"--body_sequence", bodies, "--cloth_sequence", cloths, "--shutter",
                            "0.02", "--dome.width", "60", "--dome.height", "80"}));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const GroundTruth taken = read_ground_truth(out);
  ASSERT_EQ(taken.garments.size(), 1U);
  EXPECT_EQ(taken.garments[0].label, Label::Dress);
  const GroundTruthFrame frame = read_ground_truth_frame(out, taken, 1);
  EXPECT_EQ(frame.garments[0].rows(), truth.garments[0].garment.mesh.vertices.rows());
  const std::string camera = taken.cameras[0].id;
  EXPECT_TRUE(fs::exists(out / "images" / camera / "000001.png"));

  const ChildResult longer =
      run_child(small(folder_->path() / "longer",
                      {"--body_sequence", bodies, "--cloth_sequence", cloths, "--frames", "3"}));
  EXPECT_EQ(longer.exit_code, 3);
  EXPECT_THAT(longer.err, HasSubstr("2 frames"));
}

TEST_F(Synthesize, FolderOfOtherOptionsOrContent_IsRefused) {
  const ChildResult other = run_child(small(capture(), {"--seed", "2"}));
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.err, HasSubstr("other options"));
  fs::create_directories(folder_->path() / "full");
  std::ofstream(folder_->path() / "full" / "letter.txt") << "x";
  const ChildResult full = run_child(small(folder_->path() / "full"));
  EXPECT_EQ(full.exit_code, 2);
  EXPECT_THAT(full.err, HasSubstr("letter.txt"));
  EXPECT_TRUE(fs::exists(folder_->path() / "full" / "letter.txt"));
  EXPECT_FALSE(fs::exists(folder_->path() / "full" / ".lock"));
  EXPECT_FALSE(fs::exists(capture() / ".lock"));
}

TEST_F(Synthesize, InterruptedCapture_IsNotACapture) {
  const fs::path half = folder_->path() / "half";
  fs::copy(capture(), half, fs::copy_options::recursive);
  fs::remove(half / "capture.toml");
  const ChildResult opened = run_child({program_path(), "validate", half.string()});
  EXPECT_EQ(opened.exit_code, 3);
  EXPECT_THAT(opened.err, HasSubstr("interrupted"));
}

TEST(GarmentFabric, TrousersUnderAPrint_AreWovenUnlessAllIsPrinted) {
  std::vector<GroundTruthGarment> worn(2);
  worn[0].label = Label::Upper;
  worn[1].label = Label::Lower;
  const auto kind = [&](FabricKind outfit, std::size_t garment) {
    return garment_fabric({.kind = outfit}, worn, garment).kind;
  };
  EXPECT_EQ(kind(FabricKind::Print, 0), FabricKind::Print);
  EXPECT_EQ(kind(FabricKind::Print, 1), FabricKind::Woven);
  EXPECT_EQ(kind(FabricKind::AllPrint, 0), FabricKind::Print);
  EXPECT_EQ(kind(FabricKind::AllPrint, 1), FabricKind::Print);
  EXPECT_NE(garment_fabric({}, worn, 0).hue, garment_fabric({}, worn, 1).hue);
}

TEST(SynthesizeRefuses, ImpossibleOptions_AreRefused) {
  const TemporaryDirectory folder;
  const auto refused = [&](std::vector<std::string> more, int code, const char* words) {
    for (const char* planned : {"", "--dry-run"}) {
      if (*planned != '\0') {
        more.emplace_back(planned);
      }
      const ChildResult result = run_child(small(folder.path() / "out", more));
      EXPECT_EQ(result.exit_code, code) << planned << result.err;
      EXPECT_THAT(result.err, HasSubstr(words)) << planned;
      EXPECT_FALSE(fs::exists(folder.path() / "out"));
    }
  };
  refused({"--frames", "0", "--minimal_frames", "0"}, 2, "the capture would be empty");
  refused({"--dome.cameras", "1"}, 2, "dome.cameras");
  refused({"--dome.pairs", "true", "--dome.cameras", "3"}, 2, "posts");
  refused({"--held_out_cameras", "1"}, 2, "held-out-cameras");
  refused({"--dome.width", "16384", "--dome.height", "16384"}, 2, "64 million");
  refused({"--shutter", "0.19"}, 2, "longer than a frame");
  refused({"--cloth_sequence", "x.npz"}, 2, "body-sequence");
  refused({"--garment", "cape"}, 2, "--garment cannot be 'cape'");
  refused({"--garment", "tee+tee"}, 2, "twice");
  refused({"--garment", "tee+cape"}, 2, "--garment cannot be 'cape'");
  refused({"--motion", "cartwheel"}, 2, "stride, squat");
  refused({"--motion", "strid"}, 2, "did you mean 'stride'?");
  refused({"--garment", "nowhere.json"}, 3, "nowhere.json");
  refused({"--motion", "nowhere.bvh"}, 3, "nowhere.bvh");
  refused({"--minimal_frames", "0", "--start", "3"}, 2, "--start cannot be '3': of ");
  refused({"--body", "nowhere.npz"}, 3, "nowhere.npz");
  refused({"--body_sequence", "nowhere.npz"}, 3, "nowhere.npz");
  const std::string npz = (folder / "frames.npz").string();
  const auto numbered = [&](const std::vector<int>& ids) {
    write_npz(npz, {{"vertices", tensor_of(std::vector<float>(27, 0.f), {3, 3, 3})},
                    {"faces", tensor_of(std::vector<int>{0, 1, 2}, {1, 3})},
                    {"frame_ids", tensor_of(ids, {static_cast<std::int64_t>(ids.size())})}});
  };
  for (const std::vector<int>& ids : {std::vector<int>{0, 0, 1}, {0, 2, 1}, {-1, 0, 1}, {0, 1}}) {
    numbered(ids);
    refused({"--body_sequence", npz}, 3, "frames.npz: frame_ids");
  }
  numbered({4, 5, 9});
  refused({"--body_sequence", npz}, 3, "tall along y");  // its numbers are good
  write_npz(
      npz, {{"vertices", tensor_of(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1.7F, 0.2F}, {1, 3, 3})},
            {"faces", tensor_of(std::vector<int>{0, 1, 2}, {1, 3})},
            {"labels", tensor_of(std::vector<int>{0, 0, 0}, {3})}});
  refused({"--body_sequence", npz}, 3, "labels: nothing but 0, the background");
}

TEST(SynthesizeRefuses, GarmentThatCannotBeWorn_IsRefused) {
  // A tube of 30 cm round, where the body is a metre.
  const TemporaryDirectory folder;
  const fs::path pattern = folder.path() / "tube.json";
  std::ofstream(pattern) << R"({"properties": {"curvature_coords": "relative",
      "units_in_meter": 100}, "pattern": {"panels": {
      "front": {"translation": [-7.5, -25, 20], "rotation": [0, 0, 0],
        "vertices": [[0, 0], [15, 0], [15, 30], [0, 30]], "edges": [{"endpoints": [0, 1]},
        {"endpoints": [1, 2]}, {"endpoints": [2, 3]}, {"endpoints": [3, 0]}]},
      "back": {"translation": [-7.5, -25, -20], "rotation": [0, 0, 0],
        "vertices": [[0, 0], [15, 0], [15, 30], [0, 30]], "edges": [{"endpoints": [0, 1]},
        {"endpoints": [1, 2]}, {"endpoints": [2, 3]}, {"endpoints": [3, 0]}]}},
      "stitches": [[{"panel": "front", "edge": 1}, {"panel": "back", "edge": 1}],
                   [{"panel": "front", "edge": 3}, {"panel": "back", "edge": 3}]]}})";
  const fs::path out = folder.path() / "out";
  const ChildResult result = run_child(small(out, {"--garment", pattern.string()}));
  EXPECT_EQ(result.exit_code, 3) << result.err;
  EXPECT_THAT(result.err, HasSubstr("tube"));
  EXPECT_THAT(result.err, HasSubstr("expected"));  // says what would do instead
  EXPECT_FALSE(fs::exists(out / "capture.toml"));
  EXPECT_FALSE(fs::exists(out / "images"));
}

TEST(SynthesizeRefuses, UnwritablePlaces_AreRefused) {
  const TemporaryDirectory folder;
  std::ofstream(folder.path() / "file") << "x";
  const ChildResult below_a_file = run_child(small(folder.path() / "file" / "capture"));
  EXPECT_EQ(below_a_file.exit_code, 5) << below_a_file.err;
  EXPECT_THAT(below_a_file.err, HasSubstr((folder.path() / "file").string()));
  const ChildResult on_a_file = run_child(small(folder.path() / "file"));
  EXPECT_NE(on_a_file.exit_code, 0);
  EXPECT_THAT(on_a_file.err, HasSubstr((folder.path() / "file").string()));
  // Where even root may not write.
  const ChildResult read_only = run_child(small("/proc/atelier_capture"));
  EXPECT_EQ(read_only.exit_code, 5) << read_only.err;
  EXPECT_THAT(read_only.err, HasSubstr("/proc/atelier_capture"));
}

TEST(SynthesizeRefuses, FullDisk_LeavesNoApparentlyCompleteCapture) {
  const TemporaryDirectory folder;
  const std::string disk = (folder.path() / "disk").string();
  fs::create_directories(disk);
  if (mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=500k") != 0) {
    GTEST_SKIP() << "mounting is not allowed here";
  }
  const ChildResult result = run_child(small(fs::path(disk) / "capture"));
  EXPECT_EQ(result.exit_code, 5) << result.err;
  EXPECT_THAT(result.err, HasSubstr(disk));
  EXPECT_FALSE(fs::exists(fs::path(disk) / "capture" / "capture.toml"));
  umount2(disk.c_str(), MNT_DETACH);
}

}  // namespace
}  // namespace atelier::fixtures

#endif
