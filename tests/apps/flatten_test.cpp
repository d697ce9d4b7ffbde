#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/io/file_bytes.h"
#include "core/io/image_file.h"
#include "core/io/mesh_file.h"
#include "core/sequence_archive.h"
#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using fixtures::ChildResult;
using ::testing::HasSubstr;
using ::testing::Not;

/// An open tube of 0.15 m radius and 0.4 m height, a skirt of sorts, in a file.
class Flatten : public ::testing::Test {
 protected:
  static constexpr int kAround = 16;
  static constexpr int kRows = 5;

  void SetUp() override {
    std::ofstream file(mesh());
    for (int r = 0; r < kRows; ++r) {
      for (int c = 0; c < kAround; ++c) {
        const double angle = 2 * std::numbers::pi * c / kAround;
        file << "v " << 0.15 * std::sin(angle) << " " << 0.1 * r << " " << 0.15 * std::cos(angle)
             << "\n";
      }
    }
    for (int r = 0; r + 1 < kRows; ++r) {
      for (int c = 0; c < kAround; ++c) {
        const int a = r * kAround + c + 1;
        const int b = r * kAround + (c + 1) % kAround + 1;
        file << "f " << a << " " << b << " " << b + kAround << "\n";
        file << "f " << a << " " << b + kAround << " " << a + kAround << "\n";
      }
    }
    file.close();
    if (run({"--help"}).out.find("--mesh") == std::string::npos) {
      GTEST_SKIP() << "built without flatten";
    }
  }

  std::filesystem::path mesh() const { return root_.path() / "tube.obj"; }
  std::filesystem::path out() const { return root_.path() / "out"; }

  static ChildResult run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {fixtures::program_path(), "flatten"});
    return fixtures::run_child(arguments);
  }
  ChildResult alone(std::vector<std::string> more = {}) const {
    std::filesystem::remove_all(out());
    more.insert(more.begin(),
                {"--mesh", mesh().string(), "--out", out().string(), "--no-pictures"});
    return run(std::move(more));
  }

  fixtures::TemporaryDirectory root_;
};

