#include <Eigen/Core>
#include <algorithm>
#include <chrono>
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

#include "core/io/file_bytes.h"
#include "core/io/image_file.h"
#include "core/io/mesh_file.h"
#include "core/sequence_archive.h"
#include "tests/apps/simulate_fixture.h"

namespace atelier {
namespace {

using fixtures::ChildResult;
using fixtures::run_child;
using fixtures::Simulate;
using fixtures::vertices_of;
using ::testing::HasSubstr;
using ::testing::Not;

TEST_F(Simulate, EveryFrame_IsWrittenAndReportedAsTextAndJson) {
  ChildResult result = on_body({"--format", "ply", "--intersection_interval", "2"});
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
    for (const char* counted :
         {"inside", "inside_depth_m", "body_crossings", "body_gap", "crossings", "self_gap"}) {
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

TEST_F(Simulate, StrainTriangles_ReportTheirResidual) {
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

TEST_F(Simulate, SheetThatSceneHolds_StaysAndWithoutItsBandIsSaidToHaveLeft) {
  write_hanging(scene() / "garment.obj");  // 20 cm beside the body
  const std::string head = "[[held]]\ngarment = \"garment\"\nopening = \"top\"\nclosed = false\n";
  const auto hold = [&](const std::string& kind, const std::string& vertices) {
    std::ofstream(scene() / "holding.toml")
        << head << "kind = \"" << kind << "\"\nvertices = [" << vertices << "]\n";
  };
  hold("band", "0, 1, 2, 3");
  ChildResult result;
  for (const char* solver : {"xpbd", "projective-friction"}) {
    hold("band", "0, 1, 2, 3");
    result = stage("ws", {"--settle", "30", "--solver", solver});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.err, Not(HasSubstr("left its place"))) << solver;
    hold("rest", "0, 1, 2, 3");
    result = stage("ws", {"--settle", "30", "--solver", solver});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.err, HasSubstr("garment top: ")) << solver;
    EXPECT_THAT(result.err, HasSubstr("left its place")) << solver;
  }
  hold("band", "0, 1, 2, 99");
  result = stage("ws", {"--settle", "30"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("vertex 99"));
  result = alone({"--holding", (scene() / "holding.toml").string()});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("give --body"));
}

TEST_F(Simulate, RelaxedCapturedGarment_HangsAsCaptured) {
  write_hanging(scene() / "garment.obj");
  const auto moved = [&](std::vector<std::string> more) {
    for (const char* word : {"--format", "obj", "--pin_top", "0.01", "--settle", "120",
                             "--material.stretch_warp", "40", "--material.stretch_weft", "40",
                             "--material.density", "0.3", "--velocity_damping", "4"}) {
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

// Of two sheets over a floor one begins through the other: which of them comes to lie on the floor
// is the order in which they are named.
TEST_F(Simulate, LayeredGarments_SeparateInTheirOrder) {
  std::ofstream(scene() / "floor.obj")
      << "v -2 0 -2\nv 2 0 -2\nv 2 0 2\nv -2 0 2\nf 1 3 2\nf 1 4 3\n";
  const auto write_sheet = [&](const char* name, int cells, double height, bool through) {
    write_cloth(root_.path() / name, cells, 0.2 / cells);
    Mesh sheet = read_mesh(root_.path() / name);
    for (Index v = 0; v < sheet.vertices.rows(); ++v) {
      sheet.vertices(v, 1) = through && sheet.vertices(v, 0) > 0.03 ? 0.005 : height;
    }
    write_mesh(root_.path() / name, sheet);
    return (root_.path() / name).string();
  };
  const std::string coarse = write_sheet("coarse.obj", 10, 0.008, false);
  const std::string fine = write_sheet("fine.obj", 13, 0.011, true);
  const auto worn = [&](const std::string& garments) {
    std::filesystem::remove_all(out());
    const ChildResult result = run({"simulate",
                                    "--garment",
                                    garments,
                                    "--body",
                                    (scene() / "floor.obj").string(),
                                    "--out",
                                    out().string(),
                                    "--settle",
                                    "40",
                                    "--no-pictures",
                                    "--xpbd.substeps",
                                    "10",
                                    "--thickness",
                                    "0.002",
                                    "--material.thickness",
                                    "0.002",
                                    "--material.density",
                                    "0.2",
                                    "--material.bending",
                                    "2e-6"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("coarse: Young's modulus"));
    const auto last = result.out.find("frame 40:");
    EXPECT_NE(result.out.find("; 0 crossings with itself", last), std::string::npos) << result.out;
  };
  const auto height = [&](const char* name) {
    return frame(open_sequence(out() / name), 39).vertices.col(1).mean();
  };
  worn(coarse + "+" + fine);
  EXPECT_NEAR(height("coarse"), 0.002, 4e-4);
  EXPECT_NEAR(height("fine"), 0.004, 8e-4);
  worn(fine + "+" + coarse);
  EXPECT_NEAR(height("fine"), 0.002, 4e-4);
  EXPECT_NEAR(height("coarse"), 0.004, 8e-4);
}

TEST_F(Simulate, Garments_AreNamedByTheirFiles) {
  const std::string one = (scene() / "garment.obj").string();
  const auto worn = [&](const std::string& garments) {
    std::filesystem::remove_all(out());
    const ChildResult result = run({"simulate", "--garment", garments, "--out", out().string(),
                                    "--settle", "1", "--format", "ply", "--no-pictures"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
  };
  const std::string with_plus = (scene() / "a+b.obj").string();  // one file, whatever its name
  std::filesystem::copy_file(one, with_plus);
  worn(with_plus);
  EXPECT_TRUE(std::filesystem::exists(out() / "garment_000001.ply"));
  write_cloth(scene() / "other.obj", 4, 0.07);
  std::filesystem::create_directories(scene() / "more");
  write_cloth(scene() / "more" / "other.obj", 5, 0.07);
  worn((scene() / "other.obj").string() + "+" + (scene() / "more" / "other.obj").string());
  EXPECT_EQ(read_mesh(out() / "other_000001.ply").vertices.rows(), 25);
  EXPECT_EQ(read_mesh(out() / "other_2_000001.ply").vertices.rows(), 36);
}

TEST_F(Simulate, UsdAndSequences_AreWritten) {
  ASSERT_EQ(alone({"--format", "usda", "--material", "denim"}).exit_code, 0);
  EXPECT_THAT(read_file_text(out() / "garment.usda", 1 << 20), HasSubstr("endTimeCode = 5\n"));
  EXPECT_TRUE(std::filesystem::exists(out() / "garment" / "frames" / "000005.h5"));
}

TEST_F(Simulate, SingleFileOutput_IsReadBackAsABody) {
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

TEST_F(Simulate, SingleFrame_HasItsImagesToo) {
  const ChildResult result = run({"simulate", "--garment", (scene() / "garment.obj").string(),
                                  "--out", (root_.path() / "one").string(), "--settle", "1"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(std::filesystem::exists(root_.path() / "one" / "motion.mp4"));
}

TEST_F(Simulate, ErrorWithSingleFileOutput_KeepsEarlierFrames) {
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

// Files may have 12 KB: each frame's has less, that of all has more.
TEST_F(Simulate, UnwritableSingleFile_LeavesFramesAndSaysWhere) {
  const std::string out = (root_.path() / "T.h5").string();
  const ChildResult result =
      run_child({"bash", "-c", "ulimit -f 24; exec \"$@\"", "bash", fixtures::program_path(),
                 "simulate", "--garment", (scene() / "garment.obj").string(), "--out", out,
                 "--settle", "40", "--no-pictures"});
  EXPECT_EQ(result.exit_code, 5);
  EXPECT_THAT(result.err, HasSubstr("; the 40 frames before it are in " + out + ".frames"));
  EXPECT_FALSE(std::filesystem::exists(out));
  EXPECT_EQ(frame_count(open_sequence(out + ".frames")), 40);
  const std::string table = read_file_text(root_.path() / "T_frames.csv", 1 << 20);
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 41);
}

TEST_F(Simulate, UnwritableFrame_LeavesEarlierFramesAndFigures) {
  for (const char* name : {"ended", "T.h5"}) {
    const std::filesystem::path out = root_.path() / name;
    const bool one_file = out.extension() == ".h5";
    const std::filesystem::path frames =
        (one_file ? std::filesystem::path(out.string() + ".frames") : out / "garment") / "frames";
    const auto file = [&](int frame) {
      return frames / (std::to_string(1000000 + frame).substr(1) + ".h5");
    };
    fixtures::ChildProcess child({fixtures::program_path(), "simulate", "--garment",
                                  (scene() / "garment.obj").string(), "--out", out.string(),
                                  "--settle", "100000", "--no-pictures"});
    while (!std::filesystem::exists(file(3)) && !child.has_ended()) {
      std::this_thread::yield();
    }
    child.kill(SIGSTOP);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));  // until it stands
    int next = 3;
    while (std::filesystem::exists(file(next))) {
      ++next;
    }
    ++next;  // the one before may be on its way
    std::filesystem::create_directories(file(next) / "in the way");
    child.kill(SIGCONT);
    const ChildResult result = child.wait();
    EXPECT_EQ(result.exit_code, 5) << result.out;
    EXPECT_THAT(result.err, HasSubstr("; the " + std::to_string(next - 1) +
                                      " frames before it are in " + out.string()));
    const std::string table =
        read_file_text(one_file ? root_.path() / "T_frames.csv" : out / "frames.csv", 1 << 20);
    EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), next);
    EXPECT_EQ(run({"inspect", (one_file ? out : out / "garment").string()}).exit_code, 0);
    EXPECT_EQ(std::filesystem::exists(frames), !one_file);
  }
}

TEST_F(Simulate, Signal_LeavesEarlierFramesAndSaysWhere) {
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

TEST_F(Simulate, FailureInTheFirstFrame_LeavesNothing) {
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
TEST_F(Simulate, Inspect_FindsListedFramesWithoutFiles) {
  ASSERT_EQ(alone({}).exit_code, 0);
  std::filesystem::remove(out() / "garment" / "frames" / "000004.h5");
  std::filesystem::remove(out() / "garment" / "frames" / "000005.h5");
  const ChildResult shown = run({"inspect", (out() / "garment").string()});
  EXPECT_EQ(shown.exit_code, 3);
  EXPECT_THAT(shown.out, HasSubstr("2 of its 5 frames have no file, the first of them 4"));
}

// All of the cloth begins deeper than contact reaches.
TEST_F(Simulate, DeepVertices_AreCountedAsInside) {
  const ChildResult result = on_body({"--json", "--settle", "1", "--scale", "0.1", "--move_y",
                                      "0.1"});  // the last frame is always counted
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const nlohmann::json json = nlohmann::json::parse(result.out.substr(result.out.find("\n{") + 1));
  EXPECT_EQ(json["body"]["inside"], 0);
  EXPECT_EQ(json["body"]["all_inside"], 49);
  EXPECT_GT(json["body"]["all_depth_m"].get<double>(), 0.02);
}

TEST_F(Simulate, StageFigures_AreKeptAndPlotted) {
  ASSERT_EQ(stage("work", {"--intersection_interval", "2"}).exit_code, 0);
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

TEST_F(Simulate, EveryClothOption_IsApplied) {
  const auto fallen = [&](std::vector<std::string> more) {
    for (const char* word : {"--format", "obj", "--settle", "12"}) {
      more.emplace_back(word);
    }
    const ChildResult result = on_body(more);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return read_file_text(out() / "garment_000012.obj", 1 << 20);
  };
  const std::string plain = fallen({});
  EXPECT_EQ(fallen({"--shear", "none", "--sewn", "true"}), plain);
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
TEST_F(Simulate, GivenValues_OverrideThoseOfAFabric) {
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

TEST_F(Simulate, ResumedStage_IsBitIdentical) {
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

TEST_F(Simulate, TeleportingBody_EndsTheRunAndKeepsEarlierFrames) {
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

TEST_F(Simulate, TeleportingBodyInAWorkspace_IsNamedWithItsFrame) {
  std::filesystem::remove(scene() / "body.obj");
  std::filesystem::create_directories(scene() / "body");
  write_body(scene() / "body" / "b_0.obj", 0);
  write_body(scene() / "body" / "b_1.obj", 0.01);
  write_body(scene() / "body" / "b_2.obj", 5);
  const ChildResult result = stage("ws", {"--settle", "3"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("scene/body: frame 5, body vertex 0"));
  EXPECT_THAT(result.err, HasSubstr("frames before it are kept"));
  EXPECT_FALSE(bytes("ws", "states/000004.h5").empty());
}

TEST_F(Simulate, FramesAfterAFailedOne_AreNotMade) {
  std::filesystem::remove(scene() / "body.obj");
  std::filesystem::create_directories(scene() / "body");
  for (int i = 0; i < 10; ++i) {
    write_body(scene() / "body" / ("b_" + std::to_string(i) + ".obj"), i < 2 ? 0 : 5);
  }
  const ChildResult result = stage("ws", {"--settle", "3", "--jobs", "8"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_FALSE(bytes("ws", "states/000004.h5").empty());
  for (int frame = 5; frame <= 12; ++frame) {
    const std::string digits = std::to_string(1000000 + frame).substr(1);
    EXPECT_TRUE(bytes("ws", "states/" + digits + ".h5").empty()) << frame;
  }
}

TEST_F(Simulate, SolvedModulus_IsReported) {
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

TEST_F(Simulate, Grid_ReportsModulusAndStrainOfEachImage) {
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

TEST_F(Simulate, InterruptedGrid_SaysNothingWasWritten) {
  fixtures::ChildProcess child({fixtures::program_path(), "simulate", "--garment",
                                (scene() / "garment.obj").string(), "--out", out().string(),
                                "--grid", "--settle", "1000000"});
  while (!child.catches(SIGINT) && !child.has_ended()) {
    std::this_thread::yield();
  }
  child.kill(SIGINT);
  const ChildResult result = child.wait();
  EXPECT_EQ(result.signal, SIGINT) << result.err;
  EXPECT_THAT(result.out, HasSubstr("of 1000000; a grid is drawn in the end, so nothing was"));
  EXPECT_FALSE(std::filesystem::exists(out()));
}

TEST_F(Simulate, FailedGrid_LeavesNoFolder) {
  std::filesystem::create_directories(scene() / "jumps");
  write_body(scene() / "jumps" / "000000.obj", 0);
  write_body(scene() / "jumps" / "000001.obj", 300);
  const ChildResult result =
      alone({"--grid", "--body", (scene() / "jumps").string(), "--settle", "1"});
  EXPECT_EQ(result.exit_code, 3) << result.out;
  EXPECT_FALSE(std::filesystem::exists(out()));
}

TEST_F(Simulate, ImagesAndVideos_AreReadBack) {
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

TEST_F(Simulate, GltfBody_GivesTheSameResultAsObj) {
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

}  // namespace
}  // namespace atelier
