#include "core/io/usd_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/io/lz4_block.h"
#include "core/io/mesh_file.h"
#include "core/io/mesh_sequence_file.h"
#include "core/io/usd_sequence.h"
#include "tests/support/outside_judge.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

std::vector<std::byte> bytes_of(std::initializer_list<int> values) {
  std::vector<std::byte> bytes;
  for (const int value : values) {
    bytes.push_back(static_cast<std::byte>(value));
  }
  return bytes;
}

std::string unpacked(std::initializer_list<int> block, std::size_t most = 1000) {
  const std::vector<std::byte> plain = lz4_block(bytes_of(block), most, "a", "b");
  return {reinterpret_cast<const char*>(plain.data()), plain.size()};
}

TEST(Lz4Block, LiteralsAndOverlappingMatches_AreUnpacked) {
  EXPECT_EQ(unpacked({0x30, 'a', 'b', 'c'}), "abc");
  // One letter, then five from one before: a run; then the last literals.
  EXPECT_EQ(unpacked({0x11, 'a', 1, 0, 0x20, 'b', 'c'}), "aaaaaabc");
  // Lengths beyond 15.
  EXPECT_EQ(unpacked({0x1F, 'a', 1, 0, 255, 2, 0x00}).size(), 1U + 4 + 15 + 255 + 2);
}

TEST(Lz4Block, Damage_IsRefused) {
  for (const auto& block : {bytes_of({0x30, 'a'}), bytes_of({0x11, 'a', 0, 0}),
                            bytes_of({0x11, 'a', 2, 0}), bytes_of({0x11, 'a', 1}), bytes_of({0xF0}),
                            bytes_of({0x1F, 'a', 1, 0, 255, 255, 255, 255, 255})}) {
    EXPECT_THAT([&] { lz4_block(block, 1000, "file", "section"); },
                ThrowsMessage<DataError>(AllOf(HasSubstr("file"), HasSubstr("section"))));
  }
  EXPECT_THAT(
      [&] {
        unpacked({0x30, 'a', 'b', 'c'}, 2);
      },
      ThrowsMessage<DataError>(HasSubstr("at most 2 bytes")));
}

std::filesystem::path usdc_corpus(const char* name) {
  return fixtures::source_directory() / "fuzz/corpus/usdc" / name;
}

/// Two triangles in a plane, as a stage.
UsdStage square() {
  UsdStage stage;
  stage.metres_per_unit = 0.01;
  stage.up = 'z';
  stage.prims.resize(2);
  stage.prims[0].name = "root";
  stage.prims[0].defined = true;
  UsdPrim& mesh = stage.prims[1];
  mesh.name = "cloth";
  mesh.type = "Mesh";
  mesh.parent = 0;
  mesh.defined = true;
  mesh.attributes["points"].value.numbers = {0, 0, 0, 100, 0, 0, 100, 100, 0, 0, 100, 0};
  mesh.attributes["faceVertexCounts"].value.numbers = {4};
  mesh.attributes["faceVertexIndices"].value.numbers = {0, 1, 2, 3};
  return stage;
}

TEST(UsdMesh, UnitAndAxis_BecomeMetresAndYUp) {
  const UsdMesh found = usd_mesh(square(), "a.usdc");
  EXPECT_EQ(found.mesh.faces.rows(), 2);
  // z up: (x, y, z) is (x, z, -y).
  EXPECT_LT((found.mesh.vertices.row(2) - Eigen::RowVector3d(1, 0, -1)).norm(), 1e-12);
  EXPECT_TRUE(found.frames.empty());
}