TEST_F(Flatten, Tube_BecomesPanelsOfItsArea) {
  const ChildResult result = alone({"--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const nlohmann::json json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json["inverted"], 0);
  EXPECT_EQ(json["overlaps"], 0);
  EXPECT_NEAR(json["area_ratio"].get<double>(), 1, 0.01);
  EXPECT_LT(json["stretch_p99"].get<double>(), 0.01);
  for (const char* name : {"pattern.svg", "pattern.dxf", "garment.obj"}) {
    EXPECT_TRUE(std::filesystem::exists(out() / name)) << name;
  }
}

TEST_F(Flatten, StretchImage_ShowsPanelsAndViews) {
  ASSERT_EQ(alone().exit_code, 0);
  EXPECT_FALSE(std::filesystem::exists(out() / "stretch.png"));
  std::filesystem::remove_all(out());
  ASSERT_EQ(run({"--mesh", mesh().string(), "--out", out().string()}).exit_code, 0);
  const int height = read_image_header(out() / "stretch.png").height;
  EXPECT_GT(height, 400);
  EXPECT_LT(height, 1300) << "the flat panels, wider than tall, in a row as tall as the views";
}

TEST_F(Flatten, PatternInOtherPrograms_HasTrueSize) {
  if (std::system("command -v rsvg-convert >/dev/null") != 0) {
    GTEST_SKIP() << "no rsvg-convert (package librsvg2-bin)";
  }
  ASSERT_EQ(alone().exit_code, 0);
  const std::string picture = (out() / "pattern.png").string();
  // At 25.4 dots an inch a dot is a millimetre.
  ASSERT_EQ(std::system(("rsvg-convert -d 25.4 -p 25.4 -o " + picture + " " +
                         (out() / "pattern.svg").string())
                            .c_str()),
            0);
  EXPECT_GT(read_image_header(picture).height, 400);  // the tube's height and allowances
}

TEST_F(Flatten, FilesInOtherPrograms_Open) {
  if (std::system("/usr/bin/python3 -c 'import ezdxf' 2>/dev/null") != 0) {
    GTEST_SKIP() << "no ezdxf (package python3-ezdxf)";
  }
  ASSERT_EQ(alone().exit_code, 0);
  std::ofstream(root_.path() / "audit.py") << R"(import sys, ezdxf
drawing = ezdxf.readfile(sys.argv[1])
assert not drawing.audit().errors
layers = {entity.dxf.layer for block in drawing.blocks for entity in block}
assert {'1', '14', '7'} <= layers, layers
)";
  EXPECT_EQ(std::system(("/usr/bin/python3 " + (root_.path() / "audit.py").string() + " " +
                         (out() / "pattern.dxf").string())
                            .c_str()),
            0);
}

TEST_F(Flatten, ValentinaFile_OpensInValentinaAtTrueSize) {
  if (std::system("command -v valentina >/dev/null") != 0) {
    GTEST_SKIP() << "no valentina (package valentina)";
  }
  ASSERT_EQ(alone({"--seams", "none"}).exit_code, 0);
  ASSERT_EQ(std::system(("cd " + root_.path().string() + " && HOME=. QT_QPA_PLATFORM=offscreen " +
                         "valentina " + (out() / "pattern.val").string() +
                         " -b opened -d . -f 0 --exportOnlyDetails >valentina.log 2>&1")
                            .c_str()),
            0);
  // One piece, with its allowances and Valentina's margins of 1 cm.
  const std::string svg = read_file_text(root_.path() / "opened_1.svg", 1 << 20);
  double width = 0;
  double height = 0;
  ASSERT_EQ(std::sscanf(svg.c_str() + svg.find("<svg"), "<svg width=\"%lfmm\" height=\"%lfmm\"",
                        &width, &height),
            2);
  const double around = 2 * kAround * 150 * std::sin(std::numbers::pi / kAround);
  EXPECT_NEAR(width, around + 20 + 20, 15);
  EXPECT_NEAR(height, 400 + 30 + 20, 30);
}

TEST_F(Flatten, FlattenedGarment_IsSimulatedFromFlatRestShape) {
  ASSERT_EQ(alone().exit_code, 0);
  const ChildResult result =
      fixtures::run_child({fixtures::program_path(), "simulate", "--garment",
                           (out() / "garment.obj").string(), "--flat_rest", "--out",
                           (root_.path() / "frames").string(), "--settle", "2", "--no-pictures"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

// Templates and modelled clothes have a few; a simulation refuses corners below half a degree.
TEST_F(Flatten, Slivers_AreRemovedSoThatTheGarmentSimulates) {
  std::istringstream lines(read_file_text(mesh(), 1 << 20));
  std::ofstream thin(mesh());
  int vertex = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("v ") && vertex++ == 2 * kAround + 5) {
      const double angle = 2 * std::numbers::pi * 6 / kAround;  // where the next one is, but 0.1 mm
      thin << "v " << 0.15 * std::sin(angle) << " 0.2001 " << 0.15 * std::cos(angle) << "\n";
    } else {
      thin << line << "\n";
    }
  }
  thin.close();
  for (const char* seams : {"auto", "none"}) {
    const ChildResult flat = alone({"--seams", seams, "--smooth", "0"});
    ASSERT_EQ(flat.exit_code, 0) << flat.err;
    EXPECT_THAT(flat.out, HasSubstr("slivers removed"));
    const ChildResult result =
        fixtures::run_child({fixtures::program_path(), "simulate", "--garment",
                             (out() / "garment.obj").string(), "--flat_rest", "--out",
                             (root_.path() / seams).string(), "--settle", "2", "--no-pictures"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }
}

TEST_F(Flatten, Stage_GivesTheSameAsTheCommand) {
  const std::string workspace = (root_.path() / "workspace").string();
  const ChildResult result = run({mesh().string(), workspace});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out + result.err, HasSubstr("stretch p50"));
  const ChildResult again = run({mesh().string(), workspace});
  EXPECT_EQ(again.exit_code, 0);
}

TEST_F(Flatten, CentimetresTakenForMetres_AreWarnedOf) {
  EXPECT_THAT(alone().out, ::testing::Not(HasSubstr("unit-unknown")));
  std::istringstream lines(read_file_text(mesh(), 1 << 20));
  std::ofstream larger(mesh());
  for (std::string line; std::getline(lines, line);) {
    double x = 0, y = 0, z = 0;
    if (std::sscanf(line.c_str(), "v %lf %lf %lf", &x, &y, &z) == 3) {
      larger << "v " << 100 * x << " " << 100 * y << " " << 100 * z << "\n";
    } else {
      larger << line << "\n";
    }
  }
  larger.close();
  const ChildResult told = alone();
  EXPECT_EQ(told.exit_code, 0) << told.err;
  EXPECT_THAT(told.out, HasSubstr("warning unit-unknown"));
  EXPECT_THAT(told.out, HasSubstr("is 40 m large"));
  EXPECT_THAT(told.out, HasSubstr("--input.unit"));
  EXPECT_THAT(alone({"--input.unit", "cm"}).out, ::testing::Not(HasSubstr("unit-unknown")));
}

TEST_F(Flatten, UnlikelyGarmentSize_IsWarnedOf) {
  const auto of_triangle = [&](const std::string& head, double side) {
    std::ofstream(mesh()) << head << "v 0 0 0\nv " << side << " 0 0\nv 0 " << side
                          << " 0\nf 1 2 3\n";
    return alone({"--smooth", "0"});
  };
  const ChildResult large = of_triangle("", 6);
  EXPECT_THAT(large.out, HasSubstr("warning size-unlikely"));
  EXPECT_THAT(large.out,
              HasSubstr("is 6 m large, too large or too small for a garment; --input.unit"));
  EXPECT_THAT(of_triangle("", 0.04).out, HasSubstr("is 0.04 m large"));
  EXPECT_THAT(of_triangle("", 4).out, ::testing::Not(HasSubstr("size-unlikely")));
  const ChildResult said = of_triangle("# units: m\n", 7);
  EXPECT_THAT(said.out, HasSubstr("the file states its unit"));
}

TEST_F(Flatten, FabricNarrowerThanAPiece_IsWarnedOf) {
  const ChildResult narrow = alone({"--pattern.fabric-width", "0.2"});
  EXPECT_EQ(narrow.exit_code, 0) << narrow.err;
  EXPECT_THAT(narrow.out, HasSubstr("warning fabric-narrow"));
  EXPECT_THAT(narrow.out, HasSubstr("the fabric 0.20 m"));
  EXPECT_THAT(alone().out, ::testing::Not(HasSubstr("fabric-narrow")));
}

TEST_F(Flatten, UnusedVertices_AreLeftOut) {
  const std::string plain = alone({"--json"}).out;
  const std::string text = read_file_text(mesh(), 1 << 20);
  const std::size_t faces = text.find("f ");
  std::ofstream(mesh()) << text.substr(0, faces) << "v 5 5 5\n" << text.substr(faces);
  const ChildResult loose = alone({"--json"});
  EXPECT_EQ(loose.exit_code, 0) << loose.err;
  EXPECT_EQ(loose.out, plain);
  EXPECT_THAT(loose.err, HasSubstr("1 vertex without a triangle was left out"));
  EXPECT_THAT(loose.err, ::testing::Not(HasSubstr("size-unlikely")));
}

TEST_F(Flatten, SeamFile_CountsUnusedVertices) {
  std::string text = read_file_text(mesh(), 1 << 20);
  const auto seam = [&](int first) {  // up the tube, along edges
    std::string run;
    for (int r = 0; r < kRows; ++r) {
      run += (run.empty() ? "" : ",") + std::to_string(first + r * kAround);
    }
    std::ofstream(root_.path() / "seams.json") << "{\"seams\": [[" << run << "]]}";
    return alone({"--json", "--seams", (root_.path() / "seams.json").string()});
  };
  const ChildResult plain = seam(0);
  ASSERT_EQ(plain.exit_code, 0) << plain.err;
  std::ofstream loose(mesh());
  loose << "v 5 5 5\n";  // in front, so that every number is one more
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    int a = 0, b = 0, c = 0;
    if (std::sscanf(line.c_str(), "f %d %d %d", &a, &b, &c) == 3) {
      loose << "f " << a + 1 << " " << b + 1 << " " << c + 1 << "\n";
    } else {
      loose << line << "\n";
    }
  }
  loose.close();
  EXPECT_EQ(seam(1).out, plain.out);
}

TEST_F(Flatten, DegenerateTriangles_AreLeftOut) {
  const nlohmann::json plain = nlohmann::json::parse(alone({"--json"}).out);
  const std::string text = read_file_text(mesh(), 1 << 20);
  const std::string seams = (root_.path() / "seams.json").string();
  std::ofstream(seams) << "{\"seams\": [[0, 16, 32, 48, 64]]}";
  const ChildResult cut = alone({"--json", "--seams", seams});
  ASSERT_EQ(cut.exit_code, 0) << cut.err;
  for (const char* needless : {"f 3 3 4\n", "f 1 2 18\n", "v 5 5 5\nv 5 5 5\nf 81 82 81\n",
                               "v 5 5 5\nv 5 5 5\nv 5 5 5\nf 81 82 83\n"}) {
    SCOPED_TRACE(needless);
    std::ofstream(mesh()) << text << needless;
    const ChildResult told = alone({"--json"});
    EXPECT_EQ(told.exit_code, 0) << told.err;
    EXPECT_EQ(nlohmann::json::parse(told.out), plain);
    EXPECT_THAT(told.err, HasSubstr("warning triangles-left-out [" + mesh().string() +
                                    "]: 1 triangle without area, or there already"));
    EXPECT_EQ(alone({"--json", "--seams", seams}).out, cut.out);
  }
}

TEST_F(Flatten, ZeroAreaOrTinySurface_IsRefused) {
  const std::string faces = "f 1 2 3\nf 2 4 3\n";
  std::ofstream(mesh()) << "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\n" << faces;
  const ChildResult line = alone();
  EXPECT_EQ(line.exit_code, 3);
  EXPECT_THAT(line.err, HasSubstr("tube.obj: mesh: no triangle with an area"));
  EXPECT_THAT(line.out + line.err, Not(HasSubstr("nan")));
  for (const char* side : {"5e-4", "1e-6", "1e-20", "1e-100"}) {
    std::ofstream(mesh()) << "v 0 0 0\nv " << side << " 0 0\nv 0 " << side << " 0\nv " << side
                          << " " << side << " 0\n"
                          << faces;
    const ChildResult small = alone();
    EXPECT_EQ(small.exit_code, 3) << side;
    EXPECT_THAT(small.err, HasSubstr("expected 1 mm at least")) << side;
    EXPECT_FALSE(std::filesystem::exists(out()));
  }
}

TEST_F(Flatten, UnequalSeamSides_AreReportedWithExitCode4) {
  std::istringstream lines(read_file_text(mesh(), 1 << 20));
  std::ofstream wide(mesh());  // one side goes out by metres: nothing that lies flat in one step
  for (std::string line; std::getline(lines, line);) {
    double x = 0, y = 0, z = 0;
    if (std::sscanf(line.c_str(), "v %lf %lf %lf", &x, &y, &z) == 3) {
      const double wider = 1 + 200 * std::max(0.0, x) * std::sin(8 * y);
      wide << "v " << wider * x << " " << y << " " << wider * z << "\n";
    } else {
      wide << line << "\n";
    }
  }
  wide.close();
  const std::string seams = (root_.path() / "seams.json").string();
  std::ofstream(seams) << "{\"seams\": [[0, 17, 34, 51, 68]]}";
  const auto steps = [&](const char* count) {
    return alone({"--seams", seams, "--smooth", "0", "--flatten.panel.iterations", count});
  };
  const ChildResult few = steps("1");
  EXPECT_EQ(few.exit_code, 4) << few.out;
  EXPECT_THAT(few.out, HasSubstr("warning seams-unequal [" + mesh().string() + "]"));
  EXPECT_TRUE(std::filesystem::exists(out() / "pattern.svg"));
  const ChildResult all = steps("200");
  EXPECT_EQ(all.exit_code, 0) << all.out;
  EXPECT_THAT(all.out, Not(HasSubstr("seams-unequal")));
}

TEST_F(Flatten, UnsupportedFormat_IsRefusedWithTheSupportedOnes) {
  const std::filesystem::path scene = root_.path() / "shirt.blend";
  std::ofstream(scene) << "BLENDER-v300";
  const ChildResult result = run({"--mesh", scene.string(), "--out", out().string()});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("extension '.blend'; expected .obj, .ply, .stl, .glb"));
  EXPECT_THAT(alone({"--seams", "uvs"}).err, HasSubstr("texture coordinates: none"));
}

TEST_F(Flatten, MixedOrientations_AreMadeConsistent) {
  const std::string plain = alone({"--json"}).out;
  std::string text = read_file_text(mesh(), 1 << 20);
  const std::string last = text.substr(text.rfind("f "));
  int a = 0, b = 0, c = 0;
  ASSERT_EQ(std::sscanf(last.c_str(), "f %d %d %d", &a, &b, &c), 3);
  text.resize(text.rfind("f "));
  std::ofstream(mesh()) << text << "f " << a << " " << c << " " << b << "\n";
  const ChildResult turned = alone({"--json"});
  EXPECT_EQ(turned.exit_code, 0) << turned.err;
  EXPECT_EQ(turned.out, plain);
  EXPECT_THAT(turned.err, HasSubstr("triangles of opposite orientation were reversed"));
}

TEST_F(Flatten, MillimetresTakenForMetres_StillTerminate) {
  std::ofstream(mesh()) << "v 0 0 0\nv 1e6 0 0\nv 0 1e6 0\nv 3e5 1e6 0\nf 1 2 3\nf 3 2 4\n";
  EXPECT_EQ(alone({"--seams", "none"}).exit_code, 0);
}

TEST_F(Flatten, UnwritablePlace_IsFoundBeforeTheWork) {
  std::ofstream(root_.path() / "file") << "x";
  for (const std::string& place :
       {std::string("/proc/pattern"), (root_.path() / "file/out").string(),
        (root_.path() / std::string(300, 'x')).string()}) {
    const ChildResult result = run({"--mesh", mesh().string(), "--out", place});
    EXPECT_EQ(result.exit_code, 5) << place;
    EXPECT_THAT(result.out, Not(HasSubstr("smoothed"))) << place;
  }
  EXPECT_EQ(run({"--mesh", "/nothing.obj", "--out", (root_.path() / "new/out").string()}).exit_code,
            3);
  EXPECT_FALSE(std::filesystem::exists(root_.path() / "new"));
}

TEST_F(Flatten, OpenBody_IsWarnedOfAndEveryRoundReported) {
  const std::filesystem::path body = root_.path() / "body.obj";
  std::ofstream(body) << "v 0 0.3 0\nv 0.05 0.1 0\nv -0.03 0.1 0.04\nv -0.03 0.1 -0.04\n"
                         "f 1 3 2\nf 1 4 3\nf 1 2 4\n";
  const ChildResult told = alone({"--relax.body", body.string(), "--relax.relaxing.rounds", "2",
                                  "--relax.relaxing.seconds", "0.1"});
  EXPECT_THAT(told.out, HasSubstr("warning body-open [" + body.string() + "]"));
  EXPECT_THAT(told.out, HasSubstr("open at 1 place"));
  EXPECT_THAT(told.out, HasSubstr("round 2 of at most 2: hangs "));
}

TEST_F(Flatten, FilesNamedByOptions_ArePartOfTheKey) {
  const std::string workspace = (root_.path() / "workspace").string();
  const std::string seams = (root_.path() / "seams.json").string();
  std::ofstream(seams) << "{\"seams\": [[0,16]]}";
  const std::vector<std::string> words = {mesh().string(), workspace, "--seams", seams};
  ASSERT_EQ(run(words).exit_code, 0);
  EXPECT_THAT(run(words).out, HasSubstr("done already"));
  std::ofstream(seams) << "{\"seams\": [[1,17]]}";
  const ChildResult planned = run({mesh().string(), workspace, "--seams", seams, "--dry-run"});
  EXPECT_THAT(planned.out, HasSubstr("input --seams changed"));
  const ChildResult edited = run(words);
  EXPECT_EQ(edited.exit_code, 0) << edited.err;
  EXPECT_THAT(edited.out, HasSubstr("flatten done: "));
}

TEST_F(Flatten, GarmentNotHangingAsCaptured_IsFlattenedUnrelaxed) {
  // Nothing holds the tube up: the only body is a small one inside of it.
  const std::filesystem::path body = root_.path() / "body.obj";
  std::ofstream(body) << "v 0 0.3 0\nv 0.05 0.1 0\nv -0.03 0.1 0.04\nv -0.03 0.1 -0.04\n"
                         "f 1 3 2\nf 1 4 3\nf 1 2 4\nf 2 3 4\n";
  const ChildResult plain = alone({"--json"});
  ASSERT_EQ(plain.exit_code, 0) << plain.err;
  const ChildResult relaxed =
      alone({"--json", "--relax.body", body.string(), "--relax.relaxing.rounds", "2"});
  EXPECT_EQ(relaxed.exit_code, 4);
  EXPECT_THAT(relaxed.err, HasSubstr("warning not-relaxed [" + body.string() + "]"));
  EXPECT_EQ(relaxed.out, plain.out);
}

/// A closed prism of eight sides round the Y axis in rings, from 0.5 m below the tube to as far
/// above it.
void write_trunk(const std::filesystem::path& path, double radius) {
  std::ofstream file(path);
  constexpr int kSides = 8;
  constexpr int kRings = 15;
  for (int r = 0; r < kRings; ++r) {
    for (int i = 0; i < kSides; ++i) {
      const double angle = 2 * std::numbers::pi * i / kSides;
      file << "v " << radius * std::sin(angle) << " " << -0.5 + 0.1 * r << " "
           << radius * std::cos(angle) << "\n";
    }
  }
  for (int r = 0; r + 1 < kRings; ++r) {
    for (int i = 0; i < kSides; ++i) {
      const int a = r * kSides + i + 1;
      const int b = r * kSides + (i + 1) % kSides + 1;
      file << "f " << a << " " << b << " " << b + kSides << " " << a + kSides << "\n";
    }
  }
  file << "f 8 7 6 5 4 3 2 1\nf";
  for (int i = 1; i <= kSides; ++i) {
    file << " " << (kRings - 1) * kSides + i;
  }
  file << "\n";
}

TEST_F(Flatten, WrittenPattern_IsSewnAnewAndHangsWhereItWasCaptured) {
  const std::string body = (root_.path() / "trunk.obj").string();
  write_trunk(body, 0.12);
  const std::vector<std::string> check = {
      "--sew-check.body", body, "--sew-check.edge_length", "0.04", "--sew-check.seconds", "0.5"};
  std::vector<std::string> words = check;
  words.emplace_back("--json");
  const ChildResult result = alone(words);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const nlohmann::json json = nlohmann::json::parse(result.out);
  EXPECT_LT(json.at("sewn_mean").get<double>(), 0.005);
  EXPECT_LT(json.at("sewn_p95").get<double>(), 0.012);
  EXPECT_GE(json.at("panels_a_part").get<double>(), 1);
  EXPECT_TRUE(json.contains("raggedness"));
  const Mesh sewn = read_mesh(out() / "sewn.obj");
  EXPECT_NEAR(sewn.vertices.col(1).maxCoeff(), 0.4, 0.01) << "its waist is held";
  EXPECT_FALSE(std::filesystem::exists(out() / "sewn.png")) << "--no-pictures";

  words = check;
  words.insert(words.begin(), {mesh().string(), (root_.path() / "workspace").string()});
  const ChildResult stage = run(words);
  ASSERT_EQ(stage.exit_code, 0) << stage.err;
  EXPECT_THAT(stage.out + stage.err, HasSubstr("; sewn anew: "));
  const std::filesystem::path result_folder = root_.path() / "workspace/flatten/current";
  EXPECT_TRUE(std::filesystem::exists(result_folder / "sewn.png"));
  const auto metrics =
      nlohmann::json::parse(read_file_text(result_folder / "manifest.json", 1 << 20)).at("metrics");
  EXPECT_EQ(metrics.at("sewn_mean"), json.at("sewn_mean"));
  EXPECT_EQ(metrics.at("not_sewn"), 0);
  for (const char* seen : {"panels_a_part", "corners_max", "jaggedness", "raggedness",
                           "turns_per_metre", "asymmetry", "narrowest_neck"}) {
    EXPECT_EQ(metrics.at(seen), json.at(seen)) << seen;
  }
}

TEST_F(Flatten, SewCheckWithoutABodyOrOfARestSurface_IsRefused) {
  const auto refused = [&](std::vector<std::string> how, int code, const std::string& words) {
    const ChildResult result = alone(std::move(how));
    EXPECT_EQ(result.exit_code, code) << words;
    EXPECT_THAT(result.err, HasSubstr(words));
    EXPECT_FALSE(std::filesystem::exists(out()));
  };
  refused({"--sew-check.seconds", "3"}, 2, "--sew-check.seconds does nothing without a body");
  refused({"--sew-check.body", "none", "--sew-check.fabric", "cotton"}, 2, "sew-check.fabric");
  refused({"--sew-check.body", (root_.path() / "nobody.obj").string()}, 3, "nobody.obj");
  const std::string body = (root_.path() / "trunk.obj").string();
  write_trunk(body, 0.12);
  std::filesystem::rename(mesh(), root_.path() / "rest.obj");
  const ChildResult rest = run({"--mesh", (root_.path() / "rest.obj").string(), "--out",
                                out().string(), "--sew-check.body", body});
  EXPECT_EQ(rest.exit_code, 3);
  EXPECT_THAT(rest.err, HasSubstr("a rest surface, which no body wore"));
}

TEST_F(Flatten, GarmentHeldUpByMotion_IsNotRelaxed) {
  const std::filesystem::path body = root_.path() / "body.obj";
  std::ofstream(body) << "v 0 0.3 0\nv 0.05 0.1 0\nv -0.03 0.1 0.04\nv -0.03 0.1 -0.04\n"
                         "f 1 3 2\nf 1 4 3\nf 1 2 4\nf 2 3 4\n";
  const Mesh tube = read_mesh(mesh());
  constexpr double kFps = 10;
  const auto thrown = [&](const Mesh& garment, double acceleration, const std::string& name) {
    std::vector<Mesh> meshes(3, garment);
    for (int i : {0, 2}) {
      meshes[static_cast<std::size_t>(i)].vertices.rowwise() +=
          Eigen::RowVector3d(0.5 * acceleration / kFps / kFps, 0, 0);
    }
    write_sequence(root_.path() / name, sequence_of(std::move(meshes), kFps));
    return (root_.path() / name).string();
  };
  const auto relaxed = [&](const std::string& registered) {
    return alone({"--json", "--relax.body", body.string(), "--relax.relaxing.rounds", "1",
                  "--relax.relaxing.seconds", "0.1", "--relax.registered", registered});
  };
  const ChildResult plain = alone({"--json"});
  ASSERT_EQ(plain.exit_code, 0) << plain.err;
  const ChildResult moved = relaxed(thrown(tube, 8, "moved"));
  EXPECT_EQ(moved.exit_code, 4);
  EXPECT_THAT(moved.err,
              HasSubstr("warning in-motion [" + (root_.path() / "moved").string() + "]"));
  EXPECT_THAT(moved.err, HasSubstr("in frame 1 (its freely hanging parts accelerate by 8.0 m/s2)"));
  EXPECT_THAT(moved.err, Not(HasSubstr("round 1")));
  EXPECT_EQ(moved.out, plain.out);
  EXPECT_THAT(relaxed(thrown(tube, 0.5, "still")).err, HasSubstr("round 1 of at most 1: hangs "));
  Mesh other = tube;
  other.faces.conservativeResize(other.faces.rows() - 1, 3);
  const ChildResult foreign = relaxed(thrown(other, 8, "other"));
  EXPECT_EQ(foreign.exit_code, 3);
  EXPECT_THAT(foreign.err, HasSubstr("another topology than the mesh's"));
}

/// Two tubes as `template` leaves them, in frames of their own, and the body and both of them in
/// every frame.
class FlattenOutfit : public Flatten {
 protected:
  static constexpr double kFps = 10;

  void SetUp() override {
    Flatten::SetUp();
    std::ofstream(root_.path() / "body.obj")
        << "v 0 0.3 0\nv 0.05 0.1 0\nv -0.03 0.1 0.04\nv -0.03 0.1 -0.04\n"
           "f 1 3 2\nf 1 4 3\nf 1 2 4\nf 2 3 4\n";
    std::filesystem::create_directory(surfaces());
    const Mesh tube = read_mesh(mesh());
    for (const char* label : {"lower", "upper"}) {
      std::vector<Mesh> meshes(3, tube);
      const double thrown = label == std::string("upper") ? 8 : 0.2;  // m/s2 along x, about frame 1
      for (const int i : {0, 2}) {
        meshes[static_cast<std::size_t>(i)].vertices.rowwise() +=
            Eigen::RowVector3d(0.5 * thrown / kFps / kFps, 0, 0);
      }
      write_mesh(surfaces() / (std::string(label) + ".obj"), meshes[1]);
      write_sequence(registered() / label, sequence_of(meshes, kFps));
    }
    Mesh body = read_mesh(root_.path() / "body.obj");
    std::vector<Mesh> bodies(3, body);
    bodies[0].vertices.array() += 5;  // nowhere near
    write_sequence(root_.path() / "bodies", sequence_of(bodies, kFps));
    write_note(1, 1);
  }

  std::filesystem::path surfaces() const { return root_.path() / "surfaces"; }
  std::filesystem::path registered() const { return root_.path() / "registered"; }
  void write_note(int lower, int upper) const {
    const auto garment = [](const char* label, int frame) {
      return nlohmann::json{{"label", label}, {"frame", frame}, {"facing", {1, 0, 0}}};
    };
    std::ofstream(surfaces() / "template.json")
        << nlohmann::json{{"garments", {garment("lower", lower), garment("upper", upper)}}};
  }
  ChildResult relaxed(const std::string& body, const std::string& sequences,
                      std::vector<std::string> more = {}) const {
    std::vector<std::string> all = {surfaces().string(),
                                    (root_.path() / "workspace").string(),
                                    "--relax.body",
                                    (root_.path() / body).string(),
                                    "--relax.relaxing.rounds",
                                    "1",
                                    "--relax.relaxing.seconds",
                                    "0.1"};
    if (!sequences.empty()) {
      all.insert(all.end(), {"--relax.registered", (root_.path() / sequences).string()});
    }
    all.insert(all.end(), more.begin(), more.end());
    return run(all);
  }
};

TEST_F(FlattenOutfit, EachGarment_IsJudgedByItsOwnSequenceAndBody) {
  if (relaxed("body.obj", "", {"--dry-run"}).err.find("unknown") != std::string::npos) {
    GTEST_SKIP() << "built without simulation";
  }
  const ChildResult result = relaxed("bodies", "registered");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err,
              HasSubstr("upper: warning in-motion [" + (registered() / "upper").string() + "]"));
  EXPECT_THAT(result.err,
              HasSubstr("in frame 1 (its freely hanging parts accelerate by 8.0 m/s2)"));
  EXPECT_THAT(result.err, HasSubstr("lower: warning not-relaxed"));  // it was tried
  EXPECT_THAT(result.err, Not(HasSubstr("lower: warning in-motion")));
  for (const char* label : {"lower", "upper"}) {
    EXPECT_TRUE(std::filesystem::exists(root_.path() / "workspace/flatten/current" / label /
                                        "pattern.svg"));
  }
}

