#include "core/mesh_statistics.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"

namespace atelier {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

/// A box from the origin, closed, outside counter-clockwise.
Mesh box(double x, double y, double z) {
  Mesh mesh;
  mesh.vertices.resize(8, 3);
  for (int i = 0; i < 8; ++i) {
    mesh.vertices.row(i) << (i & 4 ? x : 0), (i & 2 ? y : 0), (i & 1 ? z : 0);
  }
  mesh.faces.resize(12, 3);
  mesh.faces << 0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1, 2, 3, 7, 2, 7, 6, 0, 2, 6, 0,
      6, 4, 1, 5, 7, 1, 7, 3;
  return mesh;
}

TEST(MeshStatistics, Box_HasKnownCountsAreaAndVolume) {
  const MeshStatistics s = mesh_statistics(box(1, 2, 3), {{0, 0.5, 1}});
  EXPECT_EQ(s.vertices, 8);
  EXPECT_EQ(s.faces, 12);
  EXPECT_EQ(s.edges, 18);
  EXPECT_EQ(s.components, 1);
  EXPECT_EQ(s.boundary_loops, 0);
  EXPECT_EQ(s.non_manifold_edges + s.inconsistent_edges + s.degenerate_faces, 0);
  EXPECT_NEAR(s.area, 22, 1e-12);
  ASSERT_TRUE(s.volume);
  EXPECT_NEAR(*s.volume, 6, 1e-12);
  EXPECT_EQ(s.lowest, Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(s.highest, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(s.edge_lengths.front(), 1);
  EXPECT_NEAR(s.edge_lengths.back(), std::sqrt(13.0), 1e-15);
}

TEST(MeshStatistics, InsideOutBox_HasNegativeVolume) {
  Mesh mesh = box(1, 1, 1);
  mesh.faces.col(1).swap(mesh.faces.col(2));
  EXPECT_NEAR(*mesh_statistics(mesh).volume, -1, 1e-15);
}

TEST(MeshStatistics, BoxFarFromOrigin_KeepsVolumePrecision) {
  Mesh mesh = box(1, 1, 1);
  mesh.vertices.array() += 4096;
  EXPECT_NEAR(*mesh_statistics(mesh).volume, 1, 1e-14);
}

TEST(MeshStatistics, OpenBox_HasBoundaryLoopAndNoVolume) {
  Mesh mesh = box(1, 2, 3);
  mesh.faces.conservativeResize(10, 3);  // without the side z = 3, of 1 by 2
  const MeshStatistics s = mesh_statistics(mesh);
  EXPECT_EQ(s.boundary_loops, 1);
  EXPECT_NEAR(s.boundary_length, 6, 1e-12);
  EXPECT_FALSE(s.volume);
}

TEST(MeshStatistics, FlippedFace_IsInconsistentAndHasNoVolume) {
  Mesh mesh = box(1, 1, 1);
  std::swap(mesh.faces(0, 1), mesh.faces(0, 2));
  const MeshStatistics s = mesh_statistics(mesh);
  EXPECT_EQ(s.inconsistent_edges, 3);
  EXPECT_FALSE(s.volume);
}

// Two faces that pass their edge in the same direction: its border is no loop of either side.
TEST(MeshStatistics, InconsistentBoundary_HasLengthButNoLoop) {
  Mesh mesh;
  mesh.vertices.resize(4, 3);
  mesh.vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, -1, 0;
  mesh.faces.resize(2, 3);
  mesh.faces << 0, 1, 2, 0, 1, 3;
  const MeshStatistics s = mesh_statistics(mesh);
  EXPECT_EQ(s.inconsistent_edges, 1);
  EXPECT_EQ(s.boundary_loops, 0);
  EXPECT_NEAR(s.boundary_length, 2 + 2 * std::sqrt(2.0), 1e-12);
}

TEST(MeshStatistics, DefectiveMesh_CountsEachDefect) {
  Mesh mesh = box(1, 1, 1);
  mesh.vertices.conservativeResize(9, 3);
  mesh.vertices.row(8) << 5, 5, 5;
  mesh.faces.conservativeResize(14, 3);
  mesh.faces.row(12) << 0, 1, 4;  // a third face at two edges
  mesh.faces.row(13) << 2, 2, 3;
  const MeshStatistics s = mesh_statistics(mesh);
  EXPECT_GE(s.non_manifold_edges, 1);
  EXPECT_EQ(s.degenerate_faces, 1);
  EXPECT_EQ(s.isolated_vertices, 1);
  EXPECT_EQ(s.components, 2);
}

TEST(MeshStatistics, EdgeLengthQuantiles_AreInterpolated) {
  Mesh mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << 0, 0, 0, 3, 0, 0, 0, 4, 0;
  mesh.faces.resize(1, 3);
  mesh.faces << 0, 1, 2;  // edges 3, 4, 5
  EXPECT_THAT(mesh_statistics(mesh, {{0, 0.25, 0.5, 1}}).edge_lengths, ElementsAre(3, 3.5, 4, 5));
}

TEST(MeshStatistics, PointCloud_HasComponentsButNoArea) {
  Mesh mesh;
  mesh.vertices.resize(2, 3);
  mesh.vertices << 0, 0, 0, 1, 1, 1;
  const MeshStatistics s = mesh_statistics(mesh);
  EXPECT_EQ(s.components, 2);
  EXPECT_EQ(s.area, 0);
  EXPECT_FALSE(s.volume);
  EXPECT_THAT(s.edge_lengths, IsEmpty());
}

TEST(MeshStatistics, EmptyMesh_HasZeroCounts) {
  const MeshStatistics s = mesh_statistics(Mesh{});
  EXPECT_EQ(s.vertices, 0);
  EXPECT_EQ(s.edges, 0);
  EXPECT_FALSE(s.volume);
}

TEST(MeshStatistics, BadIndexOrNonFiniteVertex_IsRefused) {
  Mesh mesh = box(1, 1, 1);
  mesh.faces(3, 1) = 8;
  EXPECT_THROW(mesh_statistics(mesh), DataError);
  mesh = box(1, 1, 1);
  mesh.faces(3, 1) = -1;
  EXPECT_THROW(mesh_statistics(mesh), DataError);
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    mesh = box(1, 1, 1);
    mesh.vertices(2, 1) = bad;
    EXPECT_THROW(mesh_statistics(mesh), DataError);
  }
}

TEST(MeshStatistics, QuantileOutOfRange_IsRefused) {
  for (const double bad : {-0.1, 1.1, std::nan("")}) {
    EXPECT_THROW(mesh_statistics(box(1, 1, 1), {{bad}}), LogicError);
  }
}

}  // namespace
}  // namespace atelier
