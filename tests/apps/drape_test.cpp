#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/device.h"
#include "core/io/mesh_file.h"
#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

using fixtures::ChildResult;
using fixtures::run_child;
using ::testing::HasSubstr;

// What it drapes is tested in tests/pipeline/outfit; here is what it refuses, before any work is
// done.
class DrapeRefuses : public ::testing::Test {
 protected:
  void SetUp() override {
    if (run({"--help"}).out.find("--pattern-scale") == std::string::npos) {
      GTEST_SKIP() << "built without drape";
    }
  }
  static ChildResult run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {fixtures::program_path(), "drape"});
    return run_child(arguments);
  }
  void refused(std::vector<std::string> arguments, int code, const std::string& words) const {
    arguments.insert(arguments.end(), {"--out", (root_.path() / "out").string()});
    const ChildResult result = run(arguments);
    EXPECT_EQ(result.exit_code, code) << words << "\n" << result.err;
    EXPECT_THAT(result.err, HasSubstr(words));
    EXPECT_FALSE(std::filesystem::exists(root_.path() / "out")) << words;
  }
  fixtures::TemporaryDirectory root_;
};

TEST_F(DrapeRefuses, MissingOrTakenPlace_IsRefused) {
  EXPECT_EQ(run({"--garment", "tee"}).exit_code, 2);
  for (const char* file : {"tee.png", "tee.obj", "tee.H5"}) {
    const ChildResult named = run({"--garment", "tee", "--out", (root_.path() / file).string()});
    EXPECT_EQ(named.exit_code, 2) << file;
    EXPECT_THAT(named.err, HasSubstr("go into one new folder"));
  }
  const ChildResult taken = run({"--out", root_.path().string()});
  EXPECT_EQ(taken.exit_code, 2);
  EXPECT_THAT(taken.err,
              HasSubstr("already exists, and no flag replaces it; choose another --out"));
}

TEST_F(DrapeRefuses, UnknownGarments_AreRefused) {
  refused({"--garment", "cape"}, 2,
          "--garment cannot be 'cape': it takes dress, tee, skirt, trousers");
  refused({"--garment", "dres"}, 2, ", did you mean 'dress'?");
  refused({"--garment", "tee+"}, 2, "''");
  refused({"--garment", "nothere.json"}, 3, "nothere.json");
  const std::string bad = (root_.path() / "bad.json").string();
  std::ofstream(bad) << "{\"panels\": 1}";
  refused({"--garment", bad}, 3, "no 'properties'");
}

TEST_F(DrapeRefuses, BadBodiesAndOptions_AreRefused) {
  refused({"--body", "nobody.glb"}, 3, "nobody.glb");
  refused({"--body", "femal"}, 2, "or its folder, did you mean 'female'?");
  refused({"--human.stature", "0.9"}, 2, "--human.stature cannot be 0.9: it is in [1.4, 2.15] m");
  refused({"--human.waist_girth", "3"}, 2, "waist_girth");
  refused({"--pattern_scale", "9"}, 2, "pattern_scale");
  refused({"--edge_length", "0"}, 2, "edge_length");
  refused({"--frames", "0"}, 2, "frames");
  refused({"--fit", "belt"}, 2, "garment");
  if (!cuda_available()) {
    refused({"--device", "cuda"}, 5, "CUDA");
  }
}

TEST_F(DrapeRefuses, OptionsWithoutEffect_AreRefused) {
  refused({"--pattern_scale", "1.2"}, 2, "--pattern-scale does nothing without a pattern file");
  refused({"--fit", "body"}, 2, "--fit body does nothing without a pattern file");
  refused({"--body", "one.npz", "--human.stature", "1.7"}, 2,
          "--human.stature shapes the default human, not 'one.npz'");
  refused({"--body", "one.npz", "--garment", "some.json", "--fit", "body"}, 2,
          "slims the default human alone");
}

TEST_F(DrapeRefuses, OptionsOfTheOtherSolver_AreRefused) {
  refused({"--projective-friction.iterations", "5"}, 2,
          "--projective-friction.iterations does nothing with solver xpbd: leave it out, take "
          "--xpbd.iterations, or say --solver projective-friction");
  const std::vector<std::string> other = {"--solver", "projective-friction"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), other.begin(), other.end());
    return more;
  };
  refused(with({"--xpbd.substeps", "5"}), 2, "take --projective-friction.substeps");
  refused(with({"--substeps", "5"}), 2, "did you mean '--projective-friction.substeps'?");
  refused(with({"--projective-friction.half-precision"}), 2,
          "--projective-friction.half-precision does nothing on the CPU; use --device cuda");
  refused(with({"--projective-friction.strain-limit", "11"}), 2, "it takes a number in [0, 10]");
}

TEST_F(DrapeRefuses, TooCoarseCloth_IsRefusedWithAFittingEdgeLength) {
  refused({"--garment", "tee", "--edge_length", "0.1"}, 3, "a smaller --edge-length (0.02) first");
}

TEST_F(DrapeRefuses, TooTightGarment_IsRefusedWithAFittingSize) {
  ATELIER_TEST_FILE(root, "garments/pattern_generator/Patterns");
  const std::string dress = (root / "combos/dress.json").string();
  refused({"--garment", dress}, 3, "too tight: chest_girth of 0.8");
  refused({"--garment", dress}, 3, "pattern_scale 1.");
  refused({"--garment", dress, "--fit", "body", "--pattern_scale", "0.5"}, 3,
          "too tight for any body");
}

using DrapeOnBody = DrapeRefuses;

// The same skirt, sewn alike and let hang by either simulator: both hang, outside of the body, by
// less than a centimetre from one another.
TEST_F(DrapeOnBody, EitherSolver_LetsTheSewnSkirtHang) {
  std::vector<Mesh> hung;
  const auto hang = [&](const std::vector<std::string>& more) {
    const std::filesystem::path out = root_.path() / std::to_string(hung.size());
    std::vector<std::string> words = {"--garment", "skirt",     "--edge-length", "0.04",
                                      "--frames",  "20",        "--video",       "false",
                                      "--out",     out.string()};
    words.insert(words.end(), more.begin(), more.end());
    const ChildResult result = run(words);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr(" 0 vertices inside the body")) << more.back();
    EXPECT_THAT(result.out, HasSubstr(" 0 crossings of cloth with itself")) << more.back();
    hung.push_back(read_mesh(out / "garment.obj"));
  };
  hang({"--solver", "xpbd"});
  hang({"--solver", "projective-friction"});
  hang({"--solver", "projective-friction", "--projective-friction.iterations", "3"});
  ASSERT_EQ(hung.size(), 3U);
  ASSERT_EQ(hung[0].vertices.rows(), hung[1].vertices.rows());
  const Eigen::VectorXd apart = (hung[0].vertices - hung[1].vertices).rowwise().norm();
  EXPECT_LT(apart.mean(), 0.01);
  EXPECT_GT(apart.maxCoeff(), 1e-5) << "the option does nothing";
  EXPECT_GT((hung[2].vertices - hung[1].vertices).cwiseAbs().maxCoeff(), 1e-5)
      << "the solver's own option does nothing";
}

}  // namespace
}  // namespace atelier