TEST_F(FlattenOutfit, InputNotCoveringAllGarments_IsRefusedBeforeTheWork) {
  const auto refused = [&](const std::string& body, const std::string& sequences,
                           const std::string& words) {
    SCOPED_TRACE(words);
    for (const bool planned : {true, false}) {
      const ChildResult result =
          relaxed(body, sequences,
                  planned ? std::vector<std::string>{"--dry-run"} : std::vector<std::string>{});
      EXPECT_EQ(result.exit_code, 3);
      EXPECT_THAT(result.err, HasSubstr(words));
      EXPECT_THAT(result.out, Not(HasSubstr("smoothed")));
    }
  };
  if (relaxed("body.obj", "", {"--dry-run"}).err.find("unknown") != std::string::npos) {
    GTEST_SKIP() << "built without simulation";
  }
  refused("bodies", "registered/lower",
          "registered/lower: one garment's sequence, of 2 garments that are flattened");
  write_note(0, 1);
  refused("body.obj", "", "one body, of garments in frames 0 and 1");
  write_note(1, 7);
  refused("bodies", "", "no body of frame 7");
  std::filesystem::remove(surfaces() / "template.json");
  refused("bodies", "", "the frame of lower.obj is not known");
  EXPECT_EQ(relaxed("bodies", "registered", {"--dry-run"}).exit_code, 0);
  EXPECT_EQ(relaxed("body.obj", "", {"--dry-run"}).exit_code, 0);
  std::filesystem::remove_all(registered() / "upper");
  refused("bodies", "registered", "registered/upper");
}

