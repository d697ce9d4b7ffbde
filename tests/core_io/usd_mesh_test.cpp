#include "core/io/usd_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/io/lz4_block.h"
#include "core/io/mesh_file.h"
#include "core/io/mesh_sequence_file.h"
#include "tests/support/outside_judge.h"
#include "tests/support/places.h"

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

std::filesystem::path usdc_corpus(const char* name) {
  return fixtures::source_directory() / "fuzz/corpus/usdc" / name;
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

TEST(UsdMesh, TextAndAlembic_AreRefusedWithWhatToDo) {
  EXPECT_THAT([] { read_mesh("cloth.abc"); },
              ThrowsMessage<DataError>(AllOf(HasSubstr("Alembic"), HasSubstr(".usdc"))));
  EXPECT_THAT([] { read_mesh_sequence("cloth.abc", SequenceOf::Cloth); },
              ThrowsMessage<DataError>(HasSubstr("Alembic")));
}

}  // namespace
}  // namespace atelier