TEST(UsdMesh, Transforms_ApplyFromTheLastToTheFirst) {
  UsdStage stage = square();
  stage.metres_per_unit = 1;
  stage.up = 'y';
  auto& above = stage.prims[0].attributes;
  above["xformOpOrder"].value.texts = {"xformOp:translate", "xformOp:rotateXYZ", "xformOp:scale"};
  above["xformOp:translate"].value.numbers = {10, 0, 0};
  above["xformOp:rotateXYZ"].value.numbers = {90, 0, 90};
  above["xformOp:scale"].value.numbers = {0.01, 0.01, 0.02};
  auto& own = stage.prims[1].attributes;
  own["xformOpOrder"].value.texts = {"xformOp:transform", "!invert!xformOp:translate:pivot"};
  own["xformOp:transform"].value.numbers = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 50, 1};
  own["xformOp:translate:pivot"].value.numbers = {100, 0, 0};
  const UsdMesh found = usd_mesh(stage, "a.usdc");
  // Vertex 0: (0,0,0), less the pivot (-100,0,0), by the matrix (-100,0,50), scaled (-1,0,1),
  // turned about x (-1,-1,0), about z (1,-1,0), moved (11,-1,0).
  EXPECT_LT((found.mesh.vertices.row(0) - Eigen::RowVector3d(11, -1, 0)).norm(), 1e-12);
  own["xformOpOrder"].value.texts = {"!resetXformStack!"};
  EXPECT_LT((usd_mesh(stage, "a.usdc").mesh.vertices.row(1) - Eigen::RowVector3d(100, 0, 0)).norm(),
            1e-12);
}

TEST(UsdMesh, TimeSamples_AreFramesLinearInBetween) {
  UsdStage stage = square();
  stage.metres_per_unit = 1;
  stage.up = 'y';
  stage.fps = 30;
  UsdAttribute& points = stage.prims[1].attributes["points"];
  points.times = {1, 3};
  points.samples = {points.value, points.value};
  for (double& number : points.samples[1].numbers) {
    number += 2;
  }
  auto& above = stage.prims[0].attributes;
  above["xformOpOrder"].value.texts = {"xformOp:translate"};
  above["xformOp:translate"].times = {2};
  above["xformOp:translate"].samples = {{{0, 0, 5}, {}}};
  const UsdMesh found = usd_mesh(stage, "a.usdc");
  EXPECT_EQ(found.times, (std::vector<double>{1, 2, 3}));
  EXPECT_EQ(found.fps, 30);
  EXPECT_EQ(found.frames[1].row(0), Eigen::RowVector3d(1, 1, 6));
  EXPECT_EQ(found.frames[2].row(0), Eigen::RowVector3d(2, 2, 7));
}

TEST(UsdMesh, HiddenGuidesAndClasses_AreLeftOut) {
  for (const auto& [name, value] :
       {std::pair("visibility", "invisible"), std::pair("purpose", "guide")}) {
    UsdStage stage = square();
    stage.prims[0].attributes[name].value.texts = {value};
    EXPECT_THAT([&] { usd_mesh(stage, "a.usdc"); }, ThrowsMessage<DataError>(HasSubstr("no mesh")))
        << name;
  }
  UsdStage stage = square();
  stage.prims[1].defined = false;
  EXPECT_THROW(usd_mesh(stage, "a.usdc"), DataError);
  stage = square();
  stage.prims[0].refers = true;
  ASSERT_EQ(usd_mesh(stage, "a.usdc").findings.size(), 1U);
  EXPECT_EQ(usd_mesh(stage, "a.usdc").findings[0].code, "usd-references");
}

TEST(UsdMesh, MeshesWithoutPoints_AreLeftOut) {
  UsdStage stage = square();
  UsdPrim hollow = stage.prims[1];
  hollow.attributes.erase("points");
  stage.prims.push_back(hollow);
  const UsdMesh found = usd_mesh(stage, "a.usdc");
  EXPECT_EQ(found.mesh.faces.rows(), 2);
  ASSERT_EQ(found.findings.size(), 1u);
  EXPECT_EQ(found.findings[0].code, "usd-empty");
  stage.prims[1] = hollow;
  EXPECT_THAT([&] { usd_mesh(stage, "a.usdc"); },
              ThrowsMessage<DataError>(HasSubstr("no mesh that has points")));
}

