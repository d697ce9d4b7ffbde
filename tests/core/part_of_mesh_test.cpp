#include "core/part_of_mesh.h"

#include <gtest/gtest.h>

#include "core/error.h"

namespace atelier {
namespace {

/// A square of two triangles and a third one apart, with every attribute.
Mesh three_triangles() {
  Mesh mesh;
  mesh.vertices.resize(7, 3);
  mesh.vertices << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 5, 0, 0, 6, 0, 0, 5, 1, 0;
  mesh.faces.resize(3, 3);
  mesh.faces << 0, 1, 2, 0, 2, 3, 4, 5, 6;
  mesh.normals = Points::Zero(7, 3);
  mesh.normals.col(2).setOnes();
  mesh.colors = Colors::Zero(7, 3);
  mesh.confidence.resize(7);
  for (int v = 0; v < 7; ++v) {
    mesh.colors(v, 0) = 0.1F * static_cast<float>(v);
    mesh.confidence[v] = 0.1F * static_cast<float>(v);
    mesh.labels.push_back(static_cast<std::uint8_t>(v));
  }
  mesh.uvs.resize(9, 2);
  for (int i = 0; i < 9; ++i) {
    mesh.uvs.row(i) << 0.1 * i, 0.05 * i;
  }
  mesh.uv_faces.resize(3, 3);
  mesh.uv_faces << 0, 1, 2, 3, 4, 5, 6, 7, 8;
  return mesh;
}

TEST(PartOfMesh, SelectedFaces_KeepTheirVerticesAndAttributes) {
  const Mesh mesh = three_triangles();
  const Mesh part = part_of_mesh(mesh, {2, 1});
  check_mesh(part);
  ASSERT_EQ(part.faces.rows(), 2);
  EXPECT_EQ(part.vertices.rows(), 6);
  EXPECT_EQ(part.uvs.rows(), 6);
  const std::vector<Index> from = {2, 1};
  for (Index f = 0; f < 2; ++f) {
    for (int k = 0; k < 3; ++k) {
      const int now = part.faces(f, k);
      const int before = mesh.faces(from[static_cast<std::size_t>(f)], k);
      EXPECT_EQ(part.vertices.row(now), mesh.vertices.row(before));
      EXPECT_EQ(part.colors.row(now), mesh.colors.row(before));
      EXPECT_EQ(part.normals.row(now), mesh.normals.row(before));
      EXPECT_EQ(part.confidence[now], mesh.confidence[before]);
      EXPECT_EQ(part.labels[static_cast<std::size_t>(now)], before);
      EXPECT_EQ(part.uvs.row(part.uv_faces(f, k)),
                mesh.uvs.row(mesh.uv_faces(from[static_cast<std::size_t>(f)], k)));
    }
  }
}

TEST(PartOfMesh, AllFaces_GiveTheMeshAndNoneGiveEmpty) {
  Mesh mesh = three_triangles();
  const Mesh all = part_of_mesh(mesh, {0, 1, 2});
  EXPECT_EQ(all.vertices, mesh.vertices);
  EXPECT_EQ(all.faces, mesh.faces);
  EXPECT_EQ(all.uvs, mesh.uvs);
  const Mesh none = part_of_mesh(mesh, {});
  check_mesh(none);
  EXPECT_EQ(none.vertices.rows(), 0);
  EXPECT_EQ(none.faces.rows(), 0);
}

TEST(PartOfMesh, MeshWithoutAttributes_StaysWithout) {
  Mesh mesh;
  mesh.vertices = three_triangles().vertices;
  mesh.faces = three_triangles().faces;
  const Mesh part = part_of_mesh(mesh, {2});
  EXPECT_EQ(part.vertices.rows(), 3);
  EXPECT_EQ(part.normals.rows() + part.colors.rows() + part.uvs.rows() + part.confidence.size(), 0);
  EXPECT_TRUE(part.labels.empty());
}

TEST(PartOfMesh, FaceOutOfRange_IsRefused) {
  EXPECT_THROW(part_of_mesh(three_triangles(), {0, 3}), LogicError);
  EXPECT_THROW(part_of_mesh(three_triangles(), {-1}), LogicError);
}

}  // namespace
}  // namespace atelier
