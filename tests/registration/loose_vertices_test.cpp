#include "registration/loose_vertices.h"

#include <gtest/gtest.h>

#include "core/mesh.h"
#include "core/topology.h"

namespace atelier {
namespace {

/// Two triangles whose vertices are 1 to 4; 0 and 5 are loose.
Mesh with_loose() {
  Mesh mesh;
  mesh.vertices.resize(6, 3);
  mesh.vertices << 9, 9, 9, 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 8, 8, 8;
  mesh.faces.resize(2, 3);
  mesh.faces << 1, 2, 3, 1, 3, 4;
  mesh.labels = {9, 1, 2, 3, 4, 8};
  mesh.confidence = Eigen::VectorXf::LinSpaced(6, 0, 1);
  mesh.colors = Colors::Zero(6, 3);
  mesh.normals = Eigen::RowVector3d::UnitZ().replicate(6, 1);
  return mesh;
}

TEST(LooseVertices, UnusedVertices_AreRemovedKeepingOrderAndAttributes) {
  const Mesh mesh = with_loose();
  const Mesh kept = without_loose_vertices(mesh);
  check_mesh(kept);
  EXPECT_EQ(kept.vertices, mesh.vertices.middleRows(1, 4));
  EXPECT_EQ(kept.labels, (std::vector<std::uint8_t>{1, 2, 3, 4}));
  EXPECT_EQ(kept.confidence, mesh.confidence.segment(1, 4));
  EXPECT_EQ(kept.colors.rows(), 4);
  EXPECT_EQ(kept.normals.rows(), 4);
  const Topology before = topology_of(mesh.faces, 6);
  const Topology after = topology_of(kept.faces, 4);
  EXPECT_TRUE(
      (before.edges.array() - 1 == after.edges.array()).all());  // flags of edges stay theirs
}

TEST(LooseVertices, MeshWithoutLooseVertices_StaysUnchanged) {
  const Mesh kept = without_loose_vertices(with_loose());
  EXPECT_EQ(without_loose_vertices(kept).faces, kept.faces);
  EXPECT_EQ(without_loose_vertices(Mesh{}).vertices.rows(), 0);
}

}  // namespace
}  // namespace atelier