// Paths that only a payload or a target names have numbers and stand in no tree.
TEST(UsdMesh, NumbersOfPathsWithGaps_AreRead) {
  const Points plain = read_mesh(usdc_corpus("small.usdc")).vertices;
  EXPECT_EQ(read_mesh(usdc_corpus("path_gap.usdc")).vertices, plain);
}

TEST(UsdMesh, SkinsAndInstancers_AreSaid) {
  UsdStage stage = square();
  EXPECT_TRUE(usd_mesh(stage, "a.usdc").findings.empty());
  stage.prims[1].skinned = true;
  UsdPrim instancer = stage.prims[0];
  instancer.type = "PointInstancer";
  stage.prims.push_back(instancer);
  UsdPrim prototype = stage.prims[1];
  prototype.parent = 2;
  stage.prims.push_back(prototype);
  const UsdMesh found = usd_mesh(stage, "a.usdc");
  EXPECT_EQ(found.mesh.faces.rows(), 2);  // the prototype has its place from the instancer
  ASSERT_EQ(found.findings.size(), 2u);
  EXPECT_EQ(found.findings[0].code, "usd-skin");
  EXPECT_THAT(found.findings[0].what, HasSubstr("1 Mesh prim with a skeleton"));
  EXPECT_EQ(found.findings[1].code, "usd-instances");
}

TEST(UsdMesh, TextureCoordinatesOfCornersOrVertices_AreRead) {
  UsdStage stage = square();
  UsdAttribute& uv = stage.prims[1].attributes["primvars:st"];
  uv.value.numbers = {0, 0, 1, 0, 1, 1, 0, 1};
  for (const char* interpolation : {"faceVarying", "vertex"}) {
    uv.interpolation = interpolation;
    const Mesh mesh = usd_mesh(stage, "a.usdc").mesh;
    ASSERT_EQ(mesh.uvs.rows(), 4) << interpolation;
    EXPECT_EQ(mesh.uvs.row(mesh.uv_faces(0, 2)), Eigen::RowVector2d(1, 1));
  }
  stage.prims[1].attributes["primvars:st:indices"].value.numbers = {3, 2, 1, 0};
  EXPECT_EQ(usd_mesh(stage, "a.usdc").mesh.uvs.rows(), 4);
  stage.prims[1].attributes["orientation"].value.texts = {"leftHanded"};
  const Mesh turned = usd_mesh(stage, "a.usdc").mesh;
  EXPECT_EQ(turned.faces.row(0), Eigen::RowVector3i(3, 2, 1));
}

TEST(UsdMesh, ArraysThatDoNotFit_AreRefusedByTheirPrim) {
  const auto refused = [](const std::string& name, std::vector<double> numbers) {
    UsdStage stage = square();
    stage.prims[1].attributes[name].value.numbers = std::move(numbers);
    try {
      usd_mesh(stage, "a.usdc");
      return std::string("read");
    } catch (const DataError& error) {
      return std::string(error.what());
    }
  };
  EXPECT_THAT(refused("points", {0, 0}), HasSubstr("prim cloth"));
  EXPECT_THAT(refused("points", {NAN, 0, 0}), HasSubstr("not finite"));
  EXPECT_THAT(refused("points", {0, 0, 0}), HasSubstr("faceVertexIndices"));
  EXPECT_THAT(refused("faceVertexIndices", {0, 1, 2, -1}), HasSubstr("0 to 3"));
  EXPECT_THAT(refused("faceVertexIndices", {0, 1, 2, 1.5e9}), HasSubstr("0 to 3"));
  EXPECT_THAT(refused("faceVertexCounts", {3}), HasSubstr("4 corners"));
  EXPECT_THAT(refused("faceVertexCounts", {2, 2}), HasSubstr("a face of 2 corners"));
  UsdStage stage = square();
  stage.prims[1].attributes["points"].times = {1, 2};
  stage.prims[1].attributes["points"].samples = {stage.prims[1].attributes["points"].value,
                                                 {{0, 0, 0}, {}}};
  EXPECT_THAT([&] { usd_mesh(stage, "a.usdc"); },
              ThrowsMessage<DataError>(HasSubstr("another number of points over time")));
  stage = square();
  stage.prims[1].attributes["xformOpOrder"].value.texts = {"xformOp:shear"};
  EXPECT_THAT([&] { usd_mesh(stage, "a.usdc"); }, ThrowsMessage<DataError>(HasSubstr("shear")));
}

