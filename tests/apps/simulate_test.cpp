#include <Eigen/Core>
#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/device.h"
#include "core/io/file_bytes.h"
#include "core/io/image_file.h"
#include "core/io/mesh_file.h"
#include "tests/support/child_process.h"
#include "tests/support/flags.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using fixtures::ChildResult;
using fixtures::run_child;
using ::testing::HasSubstr;

/// A square of cloth over a pyramid, in files.
class Simulate : public ::testing::Test {
 protected:
  void SetUp() override {
    if (run({"simulate", "--help"}).out.find("--garment") == std::string::npos) {
      GTEST_SKIP() << "built without simulate";
    }
    std::filesystem::create_directories(scene());
    write_cloth(scene() / "garment.obj", 6, 0.05);
    write_body(scene() / "body.obj", 0);
  }

  std::filesystem::path scene() const { return root_.path() / "scene"; }
  std::filesystem::path out() const { return root_.path() / "out"; }

  static void write_cloth(const std::filesystem::path& path, int cells, double size) {
    std::ofstream file(path);
    const int n = cells + 1;
    for (int r = 0; r < n; ++r) {
      for (int c = 0; c < n; ++c) {
        file << "v " << (c - cells / 2.0) * size << " 0.32 " << (r - cells / 2.0) * size << "\n";
      }
    }
    for (int r = 0; r < cells; ++r) {
      for (int c = 0; c < cells; ++c) {
        const int a = r * n + c + 1;
        file << "f " << a << " " << a + n << " " << a + n + 1 << "\n";
        file << "f " << a << " " << a + n + 1 << " " << a + 1 << "\n";
      }
    }
  }
  static void write_body(const std::filesystem::path& path, double x) {
    std::ofstream file(path);
    file << "v " << x << " 0.3 0\n";
    for (const auto& [cx, cz] :
         {std::pair(-1, -1), std::pair(1, -1), std::pair(1, 1), std::pair(-1, 1)}) {
      file << "v " << x + 0.3 * cx << " 0 " << 0.3 * cz << "\n";
    }
    file << "f 1 3 2\nf 1 4 3\nf 1 5 4\nf 1 2 5\nf 2 3 4\nf 2 4 5\n";
  }

  /// A sheet that hangs from its upper edge, far from the body that it is tied to.
  static void write_hanging(const std::filesystem::path& path) {
    std::ofstream file(path);
    for (int r = 0; r < 6; ++r) {
      for (int c = 0; c < 4; ++c) {
        file << "v " << 0.5 + 0.08 * c << " " << 1 - 0.08 * r << " 0\n";
      }
    }
    for (int r = 0; r < 5; ++r) {
      for (int c = 0; c < 3; ++c) {
        const int a = 4 * r + c + 1;
        file << "f " << a << " " << a + 4 << " " << a + 5 << "\nf " << a << " " << a + 5 << " "
             << a + 1 << "\n";
      }
    }
  }

  static ChildResult run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), fixtures::program_path());
    return run_child(arguments);
  }
  ChildResult alone(std::vector<std::string> more) const {
    std::filesystem::remove_all(out());  // of a run before: a folder has to be new
    std::vector<std::string> all{"simulate", "--garment",    (scene() / "garment.obj").string(),
                                 "--out",    out().string(), "--no-pictures"};
    more = fixtures::with_usual({"--settle", "5"}, more);
    all.insert(all.end(), more.begin(), more.end());
    return run(all);
  }
  ChildResult on_body(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"--body", (scene() / "body.obj").string()});
    return alone(std::move(more));
  }
  ChildResult stage(const std::string& workspace, std::vector<std::string> more = {}) const {
    std::vector<std::string> all{"simulate", scene().string(), (root_.path() / workspace).string()};
    more = fixtures::with_usual({"--settle", "6"}, more);
    all.insert(all.end(), more.begin(), more.end());
    return run(all);
  }
  std::string bytes(const std::string& workspace, const std::string& name) const {
    for (const auto& entry :
         std::filesystem::recursive_directory_iterator(root_.path() / workspace)) {
      if (entry.path().string().ends_with(name)) {
        return read_file_text(entry.path(), 1 << 24);
      }
    }
    return "";
  }

  fixtures::TemporaryDirectory root_;
};