TEST_F(FlattenOutfit, TemplateResult_GivesTheFacingFromOneFolderUp) {
  const std::filesystem::path result = root_.path() / "made";
  std::filesystem::create_directory(result);
  std::filesystem::rename(surfaces(), result / "garments");
  std::filesystem::rename(result / "garments" / "template.json", result / "template.json");
  const auto picture = [&](const std::string& workspace, const std::string& garment) {
    return read_file_text(root_.path() / workspace / "flatten/current" / garment / "stretch.png",
                          1 << 24);
  };
  const auto flattened = [&](const std::filesystem::path& input, const std::string& workspace) {
    return run({input.string(), (root_.path() / workspace).string()});
  };
  const ChildResult whole = flattened(result, "whole");
  ASSERT_EQ(whole.exit_code, 0) << whole.err;
  EXPECT_THAT(whole.err, Not(HasSubstr("template-unread")));
  // What lies beside an INPUT is no part of its key: it is not read, and that is said.
  const ChildResult below = flattened(result / "garments", "below");
  ASSERT_EQ(below.exit_code, 0) << below.err;
  EXPECT_THAT(below.err, HasSubstr("template-unread"));
  EXPECT_THAT(below.err, HasSubstr("give the folder " + result.string() + " as INPUT"));
  EXPECT_THAT(flattened(result / "garments" / "upper.obj", "one").err,
              HasSubstr("template-unread"));
  // Alone there is no key: the sides are named as they are in the whole result.
  std::filesystem::remove_all(out());
  ASSERT_EQ(run({"--mesh", (result / "garments" / "upper.obj").string(), "--out", out().string()})
                .exit_code,
            0);
  if (std::filesystem::exists(out() / "stretch.png")) {
    EXPECT_NE(picture("whole", "upper"), picture("below", "upper"));
    EXPECT_EQ(read_file_text(out() / "stretch.png", 1 << 24), picture("whole", "upper"));
  }
}