TEST(UsdMesh, BinaryFile_IsASequence) {
  // A cloth of 4 by 4 squares, below an Xform 1 m up, that bends over times 1 to 3.
  const MeshSequenceFile file = read_mesh_sequence(usdc_corpus("moving.usdc"), SequenceOf::Cloth);
  EXPECT_EQ(file.sequence.frame_ids, (std::vector<int>{1, 2, 3}));
  EXPECT_EQ(file.sequence.fps, 30);
  ASSERT_EQ(file.shared.faces.rows(), 32);
  for (Index f = 0; f < 3; ++f) {
    const Points points = frame(file.sequence, f).vertices;
    ASSERT_EQ(points.rows(), 25);
    EXPECT_LT((points.row(24) - Eigen::RowVector3d(1, 2, 0.1 * static_cast<double>(f))).norm(),
              1e-6);
  }
  EXPECT_THAT([] { read_mesh_sequence(usdc_corpus("small.usdc"), SequenceOf::Cloth); },
              ThrowsMessage<DataError>(HasSubstr("no time samples")));
}

TEST(UsdMesh, CubeOfBlender_IsReadInPlace) {
  const MeshFile file = read_mesh_file(usdc_corpus("small.usdc"));
  EXPECT_EQ(file.mesh.faces.rows(), 12);
  const Eigen::RowVector3d size =
      file.mesh.vertices.colwise().maxCoeff() - file.mesh.vertices.colwise().minCoeff();
  EXPECT_LT((size - Eigen::RowVector3d(2, 2, 2)).norm(), 1e-6);
}

TEST(UsdMesh, Places_AreThoseOfThreeJs) {
  ATELIER_NEEDS_JUDGE("three");
  for (const char* name : {"small.usdc", "moving.usdc"}) {
    const fixtures::Judgement found =
        fixtures::judged("three.mjs", {"usd", usdc_corpus(name).string()});
    const Points points = read_mesh(usdc_corpus(name)).vertices;
    const std::string mesh = std::string(name) == "small.usdc" ? "Cube" : "cloth";
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      EXPECT_NEAR(found.at(mesh + "@rest")[a], points.col(axis).minCoeff(), 1e-6) << name;
      EXPECT_NEAR(found.at(mesh + "@rest")[3 + a], points.col(axis).maxCoeff(), 1e-6) << name;
    }
  }
}

std::filesystem::path usda_corpus(const std::string& name) {
  return fixtures::source_directory() / "fuzz/corpus/usda" / name;
}

TEST(UsdaStage, PlacesSamplesAndTextures_AreRead) {
  const UsdMesh usd = read_usd_mesh(usda_corpus("scene.usda"));
  EXPECT_EQ(usd.fps, 30);
  EXPECT_EQ(usd.times, (std::vector<double>{1, 2}));
  ASSERT_EQ(usd.mesh.faces.rows(), 2);
  ASSERT_EQ(usd.mesh.uvs.rows(), 4);
  // At time 1: a quarter turn about z, up; then centimetres, (x, y, z) to (x, z, -y).
  EXPECT_LT((usd.frames[0].row(1) - Eigen::RowVector3d(0, 0, -1)).norm(), 1e-7);
  EXPECT_LT((usd.frames[0].row(3) - Eigen::RowVector3d(-1, -0.005, 0)).norm(), 1e-7);
  // At time 2 about (1, 2): (100, 0) less the pivot (99, -2), turned (2, 99), back (3, 101).
  EXPECT_LT((usd.frames[1].row(1) - Eigen::RowVector3d(0.03, 0, -1.01)).norm(), 1e-7);
  // Left-handed faces turn round: this one looks down.
  const Eigen::RowVector3d a = usd.mesh.vertices.row(usd.mesh.faces(0, 0));
  const Eigen::RowVector3d b = usd.mesh.vertices.row(usd.mesh.faces(0, 1));
  const Eigen::RowVector3d c = usd.mesh.vertices.row(usd.mesh.faces(0, 2));
  EXPECT_LT((b - a).cross(c - a).y(), 0);
  ASSERT_FALSE(usd.findings.empty());
  EXPECT_EQ(usd.findings[0].code, "usd-references");
}