TEST_F(Simulate, WritesEveryFrameAndReportsItInWordsAndAsJson) {
  ChildResult result = on_body({"--format", "ply", "--xpbd.intersection_interval", "2"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  for (const char* words : {"frame 5:", "strain p50", "touch the body", "crossings with itself",
                            "of the fabric's bending stiffness"}) {
    EXPECT_THAT(result.out, HasSubstr(words));
  }
  EXPECT_TRUE(std::filesystem::exists(out() / "garment_000005.ply"));
  std::istringstream table(read_file_text(out() / "frames.csv", 1 << 20));
  std::vector<std::vector<std::string>> rows;
  for (std::string row; std::getline(table, row);) {
    rows.emplace_back();
    std::istringstream cells(row + ",.");
    for (std::string cell; std::getline(cells, cell, ',');) {
      rows.back().push_back(cell);
    }
  }
  ASSERT_EQ(rows.size(), 6U);
  const auto cell = [&](std::size_t frame, const std::string& name) {
    const auto column = std::find(rows[0].begin(), rows[0].end(), name) - rows[0].begin();
    return rows[frame].at(static_cast<std::size_t>(column));
  };
  EXPECT_EQ(rows[0][0], "frame");
  for (std::size_t frame = 1; frame <= 5; ++frame) {
    ASSERT_EQ(rows[frame].size(), rows[0].size());
    EXPECT_EQ(rows[frame][0], std::to_string(frame));
    EXPECT_NEAR(std::stod(cell(frame, "seconds")), static_cast<double>(frame) / 60, 1e-8);
    EXPECT_GT(std::stod(cell(frame, "strain_max")), 0);
    EXPECT_GT(std::stod(cell(frame, "kinetic_energy_j")), 0);
    for (const char* counted : {"inside", "inside_depth_m", "body_crossings", "crossings"}) {
      EXPECT_EQ(cell(frame, counted).empty(), frame == 1 || frame == 3) << counted << frame;
    }
    EXPECT_EQ(cell(frame, "strain_residual"), "") << "springs alone";
  }
  result = on_body({"--json", "--format", "obj"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  std::istringstream lines(result.out);
  std::string line;
  int frames = 0;
  while (std::getline(lines, line)) {
    const nlohmann::json json = nlohmann::json::parse(line);
    if (json.contains("frame")) {
      ++frames;
      EXPECT_TRUE(json["strain"]["p95"].is_number());
      EXPECT_TRUE(json["body"]["depth_m"].is_number());
      EXPECT_EQ(json["self"]["crossings"].is_null(), frames < 5) << "counted in the last frame";
      EXPECT_EQ(json["body"]["all_inside"].is_null(), frames < 5);
      EXPECT_TRUE(json["residual"]["strain"].is_null());
    } else {
      EXPECT_EQ(json["bending_by_direction"].size(), 36U);
    }
  }
  EXPECT_EQ(frames, 5);
  EXPECT_TRUE(std::filesystem::exists(out() / "garment_000005.obj"));
}

TEST_F(Simulate, TellsTheResidualOfStrainTriangles) {
  // A hanging sheet whose texture coordinates are its flat shape in metres.
  std::ofstream file(scene() / "garment.obj");
  for (int r = 0; r < 4; ++r) {
    for (int c = 0; c < 4; ++c) {
      file << "v " << 0.08 * c << " " << 1 - 0.08 * r << " 0\nvt " << 0.08 * c << " "
           << 1 - 0.08 * r << "\n";
    }
  }
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) {
      const auto corner = [&](int at) { return std::to_string(at) + "/" + std::to_string(at); };
      const int a = 4 * r + c + 1;
      file << "f " << corner(a) << " " << corner(a + 4) << " " << corner(a + 5) << "\n";
      file << "f " << corner(a) << " " << corner(a + 5) << " " << corner(a + 1) << "\n";
    }
  }
  file.close();
  ChildResult result =
      on_body({"--flat_rest", "--membrane", "strain", "--pin_top", "0.01", "--format", "obj"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("% of strain"));
  result = on_body(
      {"--flat_rest", "--membrane", "strain", "--pin_top", "0.01", "--format", "obj", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  std::istringstream lines(result.out);
  int frames = 0;
  for (std::string line; std::getline(lines, line);) {
    const nlohmann::json json = nlohmann::json::parse(line);
    if (json.contains("frame")) {
      ++frames;
      EXPECT_GT(json["residual"]["strain"].get<double>(), 0) << line;
    }
  }
  EXPECT_EQ(frames, 5);
}

/// The vertices of a frame's OBJ, nine decimals each.
std::vector<Eigen::Vector3d> vertices_of(const std::filesystem::path& obj) {
  std::vector<Eigen::Vector3d> vertices;
  std::istringstream lines(read_file_text(obj, 1 << 20));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string kind;
    Eigen::Vector3d v;
    if (words >> kind && kind == "v" && words >> v.x() >> v.y() >> v.z()) {
      vertices.push_back(v);
    }
  }
  return vertices;
}

TEST_F(Simulate, ACapturedGarmentHangsAsCapturedOnceItsWeightIsTakenOut) {
  write_hanging(scene() / "garment.obj");
  const auto moved = [&](std::vector<std::string> more) {
    for (const char* word : {"--format", "obj", "--pin_top", "0.01", "--settle", "120",
                             "--material.stretch_warp", "40", "--material.stretch_weft", "40",
                             "--material.density", "0.3", "--xpbd.velocity_damping", "4"}) {
      more.emplace_back(word);
    }
    const ChildResult result = on_body(std::move(more));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    const auto captured = vertices_of(scene() / "garment.obj");
    const auto hung = vertices_of(out() / "garment_000120.obj");
    EXPECT_EQ(hung.size(), captured.size()) << result.out;
    double sum = 0;
    for (std::size_t i = 0; i < std::min(captured.size(), hung.size()); ++i) {
      sum += (captured[i] - hung[i]).norm();
    }
    return sum / static_cast<double>(captured.size());
  };
  EXPECT_GT(moved({}), 0.004);
  EXPECT_LT(moved({"--relax"}), 0.002);
}

TEST_F(Simulate, RefusesTextureCoordinatesThatAreNoFlatRestShape) {
  ChildResult result = on_body({"--flat_rest"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("texture coordinates"));
  {
    std::ofstream file(scene() / "garment.obj");
    file << "v 0 0.5 0\nv 1 0.5 0\nv 0 0.5 1\nvt 0 0\nvt 0.1 0\nvt 0 0.1\nf 1/1 3/3 2/2\n";
  }
  result = on_body({"--flat_rest"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("edges 0.1 times as long"));
}

TEST_F(Simulate, WritesUsdAndItsOwnSequences) {
  ASSERT_EQ(alone({"--format", "usda", "--material", "denim"}).exit_code, 0);
  EXPECT_THAT(read_file_text(out() / "garment.usda", 1 << 20), HasSubstr("endTimeCode = 5\n"));
  EXPECT_TRUE(std::filesystem::exists(out() / "garment" / "frames" / "000005.h5"));
}

TEST_F(Simulate, WritesOneFileThatIsReadBackAsABody) {
  ASSERT_EQ(run({"simulate", "--garment", (scene() / "garment.obj").string(), "--body",
                 (scene() / "body.obj").string(), "--out", (root_.path() / "T.h5").string(),
                 "--settle", "4", "--no-pictures"})
                .exit_code,
            0);
  EXPECT_TRUE(std::filesystem::is_regular_file(root_.path() / "T.h5"));
  EXPECT_FALSE(std::filesystem::exists(root_.path() / "T.h5.frames")) << "gathered, then removed";
  const ChildResult shown = run({"inspect", (root_.path() / "T.h5").string()});
  EXPECT_THAT(shown.out, HasSubstr("float32 [4,49,3]"));
  EXPECT_THAT(shown.out, HasSubstr("frame_ids"));
  const ChildResult worn = alone({"--body", (root_.path() / "T.h5").string(), "--length", "2"});
  EXPECT_EQ(worn.exit_code, 0) << worn.err;
  ASSERT_EQ(run({"simulate", "--garment", (scene() / "garment.obj").string(), "--out",
                 (root_.path() / "T.usda").string(), "--settle", "3", "--no-pictures"})
                .exit_code,
            0);
  EXPECT_THAT(read_file_text(root_.path() / "T.usda", 1 << 20), HasSubstr("endTimeCode = 3\n"));
}

TEST_F(Simulate, OneFrameHasItsPicturesToo) {
  const ChildResult result = run({"simulate", "--garment", (scene() / "garment.obj").string(),
                                  "--out", (root_.path() / "one").string(), "--settle", "1"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(std::filesystem::exists(root_.path() / "one" / "motion.mp4"));
}

TEST_F(Simulate, KeepsTheFramesBeforeAnErrorInOneFileToo) {
  std::filesystem::create_directories(scene() / "jumps");
  write_body(scene() / "jumps" / "b_0.obj", 0);
  write_body(scene() / "jumps" / "b_1.obj", 5);
  const ChildResult result =
      run({"simulate", "--garment", (scene() / "garment.obj").string(), "--body",
           (scene() / "jumps").string(), "--out", (root_.path() / "T.h5").string(), "--settle", "3",
           "--no-pictures"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("frames before it are in"));
  EXPECT_THAT(run({"inspect", (root_.path() / "T.h5").string()}).out,
              HasSubstr("float32 [3,49,3]"));
}

TEST_F(Simulate, ASignalLeavesTheFramesBeforeItWholeAndSaysWhereTheyAre) {
  for (const auto& [signal, name] : {std::pair(SIGINT, "ended"), std::pair(SIGTERM, "T.h5")}) {
    const std::filesystem::path out = root_.path() / name;
    const bool one_file = out.extension() == ".h5";
    const std::filesystem::path frames =
        one_file ? out.string() + ".frames" : (out / "garment").string();
    fixtures::ChildProcess child({fixtures::program_path(), "simulate", "--garment",
                                  (scene() / "garment.obj").string(), "--out", out.string(),
                                  "--settle", "100000"});
    while (!std::filesystem::exists(frames / "frames" / "000003.h5") && !child.has_ended()) {
      std::this_thread::yield();
    }
    child.kill(signal);
    const ChildResult result = child.wait();
    EXPECT_EQ(result.signal, signal) << result.err;
    const std::size_t at = result.out.find("stopped after frame ");
    ASSERT_NE(at, std::string::npos) << result.out;
    EXPECT_THAT(result.out,
                HasSubstr("of 100000; it and the frames before it are in " + out.string()));
    const int kept = std::stoi(result.out.substr(at + std::string("stopped after frame ").size()));
    EXPECT_GE(kept, 3);
    const auto beside = [&](const std::string& file) {
      return one_file ? root_.path() / ("T_" + file) : out / file;
    };
    const std::string table = read_file_text(beside("frames.csv"), 1 << 24);
    EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), kept + 1);
    EXPECT_TRUE(std::filesystem::exists(beside("sheet.png")));
    EXPECT_FALSE(std::filesystem::exists(beside("motion.mp4")));
    EXPECT_EQ(std::filesystem::exists(frames), !one_file);
    const ChildResult shown = run({"inspect", (one_file ? out : frames).string()});
    EXPECT_EQ(shown.exit_code, 0) << shown.out;
    EXPECT_TRUE(std::regex_search(shown.out,
                                  std::regex(one_file ? "\\[" + std::to_string(kept) + ",49,3\\]"
                                                      : "frames +" + std::to_string(kept) + "\n")))
        << shown.out;
    const ChildResult worn = alone({"--body", (one_file ? out : frames).string(), "--settle", "0",
                                    "--move_y", "-0.1", "--length", std::to_string(kept)});
    EXPECT_EQ(worn.exit_code, 0) << worn.err;
  }
}

TEST_F(Simulate, WhatBreaksInItsFirstFrameLeavesNothing) {
  std::filesystem::create_directories(scene() / "jumps");
  write_body(scene() / "jumps" / "b_0.obj", 0);
  write_body(scene() / "jumps" / "b_1.obj", 5);
  for (const char* name : {"folder", "T.h5"}) {
    const ChildResult result = run({"simulate", "--garment", (scene() / "garment.obj").string(),
                                    "--body", (scene() / "jumps").string(), "--out",
                                    (root_.path() / name).string(), "--settle", "0"});
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_THAT(result.err, ::testing::Not(HasSubstr("frames before it")));
    EXPECT_FALSE(std::filesystem::exists(root_.path() / name));
  }
  EXPECT_FALSE(std::filesystem::exists(root_.path() / "T.h5.frames"));
}

// As a run that was killed leaves it.
TEST_F(Simulate, InspectFindsFramesThatASequenceOnlySpeaksOf) {
  ASSERT_EQ(alone({}).exit_code, 0);
  std::filesystem::remove(out() / "garment" / "frames" / "000004.h5");
  std::filesystem::remove(out() / "garment" / "frames" / "000005.h5");
  const ChildResult shown = run({"inspect", (out() / "garment").string()});
  EXPECT_EQ(shown.exit_code, 3);
  EXPECT_THAT(shown.out, HasSubstr("2 of its 5 frames have no file, the first of them 4"));
}

TEST_F(Simulate, RefusesPlacesThatContradictTheirFormat) {
  const auto refused = [&](const std::vector<std::string>& more, const char* words) {
    std::vector<std::string> all{"simulate", "--garment", (scene() / "garment.obj").string(),
                                 "--settle", "1"};
    all.insert(all.end(), more.begin(), more.end());
    const ChildResult result = run(all);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_THAT(result.err, HasSubstr(words));
  };
  refused({"--out", (root_.path() / "T.ply").string()}, "ply is one file a frame");
  refused({"--out", (root_.path() / "T.h5").string(), "--format", "obj"}, "contradict");
  refused({"--out", (root_.path() / "T.glb").string()}, "a file T.h5 or T.usda");
  std::filesystem::create_directories(root_.path() / "F.h5");
  refused({"--out", (root_.path() / "F.h5").string()}, "that is a folder");
  refused({"--out", scene().string()},
          "is there already, and no flag replaces it; name another --out, or remove it first");
  refused({"--out", out().string(), "--body", scene().string(), "--motion", "walk.bvh"},
          "a folder of meshes");
}

// All of the cloth begins deeper than contact reaches.
TEST_F(Simulate, SaysHowManyVerticesAreInsideHoweverDeep) {
  const ChildResult result = on_body({"--json", "--settle", "1", "--scale", "0.1", "--move_y",
                                      "0.1"});  // the last frame is always counted
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const nlohmann::json json = nlohmann::json::parse(result.out.substr(result.out.find("\n{") + 1));
  EXPECT_EQ(json["body"]["inside"], 0);
  EXPECT_EQ(json["body"]["all_inside"], 49);
  EXPECT_GT(json["body"]["all_depth_m"].get<double>(), 0.02);
}

TEST_F(Simulate, TheStageKeepsItsFiguresAndTheReportPlotsThem) {
  ASSERT_EQ(stage("work", {"--xpbd.intersection_interval", "2"}).exit_code, 0);
  EXPECT_FALSE(bytes("work", "sheet.png").empty());
  const std::string table = bytes("work", "frames.csv");
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 7);
  const nlohmann::json manifest = nlohmann::json::parse(bytes("work", "manifest.json"));
  for (const char* name : {"frames", "strain_p95", "penetration_depth", "inside", "inside_depth",
                           "body_crossings", "crossings"}) {
    EXPECT_TRUE(manifest["metrics"].contains(name)) << name;
  }
  const ChildResult result = run({"report", (root_.path() / "work").string()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::string page = read_file_text(root_.path() / "work" / "report" / "index.html", 1 << 24);
  EXPECT_THAT(page, HasSubstr("edge strain, p95, %"));
  EXPECT_THAT(page, HasSubstr("vertices inside the body"));
}

TEST_F(Simulate, TakesEveryOptionOfCloth) {
  const auto fallen = [&](std::vector<std::string> more) {
    for (const char* word : {"--format", "obj", "--settle", "12"}) {
      more.emplace_back(word);
    }
    const ChildResult result = on_body(more);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return read_file_text(out() / "garment_000012.obj", 1 << 20);
  };
  const std::string plain = fallen({});
  EXPECT_EQ(fallen({"--shear", "none", "--seam_stiffness", "100"}), plain);
  EXPECT_NE(fallen({"--shear", "cross"}), plain);
  EXPECT_NE(fallen({"--shear", "quads"}), plain);
  EXPECT_EQ(fallen({"--rest_angles", "template", "--max_hinge_weight", "100"}), plain)
      << "flat, and without slivers";
  write_hanging(scene() / "garment.obj");
  const auto lowest = [&](std::vector<std::string> more) {
    for (const char* word : {"--format", "obj", "--pin_top", "0.01", "--settle", "20",
                             "--material.stretch_warp", "2", "--material.stretch_weft", "2"}) {
      more.emplace_back(word);
    }
    const ChildResult result = on_body(more);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    double least = 1;
    for (const Eigen::Vector3d& v : vertices_of(out() / "garment_000020.obj")) {
      least = std::min(least, v.y());
    }
    return least;
  };
  EXPECT_LT(lowest({}), 0.565);
  EXPECT_GT(lowest({"--tether_stretch", "1.05"}), 0.575);
}

// A value that is given counts, also where it is the default of a material without a name.
TEST_F(Simulate, GivenValuesChangeAFabricAndOthersStayItsOwn) {
  const auto material = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all{"--json", "--settle", "1"};
    all.insert(all.end(), more.begin(), more.end());
    const ChildResult result = alone(all);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return nlohmann::json::parse(result.out.substr(0, result.out.find('\n')))["material"];
  };
  nlohmann::json found = material({"--material", "denim"});
  EXPECT_EQ(found["name"], "denim");
  EXPECT_EQ(found["density"], 0.324);
  EXPECT_EQ(found["stretch_warp"], 1060);
  found = material({"--material", "denim", "--material.density", "0.15", "--material.damping=0"});
  EXPECT_EQ(found["density"], 0.15);
  EXPECT_EQ(found["damping"], 0);
  EXPECT_EQ(found["stretch_warp"], 1060);
  found = material({"--material.bending", "0"});
  EXPECT_EQ(found["name"], "custom");
  EXPECT_EQ(found["density"], 0.15);
  EXPECT_EQ(found["bending"], 0);
}

TEST_F(Simulate, StageEndedAndContinuedGivesTheSameBits) {
  ASSERT_EQ(stage("whole").exit_code, 0);
  ChildResult result = stage("parts", {"--frames", "1:4"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  result = stage("parts");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out + result.err, HasSubstr("3 of 6 frames are done already"));
  for (const char* name : {"states/000006.h5", "garment/frames/000006.h5", "garment/sequence.h5",
                           "frames.csv", "sheet.png"}) {
    ASSERT_FALSE(bytes("whole", name).empty()) << name;
    EXPECT_EQ(bytes("whole", name), bytes("parts", name)) << name;
  }
  // Frames from the middle alone are the same too.
  ASSERT_EQ(stage("middle", {"--frames", "4:6"}).exit_code, 0);
  EXPECT_EQ(bytes("middle", "states/000005.h5"), bytes("whole", "states/000005.h5"));
}

TEST_F(Simulate, ABodyThatTeleportsEndsItAndKeepsTheFramesBefore) {
  std::filesystem::create_directories(scene() / "jumps");
  write_body(scene() / "jumps" / "b_0.obj", 0);
  write_body(scene() / "jumps" / "b_1.obj", 0.01);
  write_body(scene() / "jumps" / "b_2.obj", 5);
  const ChildResult result =
      alone({"--body", (scene() / "jumps").string(), "--format", "ply", "--settle", "3"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("teleport"));
  EXPECT_THAT(result.err, HasSubstr("frames before it are in"));
  EXPECT_TRUE(std::filesystem::exists(out() / "garment_000004.ply"));
  EXPECT_FALSE(std::filesystem::exists(out() / "garment_000005.ply"));
}

TEST_F(Simulate, ItsOutputIsNoneOfItsInputs) {
  const std::string body = (scene() / "body.obj").string();
  for (const std::string& input : {(scene() / "garment.obj").string(), body}) {
    const std::string before = read_file_text(input, 1 << 20);
    std::filesystem::copy_file(input, root_.path() / "in.h5",
                               std::filesystem::copy_options::overwrite_existing);
    const ChildResult result =
        run({"simulate", "--garment",
             input == body ? (scene() / "garment.obj").string() : (root_.path() / "in.h5").string(),
             "--body", input == body ? (root_.path() / "in.h5").string() : body, "--out",
             (root_.path() / "in.h5").string()});
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_THAT(result.err, HasSubstr("it is an input, which would be lost"));
    EXPECT_EQ(read_file_text(root_.path() / "in.h5", 1 << 20), before);
  }
}

TEST_F(Simulate, InAWorkspaceABodyThatTeleportsIsNamedWithItsFrame) {
  std::filesystem::remove(scene() / "body.obj");
  std::filesystem::create_directories(scene() / "body");
  write_body(scene() / "body" / "b_0.obj", 0);
  write_body(scene() / "body" / "b_1.obj", 0.01);
  write_body(scene() / "body" / "b_2.obj", 5);
  const ChildResult result = stage("ws", {"--settle", "3"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("scene: frame 5, body vertex 0"));
  EXPECT_THAT(result.err, HasSubstr("frames before it are kept"));
  EXPECT_FALSE(bytes("ws", "states/000004.h5").empty());
}

TEST_F(Simulate, WhatGoesWithAWorkspaceIsRefusedWithoutOne) {
  for (const std::vector<std::string>& flag : std::vector<std::vector<std::string>>{
           {"--dry-run"}, {"--force"}, {"--frames", "1:2"}, {"--shard", "1/2"}}) {
    const ChildResult result = on_body(flag);
    EXPECT_EQ(result.exit_code, 2) << flag[0];
    EXPECT_THAT(result.err, HasSubstr(flag[0] + " goes with INPUT and WORKSPACE"));
    EXPECT_FALSE(std::filesystem::exists(out()));
  }
}

TEST_F(Simulate, RefusesBodiesThatAreNone) {
  std::ofstream(scene() / "none.obj") << "v 0 0 0\nv 1 0 0\nv 0 0 1\n";
  std::ofstream(scene() / "thin.obj") << "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n";
  for (const char* body : {"none.obj", "thin.obj"}) {
    const ChildResult result = alone({"--body", (scene() / body).string()});
    EXPECT_EQ(result.exit_code, 3) << result.out;
    EXPECT_THAT(result.err, HasSubstr(body));
    EXPECT_THAT(result.err, HasSubstr("a body with a surface"));
  }
}

TEST_F(Simulate, ScenesThatAreHardlyMeantAreSpokenOf) {
  const auto said = [&](const std::vector<std::string>& more) {
    std::filesystem::remove_all(out());
    const ChildResult result = on_body(more);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out;
  };
  EXPECT_THAT(said({"--settle", "1"}), ::testing::Not(HasSubstr("warning: ")));
  EXPECT_THAT(said({"--settle", "1", "--scale", "50"}), HasSubstr("--scale says how many"));
  EXPECT_THAT(said({"--settle", "1", "--move_x", "3"}), HasSubstr("--move-x"));
  EXPECT_THAT(said({"--settle", "1", "--scale", "0.1", "--move_y", "0.1"}),
              HasSubstr("49 of 49 vertices begin inside the body deeper than"));
  // The same pyramid with its corners the other way round.
  std::ofstream(scene() / "body.obj")
      << "v 0 0.3 0\nv -0.3 0 -0.3\nv 0.3 0 -0.3\nv 0.3 0 0.3\nv -0.3 0 0.3\n"
         "f 1 2 3\nf 1 3 4\nf 1 4 5\nf 1 5 2\nf 2 4 3\nf 2 5 4\n";
  EXPECT_THAT(said({"--settle", "1"}), HasSubstr("faces look inwards"));
}

TEST_F(Simulate, ADryRunRefusesWhatTheRunRefuses) {
  for (const char* how : {"--dry-run", "--force"}) {
    const ChildResult result =
        run({"simulate", (scene() / "garment.obj").string(), (root_ / "fresh").string(), how});
    EXPECT_EQ(result.exit_code, 3) << result.out;
    EXPECT_THAT(result.err, HasSubstr("scene: no folder"));
    EXPECT_FALSE(std::filesystem::exists(root_ / "fresh"));
  }
}

TEST_F(Simulate, RefusesGarmentsThatAreNoCloth) {
  std::ofstream(scene() / "garment.obj", std::ios::app) << "f 1 8 20\nf 1 8 30\n";
  ChildResult result = on_body();
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("manifold"));
  std::ofstream(scene() / "garment.obj") << "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n";
  result = on_body();
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("degenerate"));
}

TEST_F(Simulate, AMisspeltBodyIsRefusedWithTheNameThatWasMeant) {
  const ChildResult result = run({"simulate", "--garment", (scene() / "garment.obj").string(),
                                  "--body", "femal", "--out", out().string()});
  EXPECT_EQ(result.exit_code, 3) << result.out;
  EXPECT_THAT(result.err, HasSubstr("did you mean 'female'?"));
}

TEST_F(Simulate, RefusesWhatIsSaidAndWouldDoNothing) {
  const auto refused = [&](const std::vector<std::string>& more, const char* words) {
    const ChildResult result = on_body(more);
    EXPECT_EQ(result.exit_code, 2) << words << "\n" << result.out;
    EXPECT_THAT(result.err, HasSubstr(words));
    EXPECT_FALSE(std::filesystem::exists(out())) << words;
  };
  refused({"--material.shear", "5000"}, "material.shear does nothing with membrane springs");
  refused({"--material.stretch_warp", "500"}, "cannot differ without a flat rest shape");
  refused({"--material", "denim", "--material.stretch_weft", "500"}, "say both alike");
  refused({"--wind", "[0, 0, 5]", "--xpbd.drag", "1", "--xpbd.air_density", "0"},
          "wind does nothing with xpbd.air_density 0");
  refused({"--pin_top", "0.5"}, "holds every vertex");
  refused({"--body_fps", "30"}, "--body-fps is of meshes that move");
  refused({"--fall_in", "2"}, "--fall-in goes into a motion");
  refused({"--relaxing.rounds", "3"}, "relaxing.rounds does nothing with relax false");
  refused({"--xpbd.jacobi_radius", "0.5"}, "xpbd.sweep gauss-seidel");
  refused({"--xpbd.cuda_barrier", "grid"}, "--xpbd.cuda-barrier does nothing on the CPU");
  refused({"--xpbd.cuda_blocks", "4"}, "--xpbd.cuda-blocks does nothing on the CPU");
  refused({"--xpbd.self_contact", "false", "--xpbd.self_thickness", "0.002"},
          "xpbd.self_thickness does nothing with xpbd.self_contact false");
  refused({"--grid", "--format", "ply"}, "leave --format out");
  // The same with a workspace.
  EXPECT_EQ(stage("work", {"--fall_in", "2"}).exit_code, 2);
  EXPECT_EQ(stage("work", {"--xpbd.jacobi_radius", "0.5"}).exit_code, 2);
  // What does something is taken.
  EXPECT_EQ(on_body({"--shear", "cross", "--material.shear", "50", "--settle", "1"}).exit_code, 0);
}

TEST_F(Simulate, SaysWhichModulusItIsSolvedWith) {
  ChildResult result = alone({"--material", "denim", "--settle", "1"});
  EXPECT_THAT(result.out, HasSubstr("Young's modulus 646 N/m (mean of warp and weft: no flat rest "
                                    "shape), Poisson's ratio 1/3, bending "));
  result = alone({"--material", "denim", "--settle", "1", "--json"});
  const nlohmann::json solved =
      nlohmann::json::parse(result.out.substr(0, result.out.find('\n')))["in_use"];
  EXPECT_EQ(solved["young_warp"], 646);
  EXPECT_TRUE(solved["shear"].is_null());
  EXPECT_THAT(stage("work", {"--settle", "1"}).err, HasSubstr("Young's modulus 1000 N/m"));
}

TEST_F(Simulate, TheGridSaysModulusAndStrainOfEachPicture) {
  const ChildResult result = alone({"--grid", "--material", "denim", "--settle", "3", "--body",
                                    (scene() / "body.obj").string()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  for (const char* words : {"64.6 N/m", "646 N/m", "6460 N/m", "strain "}) {
    EXPECT_THAT(result.out, HasSubstr(words));
  }
  const ImageHeader grid = read_image_header(out() / "grid.png");
  EXPECT_GT(grid.width, 3 * 360);
  EXPECT_GT(grid.height, 3 * 540);
  EXPECT_FALSE(std::filesystem::exists(out() / "garment")) << "no frames";
}

TEST_F(Simulate, PicturesAndVideosAreReadBack) {
  const ChildResult result = run({"simulate", "--garment", (scene() / "garment.obj").string(),
                                  "--out", out().string(), "--settle", "8"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const ImageHeader sheet = read_image_header(out() / "sheet.png");
  EXPECT_GT(sheet.width, 5 * 360) << "eight frames, five a row";
  EXPECT_GT(sheet.height, 2 * 540);
  if (std::system("ffprobe -version >/dev/null 2>&1") != 0) {
    GTEST_SKIP() << "no ffprobe";
  }
  for (const auto& [video, frames] : {std::pair("turntable.mp4", 36), std::pair("motion.mp4", 2)}) {
    const ChildResult probe = run_child(
        {"ffprobe", "-v", "error", "-count_frames", "-show_streams", (out() / video).string()});
    EXPECT_THAT(probe.out, HasSubstr("nb_read_frames=" + std::to_string(frames) + "\n")) << video;
    EXPECT_THAT(probe.out, HasSubstr("width=360\n")) << video;
  }
}

TEST_F(Simulate, ABodyOfGltfIsTheSameBody) {
  const std::string glb = (root_.path() / "B.glb").string();
  write_mesh(glb, read_mesh(scene() / "body.obj"));
  const auto fallen = [&](const std::string& body) {
    const ChildResult result = alone({"--body", body, "--format", "obj", "--settle", "12"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return vertices_of(out() / "garment_000012.obj");
  };
  const auto by_glb = fallen(glb);
  const auto by_obj = fallen((scene() / "body.obj").string());
  ASSERT_EQ(by_glb.size(), by_obj.size());
  for (std::size_t i = 0; i < by_obj.size(); ++i) {
    EXPECT_LT((by_glb[i] - by_obj[i]).norm(), 1e-3) << i;
  }
}

TEST_F(Simulate, ABodyInMillimetresIsSpokenOf) {
  const auto scaled = [&](const char* name, double factor) {
    std::ofstream file(root_.path() / name);
    for (const Eigen::Vector3d& v : vertices_of(scene() / "body.obj")) {
      file << "v " << factor * v.x() << " " << factor * v.y() << " " << factor * v.z() << "\n";
    }
    file << "f 1 3 2\nf 1 4 3\nf 1 5 4\nf 1 2 5\nf 2 3 4\nf 2 4 5\n";
    return (root_.path() / name).string();
  };
  // Garment and body alike, so that nothing else looks odd.
  ChildResult result =
      alone({"--body", scaled("large.obj", 1000), "--scale", "1000", "--settle", "1"});
  EXPECT_THAT(result.out, HasSubstr("warning: the body is 300 m high"));
  result = alone({"--body", scaled("small.obj", 0.01), "--scale", "0.01", "--settle", "1"});
  EXPECT_THAT(result.out, HasSubstr("warning: the body is 0.003 m high"));
}

TEST_F(Simulate, MessagesNameWhatHelps) {
  std::ofstream(root_.path() / "dress.json") << "{}";
  ChildResult result = run(
      {"simulate", "--garment", (root_.path() / "dress.json").string(), "--out", out().string()});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("atelier drape --garment dress.json --out FOLDER"));
  result = on_body({"--material.density", "-0.5"});
  EXPECT_THAT(result.err, HasSubstr("it takes a number in ["));
  std::ofstream(root_.path() / "walk.bvh") << "HIERARCHY\n";
  result = on_body({"--motion", (root_.path() / "walk.bvh").string()});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("a mesh without a rig cannot be posed"));
}

TEST_F(Simulate, RefusesMaterialsAndOptionsThatCannotBe) {
  const auto refused = [&](const std::vector<std::string>& more, const char* words, int code = 2) {
    const ChildResult result = on_body(more);
    EXPECT_EQ(result.exit_code, code) << words << "\n" << result.err;
    EXPECT_THAT(result.err, HasSubstr(words));
  };
  refused({"--material.density", "0"}, "density");
  refused({"--material.stretch_warp", "-5"}, "stretch_warp");
  refused({"--material.stretch_warp", "-0.5"}, "material.stretch_warp cannot be -0.5");
  refused({"--material", "cheese"}, "cheese");
  refused({"--material", "silk", "--material.name", "denim"}, "name one fabric");
  refused({"--xpbd.vectors", "avx2", "--xpbd.precision", "double"}, "precision \"float\" alone");
  refused({"--format", "fbx"}, "fbx");
  refused({"--wind", "[1, 2]"}, "three numbers");
  refused({"--wind", "[nan, 0, 0]"}, "wind");
  refused({"--wind", "[0, 0, 5]"}, "--xpbd.drag");
  refused({"--membrane", "strain"}, "rest shape", 3);
  refused({"--shear", "sideways"}, "sideways");
  refused({"--max_hinge_weight", "1"}, "max_hinge_weight");
  refused({"--membrane", "strain", "--shear", "cross"}, "have their shear already", 3);
  refused({"--tether_stretch", "1.1"}, "no fixed vertex", 3);
  refused({"--tether_stretch", "0.5", "--pin_top", "0.1"}, "0 for no tethers", 3);
  const ChildResult free = alone({"--pin_top", "0.1", "--settle", "1"});
  EXPECT_EQ(free.exit_code, 2);
  EXPECT_THAT(free.err, HasSubstr("give --body"));
  EXPECT_EQ(run({"simulate"}).exit_code, 2);
  EXPECT_EQ(alone({"--motion", "walk.bvh"}).exit_code, 2);
  if (!cuda_available()) {
    refused({"--device", "cuda"}, "; say --device cpu", 5);
  }
  std::filesystem::remove(scene() / "garment.obj");
  EXPECT_EQ(stage("none").exit_code, 3);
}

}  // namespace
}  // namespace atelier