// Alone, by --mesh, in its folder or by its name: no garment hung in what folds were taken out of.
TEST_F(FlattenOutfit, RestSurface_IsRefusedForRelaxingUnderAnyName) {
  if (relaxed("body.obj", "", {"--dry-run"}).err.find("unknown") != std::string::npos) {
    GTEST_SKIP() << "built without simulation";
  }
  const std::string body = (root_.path() / "body.obj").string();
  const std::string workspace = (root_.path() / "workspace").string();
  const auto refused = [&](std::vector<std::string> how) {
    how.insert(how.end(), {"--relax.body", body});
    const ChildResult result = run(how);
    EXPECT_EQ(result.exit_code, 3) << how[0] << how[1];
    EXPECT_THAT(result.err, HasSubstr("a rest surface, which is in no captured pose"));
  };
  std::filesystem::copy_file(surfaces() / "upper.obj", root_.path() / "rest.obj");
  refused({(root_.path() / "rest.obj").string(), workspace});
  refused({"--mesh", (root_.path() / "rest.obj").string(), "--out", out().string()});
  std::ofstream(surfaces() / "template.json")
      << R"({"garments": [{"label": "upper", "facing": [1, 0, 0], "taut": true}]})";
  refused({surfaces().string(), workspace});
  refused({(surfaces() / "upper.obj").string(), workspace, "--dry-run"});
  refused({"--mesh", (surfaces() / "upper.obj").string(), "--out", out().string()});
}

