#include "core/topology.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/support/refusals.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

using fixtures::grid;
using fixtures::mesh_of;
using fixtures::sphere;
using fixtures::tetrahedron;
using fixtures::torus;
using fixtures::tube;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Topology of(const Mesh& mesh) {
  return topology_of(mesh.faces, mesh.vertices.rows());
}

Topology of(Index vertices, const std::vector<std::array<int, 3>>& faces) {
  return topology_of(mesh_of({}, faces).faces, vertices);
}

TEST(Topology, Tetrahedron_HasSortedConsistentEdges) {
  const Topology topology = of(tetrahedron());
  Edges expected(6, 2);
  expected << 0, 1, 0, 2, 0, 3, 1, 2, 1, 3, 2, 3;
  EXPECT_EQ(topology.edges, expected);
  for (Index f = 0; f < 4; ++f) {
    for (int k = 0; k < 3; ++k) {
      const int a = topology.faces(f, k);
      const int b = topology.faces(f, (k + 1) % 3);
      const Index e = topology.face_edges(f, k);
      EXPECT_EQ(topology.edges(e, 0), std::min(a, b));
      EXPECT_EQ(topology.edges(e, 1), std::max(a, b));
      EXPECT_THAT(corners_of_edge(topology, e), ::testing::Contains(3 * f + k));
    }
  }
  EXPECT_TRUE(is_closed(topology));
  EXPECT_TRUE(is_manifold(manifold_defects(topology)));
}

TEST(Topology, EmptyMesh_HasNoEdgesOrComponents) {
  const Topology topology = of(0, {});
  EXPECT_EQ(topology.edges.rows(), 0);
  EXPECT_TRUE(boundary_loops(topology).empty());
  EXPECT_EQ(connected_components(topology).count, 0);
  EXPECT_EQ(euler_characteristic(topology), 0);
  EXPECT_TRUE(is_manifold(manifold_defects(topology)));
  EXPECT_TRUE(is_closed(topology));
  EXPECT_EQ(vertex_neighbors(topology).rows(), 0);
}

TEST(TopologyRefuses, VertexIndexBeyondLast_Throws) {
  ATELIER_EXPECT_REFUSED(of(3, {{0, 1, 3}}), LogicError, "a vertex that is not there");
}

TEST(TopologyRefuses, NegativeVertexIndex_Throws) {
  ATELIER_EXPECT_REFUSED(of(3, {{0, -1, 2}}), LogicError, "a vertex that is not there");
}

TEST(TopologyRefuses, FacesWithoutVertices_Throw) {
  ATELIER_EXPECT_REFUSED(of(0, {{0, 1, 2}}), LogicError, "a vertex that is not there");
}

TEST(Topology, KnownSurfaces_HaveTheirEulerCharacteristic) {
  EXPECT_EQ(euler_characteristic(of(sphere(2))), 2);
  EXPECT_EQ(euler_characteristic(of(torus(9, 7))), 0);
  EXPECT_EQ(euler_characteristic(of(tube(9, 4))), 0);
  EXPECT_EQ(euler_characteristic(of(grid(5, 3))), 1);
  EXPECT_EQ(euler_characteristic(of(7, {{0, 1, 2}, {3, 4, 5}})), 2);  // vertex 6 is not used
  EXPECT_EQ(euler_characteristic(of(5, {{0, 1, 2}, {3, 3, 4}})), 1);  // degenerate face
}

TEST(Topology, FaceNeighbors_AreMutual) {
  const Topology topology = of(sphere(2));
  const Triangles neighbors = face_neighbors(topology);
  for (Index f = 0; f < neighbors.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int other = neighbors(f, k);
      ASSERT_GE(other, 0);
      EXPECT_NE(other, f);
      EXPECT_TRUE((neighbors.row(other).array() == static_cast<int>(f)).any());
    }
  }
}

TEST(Topology, BoundaryAndBranchEdges_HaveNoFaceNeighbor) {
  EXPECT_EQ(face_neighbors(of(3, {{0, 1, 2}})), Triangles::Constant(1, 3, -1));
  const Triangles fan = face_neighbors(of(5, {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}}));
  EXPECT_EQ(fan, Triangles::Constant(3, 3, -1));
}

TEST(Topology, GridVertices_HaveExpectedNeighborsAndFaces) {
  const Topology topology = of(grid(2, 2));
  const Adjacency neighbors = vertex_neighbors(topology);
  EXPECT_EQ(neighbors.rows(), 9);
  EXPECT_THAT(neighbors[4], ElementsAre(1, 2, 3, 5, 6, 7));
  EXPECT_THAT(neighbors[0], ElementsAre(1, 3));
  const Adjacency faces = vertex_faces(topology);
  EXPECT_THAT(faces[0], ElementsAre(0));
  EXPECT_EQ(faces[4].size(), 6u);
  EXPECT_THAT(vertex_faces(of(4, {{0, 0, 1}}))[0], ElementsAre(0));  // once, though twice a corner
}

TEST(BoundaryLoops, Disk_HasOneLoopWithSurfaceOnTheLeft) {
  const auto loops = boundary_loops(of(3, {{0, 1, 2}}));
  EXPECT_THAT(loops, ElementsAre(ElementsAre(0, 1, 2)));
  EXPECT_THAT(boundary_loops(of(3, {{2, 1, 0}})), ElementsAre(ElementsAre(0, 2, 1)));
}

