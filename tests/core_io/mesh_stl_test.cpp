#include "core/io/mesh_stl.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/mesh_file.h"
#include "core/topology.h"
#include "tests/support/places.h"

namespace atelier {
namespace {

std::filesystem::path stl_corpus(const char* name) {
  return fixtures::source_directory() / "fuzz/corpus/stl" / name;
}

TEST(Stl, TextAndBinary_GiveOneSurface) {
  // A binary file whose header begins with "solid", and a text of two solids in capitals.
  for (const char* name : {"small.stl", "text.stl", "solid_binary.stl", "two_solids.stl"}) {
    SCOPED_TRACE(name);
    const MeshFile file = read_mesh_file(stl_corpus(name));
    ASSERT_EQ(file.mesh.vertices.rows(), 4);
    ASSERT_EQ(file.mesh.faces.rows(), 2);
    EXPECT_EQ(file.mesh.vertices.row(2), Eigen::RowVector3d(0, 1, 0));
    EXPECT_EQ(file.mesh.vertices.row(file.mesh.faces(1, 1)), Eigen::RowVector3d(1, 1, 0));
    const Topology topology = topology_of(file.mesh.faces, file.mesh.vertices.rows());
    EXPECT_TRUE(findings_of(manifold_defects(topology), topology).empty());
    EXPECT_EQ(file.said.metres_per_unit, 0);
    ASSERT_EQ(file.findings.size(), 1U);
    EXPECT_EQ(file.findings[0].code, "stl-joined");
    EXPECT_THAT(file.findings[0].what, ::testing::HasSubstr("6 corners of triangles in 4 places"));
  }
}

TEST(Stl, MoreTrianglesThanCounted_AreReadAndSaid) {
  std::vector<std::byte> bytes = read_file_bytes(stl_corpus("small.stl"), 1000);
  bytes[80] = std::byte{1};
  const PolygonMesh mesh = read_stl(bytes, "a.stl");
  EXPECT_EQ(polygon_count(mesh), 2);
  EXPECT_EQ(mesh.findings[0].code, "stl-count");
}

// As transfers in text mode and editors leave it.
TEST(Stl, BinaryWithLineEndsBehindIt_IsReadAndSaid) {
  for (const char* name : {"small.stl", "solid_binary.stl"}) {
    for (const char* end : {"\n", "\r\n"}) {
      std::vector<std::byte> bytes = read_file_bytes(stl_corpus(name), 1000);
      for (const char* c = end; *c != '\0'; ++c) {
        bytes.push_back(static_cast<std::byte>(*c));
      }
      const PolygonMesh mesh = read_stl(bytes, "a.stl");
      EXPECT_EQ(polygon_count(mesh), 2);
      EXPECT_EQ(mesh.findings[0].code, "stl-count");
      EXPECT_THAT(mesh.findings[0].what, ::testing::HasSubstr("of no triangle at the end"));
    }
  }
}

TEST(Stl, BinaryThatBeginsWithSolid_IsJudgedAsBinary) {
  std::vector<std::byte> bytes = read_file_bytes(stl_corpus("solid_binary.stl"), 1000);
  bytes.push_back(std::byte{'x'});
  EXPECT_THAT(
      [&] { read_stl(bytes, "a.stl"); },
      ::testing::ThrowsMessage<DataError>(::testing::HasSubstr("101 bytes behind the header")));
}

TEST(Stl, LimitsOfMeshes_AreKept) {
  Limits few;
  few.mesh_faces = 1;
  EXPECT_THROW(read_stl(stl_corpus("small.stl"), few), DataError);
  EXPECT_THROW(read_stl(stl_corpus("text.stl"), few), DataError);
  Limits small;
  small.mesh_coordinate = 0.5;
  EXPECT_THROW(read_stl(stl_corpus("small.stl"), small), DataError);
}

}  // namespace
}  // namespace atelier