TEST_F(FlattenOutfit, MalformedTemplateNote_IsRefused) {
  const auto refused = [&](const char* note, const char* words) {
    std::ofstream(surfaces() / "template.json")
        << R"({"garments": [{"label": "upper", )" << note << "}]}";
    for (const std::vector<std::string>& how :
         {std::vector<std::string>{surfaces().string(), (root_.path() / "workspace").string(),
                                   "--dry-run"},
          {surfaces().string(), (root_.path() / "workspace").string()},
          {"--mesh", (surfaces() / "upper.obj").string(), "--out", out().string()}}) {
      const ChildResult result = run(how);
      EXPECT_EQ(result.exit_code, 3) << note;
      EXPECT_THAT(result.err, HasSubstr("template.json: garments[0]"));
      EXPECT_THAT(result.err, HasSubstr(words));
    }
  };
  refused(R"("facing": {"x": 1, "y": 0, "z": 0})", "facing");
  refused(R"("facing": [1, 0])", "facing: 2 numbers; expected 3");
  refused(R"("facing": ["1", 0, 0])", "facing");
  refused(R"("frame": 4294967303)", "frame");
  refused(R"("frame": -1)", "frame");
  refused(R"("frame": 1.5)", "frame");
  refused(R"("rest": "yes")", "rest");
}