TEST(BoundaryLoops, Tube_HasTwoLoopsAndSphereNone) {
  const auto loops = boundary_loops(of(tube(12, 3)));
  ASSERT_EQ(loops.size(), 2u);
  EXPECT_EQ(loops[0].size(), 12u);
  EXPECT_EQ(loops[1].size(), 12u);
  EXPECT_EQ(loops[0][0], 0);
  EXPECT_EQ(loops[1][0], 36);
  EXPECT_EQ(loops[0][1], 1);   // along the faces' edges at the bottom
  EXPECT_EQ(loops[1][1], 47);  // and the other way round at the top
  EXPECT_THAT(boundary_loops(of(sphere(1))), IsEmpty());
}

TEST(BoundaryLoops, TouchingLoops_AreSplitAtTheirVertex) {
  // Two triangles that share only vertex 2.
  const auto loops = boundary_loops(of(5, {{0, 1, 2}, {2, 3, 4}}));
  EXPECT_THAT(loops, ElementsAre(ElementsAre(0, 1, 2), ElementsAre(2, 3, 4)));
}

TEST(BoundaryLoops, UnclosedRuns_AreOmitted) {
  // Both faces run along edge 0-1 in the same direction; their outer edges do not form a loop.
  const auto loops = boundary_loops(of(4, {{0, 1, 2}, {0, 1, 3}}));
  EXPECT_THAT(loops, IsEmpty());
}

TEST(Components, Components_AreNumberedBySmallestVertex) {
  const Components components = connected_components(of(8, {{7, 6, 5}, {0, 2, 3}, {2, 3, 4}}));
  EXPECT_EQ(components.count, 3);
  EXPECT_THAT(components.of_vertex, ElementsAre(0, 1, 0, 0, 0, 2, 2, 2));
  EXPECT_THAT(components.of_face, ElementsAre(2, 0, 0));
}

TEST(ManifoldDefects, EdgeWithThreeFaces_IsFound) {
  const Topology topology = of(5, {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}});
  const ManifoldDefects defects = manifold_defects(topology);
  EXPECT_THAT(defects.non_manifold_edges, ElementsAre(0));
  EXPECT_FALSE(is_manifold(defects));
  EXPECT_FALSE(is_closed(topology));
  const auto findings = findings_of(defects, topology);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].code, "non-manifold-edge");
  EXPECT_EQ(findings[0].place, "edge 0-1");
  EXPECT_TRUE(has_errors(findings));
}

TEST(ManifoldDefects, Bowtie_IsNonManifoldVertex) {
  const Topology topology = of(5, {{0, 1, 2}, {2, 3, 4}});
  const ManifoldDefects defects = manifold_defects(topology);
  EXPECT_THAT(defects.non_manifold_vertices, ElementsAre(2));
  EXPECT_THAT(defects.non_manifold_edges, IsEmpty());
  EXPECT_EQ(findings_of(defects, topology)[0].code, "non-manifold-vertex");
}

TEST(ManifoldDefects, TouchingTetrahedra_ShareNonManifoldVertex) {
  Mesh mesh = tetrahedron();
  Triangles faces(8, 3);
  faces.topRows(4) = mesh.faces;
  faces.bottomRows(4) = (mesh.faces.array() == 0).select(mesh.faces, mesh.faces.array() + 3);
  const ManifoldDefects defects = manifold_defects(topology_of(faces, 7));
  EXPECT_THAT(defects.non_manifold_vertices, ElementsAre(0));
  EXPECT_THAT(defects.non_manifold_edges, IsEmpty());
}

TEST(ManifoldDefects, FlippedFace_IsInconsistentOrientation) {
  Mesh mesh = tetrahedron();
  std::swap(mesh.faces(2, 0), mesh.faces(2, 1));
  const Topology topology = of(mesh);
  const ManifoldDefects defects = manifold_defects(topology);
  EXPECT_EQ(defects.inconsistent_edges.size(), 3u);
  EXPECT_THAT(defects.non_manifold_vertices, IsEmpty());
  EXPECT_EQ(findings_of(defects, topology)[0].code, "inconsistent-orientation");
}

TEST(ManifoldDefects, DuplicateFaces_AreFoundInAnyVertexOrder) {
  const Topology topology = of(3, {{0, 1, 2}, {2, 1, 0}, {1, 2, 0}});
  const ManifoldDefects defects = manifold_defects(topology);
  EXPECT_THAT(defects.duplicate_faces, ElementsAre(1, 2));
  EXPECT_THAT(findings_of(defects, topology).back().code, "duplicate-face");
}

TEST(ManifoldDefects, DegenerateFacesAndIsolatedVertices_AreFound) {
  const Topology topology = of(5, {{0, 1, 2}, {2, 2, 3}});
  EXPECT_EQ(topology.face_edges(1, 0), -1);
  const ManifoldDefects defects = manifold_defects(topology);
  EXPECT_THAT(defects.degenerate_faces, ElementsAre(1));
  EXPECT_THAT(defects.isolated_vertices, ElementsAre(4));
  const auto findings = findings_of(defects, topology);
  ASSERT_EQ(findings.size(), 2u);
  EXPECT_EQ(findings[1].severity, Severity::Note);
  EXPECT_EQ(findings[1].place, "vertex 4");
}

TEST(ManifoldDefects, LongLists_AreTruncated) {
  const Topology topology = of(9, {});
  const auto findings = findings_of(manifold_defects(topology), topology);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].place, "vertices 0, 1, 2, 3, 4, ...");
  EXPECT_EQ(findings[0].what, "9 vertices");
}

TEST(ManifoldDefects, ManifoldSurfaces_HaveNoDefects) {
  for (const Mesh& mesh : {sphere(2), torus(8, 6), tube(8, 3), grid(4, 4)}) {
    const Topology topology = of(mesh);
    EXPECT_TRUE(is_manifold(manifold_defects(topology)));
    EXPECT_TRUE(findings_of(manifold_defects(topology), topology).empty());
  }
}

}  // namespace
}  // namespace atelier