TEST(UsdaStage, WhatIsNoStatement_IsRefusedWithItsLine) {
  const auto refused = [](const std::string& body, const char* line, const char* words) {
    EXPECT_THAT([&] { read_usda_stage("#usda 1.0\n" + body, "a.usda"); },
                ThrowsMessage<DataError>(AllOf(HasSubstr(line), HasSubstr(words))))
        << body;
  };
  refused("def Mesh \"a\" {\nfloat = 1\n}", "line 3", "the name of an attribute");
  refused("def Mesh \"a\" {\nfloat[3] a = 1\n}", "line 3", "']'");
  refused("def Mesh \"a\" {\nfloat a.timeSamples = 1\npoint3f[] points.timeSamples = 2\n}",
          "line 4", "time samples without '{'");
  refused("def Mesh \"a\" {\npoint3f[] points.timeSamples = { 1 (2, 3, 4) }\n}", "line 3",
          "no ':' behind the time");
  refused("def Mesh \"a\" {\npoint3f[] points.timeSamples = { a: (2, 3, 4) }\n}", "line 3",
          "the time 'a'");
  refused("def Mesh \"a\" {\npoint3f[] points.timeSamples = { 1: (2, 3, 4), 1: (2, 3, 4) }\n}",
          "line 3", "twice");
  refused("def Mesh \"a\" {\npoint3f[] points = }\n", "line 3", "a value");
}

// A second reader of the same text.
TEST(UsdaStage, Places_AreThoseOfThreeJs) {
  ATELIER_NEEDS_JUDGE("three");
  const fixtures::TemporaryDirectory folder;
  Mesh mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << 0.1, 0, 0, 1, 0.5, 0, 0, 1, -2;
  mesh.faces.resize(1, 3);
  mesh.faces << 0, 1, 2;
  Mesh moved = mesh;
  moved.vertices.col(0).array() += 1;
  const Sequence sequence = sequence_of({mesh, moved}, 25);
  write_usd_sequence(folder / "a.usda", sequence, "cloth");
  const UsdMesh usd = read_usd_mesh(folder / "a.usda");
  EXPECT_EQ(usd.fps, 25);
  ASSERT_EQ(usd.frames.size(), 2U);
  EXPECT_LT((usd.frames[1] - moved.vertices).cwiseAbs().maxCoeff(), 1e-6);
  const fixtures::Judgement found =
      fixtures::judged("three.mjs", {"usd", (folder / "a.usda").string()});
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    EXPECT_NEAR(found.at("cloth@rest")[a], usd.mesh.vertices.col(axis).minCoeff(), 1e-6);
    EXPECT_NEAR(found.at("cloth@rest")[3 + a], usd.mesh.vertices.col(axis).maxCoeff(), 1e-6);
  }
}

TEST(UsdMesh, Alembic_IsRefusedWithWhatToDo) {
  EXPECT_THAT([] { read_mesh("cloth.abc"); },
              ThrowsMessage<DataError>(AllOf(HasSubstr("Alembic"), HasSubstr(".usdc"))));
  EXPECT_THAT([] { read_mesh_sequence("cloth.abc", SequenceOf::Cloth); },
              ThrowsMessage<DataError>(HasSubstr("Alembic")));
}

}  // namespace
}  // namespace atelier