TEST_F(Flatten, NonManifoldGarment_IsRefused) {
  std::ofstream(mesh()) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 0\n"
                           "f 1 2 3\nf 1 2 4\nf 1 2 5\n";
  const ChildResult result = alone();
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("tube.obj"));
  EXPECT_FALSE(std::filesystem::exists(out()));
}

TEST_F(Flatten, OneSidedSurface_IsReported) {
  constexpr int kSteps = 24;  // a Moebius strip
  std::ofstream strip(mesh());
  for (int i = 0; i < kSteps; ++i) {
    const double turn = 2 * std::numbers::pi * i / kSteps;
    for (const double side : {-0.04, 0.04}) {
      const double radius = 0.15 + side * std::cos(turn / 2);
      strip << "v " << radius * std::sin(turn) << " " << side * std::sin(turn / 2) << " "
            << radius * std::cos(turn) << "\n";
    }
  }
  for (int i = 0; i < kSteps; ++i) {
    const bool last = i + 1 == kSteps;
    const int a = 2 * i + 1;
    const int b = last ? 2 : a + 2;
    const int c = last ? 1 : a + 3;
    strip << "f " << a << " " << b << " " << a + 1 << "\nf " << a + 1 << " " << b << " " << c
          << "\n";
  }
  strip.close();
  const ChildResult result = alone();
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("a one-sided surface such as a Moebius strip"));
  EXPECT_THAT(result.err, HasSubstr("tube.obj: edge of vertices "));
}

