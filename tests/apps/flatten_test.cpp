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
#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using fixtures::ChildResult;
using ::testing::HasSubstr;

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
    more.insert(more.begin(), {"--mesh", mesh().string(), "--out", out().string()});
    return run(std::move(more));
  }

  fixtures::TemporaryDirectory root_;
};

TEST_F(Flatten, ATubeBecomesPanelsOfItsArea) {
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

TEST_F(Flatten, OtherProgramsOpenItsFiles) {
  ASSERT_EQ(alone().exit_code, 0);
  const std::string picture = (out() / "pattern.png").string();
  if (std::system("command -v rsvg-convert >/dev/null") == 0) {
    // At 25.4 dots an inch a dot is a millimetre.
    ASSERT_EQ(std::system(("rsvg-convert -d 25.4 -p 25.4 -o " + picture + " " +
                           (out() / "pattern.svg").string())
                              .c_str()),
              0);
    EXPECT_GT(read_image_header(picture).height, 400);  // the tube's height and allowances
  }
  std::ofstream(root_.path() / "audit.py") << R"(import sys, ezdxf
drawing = ezdxf.readfile(sys.argv[1])
assert not drawing.audit().errors
layers = {entity.dxf.layer for block in drawing.blocks for entity in block}
assert {'1', '14', '7'} <= layers, layers
)";
  if (std::system("/usr/bin/python3 -c 'import ezdxf' 2>/dev/null") == 0) {
    EXPECT_EQ(std::system(("/usr/bin/python3 " + (root_.path() / "audit.py").string() + " " +
                           (out() / "pattern.dxf").string())
                              .c_str()),
              0);
  }
}

TEST_F(Flatten, ItsGarmentIsSimulatedFromTheFlatRestShape) {
  ASSERT_EQ(alone().exit_code, 0);
  const ChildResult result =
      fixtures::run_child({fixtures::program_path(), "simulate", "--garment",
                           (out() / "garment.obj").string(), "--flat_rest", "--out",
                           (root_.path() / "frames").string(), "--settle", "2", "--no-pictures"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

// Templates and modelled clothes have a few; a simulation refuses corners below half a degree.
TEST_F(Flatten, SliversAreTakenOutSoThatTheGarmentIsSimulated) {
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
    EXPECT_THAT(flat.out, HasSubstr("slivers taken out"));
    const ChildResult result =
        fixtures::run_child({fixtures::program_path(), "simulate", "--garment",
                             (out() / "garment.obj").string(), "--flat_rest", "--out",
                             (root_.path() / seams).string(), "--settle", "2", "--no-pictures"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }
}

TEST_F(Flatten, TheStageDoesTheSame) {
  const std::string workspace = (root_.path() / "workspace").string();
  const ChildResult result = run({mesh().string(), workspace});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out + result.err, HasSubstr("stretch p50"));
  const ChildResult again = run({mesh().string(), workspace});
  EXPECT_EQ(again.exit_code, 0);
}

TEST_F(Flatten, CentimetresThatAreTakenForMetresAreSpokenOf) {
  EXPECT_THAT(alone().out, ::testing::Not(HasSubstr("unit-unknown")));
  std::istringstream lines(read_file_text(mesh(), 1 << 20));
  std::ofstream larger(mesh());
  for (std::string line; std::getline(lines, line);) {
    double x, y, z;
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

TEST_F(Flatten, AGarmentThatDoesNotHangAsCapturedIsFlattenedAsItIs) {
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

TEST_F(Flatten, RefusesWhatIsNoGarment) {
  std::ofstream(mesh()) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 0\n"
                           "f 1 2 3\nf 1 2 4\nf 1 2 5\n";
  const ChildResult result = alone();
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("tube.obj"));
  EXPECT_FALSE(std::filesystem::exists(out()));
}

TEST_F(Flatten, RefusesABodyThatIsNotThereAndPlacesThatAreTaken) {
  EXPECT_EQ(alone({"--relax.body", (root_.path() / "nobody.obj").string()}).exit_code, 3);
  EXPECT_EQ(run({"--mesh", mesh().string(), "--out", root_.path().string()}).exit_code, 2);
  EXPECT_EQ(run({"--mesh", mesh().string()}).exit_code, 2);
  const ChildResult seams = alone({"--seams", "nowhere.json"});
  EXPECT_EQ(seams.exit_code, 3);
  EXPECT_THAT(seams.out, ::testing::Not(HasSubstr("smoothed")));  // asked for before the work
}

}  // namespace
}  // namespace atelier