TEST_F(Flatten, UnknownSeamsWord_IsRefusedWhilePlanning) {
  const std::string workspace = (root_.path() / "workspace").string();
  const std::string expected =
      "--seams cannot be 'uv': it takes auto, uvs, labels, none, or a file";
  const ChildResult word = run({mesh().string(), workspace, "--seams", "uv", "--dry-run"});
  EXPECT_EQ(word.exit_code, 2);
  EXPECT_THAT(word.err, HasSubstr(expected));
  EXPECT_THAT(alone({"--seams", "uv"}).err, HasSubstr(expected));
  const ChildResult body =
      run({mesh().string(), workspace, "--relax.body", "/nobody.obj", "--dry-run"});
  EXPECT_EQ(body.exit_code, 3);
  EXPECT_THAT(body.err, HasSubstr("/nobody.obj: No such file"));
}

TEST_F(Flatten, TextureCoordinatesWithoutArea_AreRefused) {
  std::istringstream lines(read_file_text(mesh(), 1 << 20));
  std::ofstream textured(mesh());
  textured << "vt 0.5 0.5\n";
  for (std::string line; std::getline(lines, line);) {
    int a = 0, b = 0, c = 0;
    if (std::sscanf(line.c_str(), "f %d %d %d", &a, &b, &c) == 3) {
      textured << "f " << a << "/1 " << b << "/1 " << c << "/1\n";
    } else {
      textured << line << "\n";
    }
  }
  textured.close();
  const ChildResult result = alone({"--seams", "uvs"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("texture coordinates: no area"));
}

TEST_F(Flatten, MissingSurfacesOfARun_AreNamedWithTheirPlace) {
  const fixtures::TemporaryDirectory other;
  const std::string workspace = (other.path() / "workspace").string();
  EXPECT_EQ(run({root_.path().string(), workspace, "--dry-run"}).exit_code, 0);
  std::filesystem::remove(mesh());
  const ChildResult empty = run({root_.path().string(), workspace, "--dry-run"});
  EXPECT_EQ(empty.exit_code, 3);
  EXPECT_THAT(empty.err, HasSubstr("WORKSPACE/surfaces"));
}

TEST_F(Flatten, OptionsUnusedWithGivenSeams_AreRefused) {
  for (const std::vector<std::string>& idle : {std::vector<std::string>{"--tolerance", "0.01"},
                                               {"--find.stretch", "0.1"},
                                               {"--find.cuts", "3"}}) {
    std::vector<std::string> all = idle;
    all.insert(all.end(), {"--seams", "none"});
    const ChildResult result = alone(all);
    EXPECT_EQ(result.exit_code, 2) << idle[0];
    EXPECT_THAT(result.err, HasSubstr("--seams auto"));
  }
}

TEST_F(Flatten, OptionsUnusedWithoutABody_AreRefused) {
  for (const std::vector<std::string>& idle : {std::vector<std::string>{"--relax.fabric", "silk"},
                                               {"--relax.registered", root_.path().string()},
                                               {"--relax.relaxing.rounds", "3"}}) {
    const ChildResult result = alone(idle);
    if (result.err.find("unknown") == std::string::npos) {  // built without simulation
      EXPECT_EQ(result.exit_code, 2) << idle[0];
      EXPECT_THAT(result.err, HasSubstr(idle[0].substr(2) + " does nothing without relax.body: "
                                                            "leave it out, or say --relax.body"));
    }
  }
}

TEST_F(Flatten, MissingBodyOrTakenPlace_IsRefused) {
  EXPECT_EQ(alone({"--relax.body", (root_.path() / "nobody.obj").string()}).exit_code, 3);
  EXPECT_EQ(run({"--mesh", mesh().string(), "--out", root_.path().string()}).exit_code, 2);
  EXPECT_EQ(run({"--mesh", mesh().string()}).exit_code, 2);
  const ChildResult seams = alone({"--seams", "nowhere.json"});
  EXPECT_EQ(seams.exit_code, 2);
  EXPECT_THAT(seams.out, ::testing::Not(HasSubstr("smoothed")));  // asked for before the work
}

}  // namespace
}  // namespace atelier
