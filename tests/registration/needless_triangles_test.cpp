#include "registration/flattening/needless_triangles.h"

#include <limits>

#include <gtest/gtest.h>

#include "core/topology.h"
#include "registration/flattening/flat_pattern.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

using fixtures::mesh_of;

/// A square of two triangles, 4 on the middle of its lower side, 5 and 6 in the place of 0.
Mesh square(std::vector<std::array<int, 3>> more = {}) {
  more.insert(more.begin(), {{0, 1, 2}, {0, 2, 3}});
  return mesh_of({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0, 0}, {0, 0, 0}, {0, 0, 0}},
                 more);
}

TEST(WithoutArea, ZeroArea_IsRelativeHeightOverTheLongestEdge) {
  const Eigen::Vector3d a(0, 0, 0);
  const Eigen::Vector3d b(1, 0, 0);
  for (const double scale : {1.0, 1e-20, 1e20}) {
    EXPECT_FALSE(is_without_area(scale * a, scale * b, scale * Eigen::Vector3d(0.5, 1e-6, 0)));
    EXPECT_TRUE(is_without_area(scale * a, scale * b, scale * Eigen::Vector3d(0.5, 1e-8, 0)));
  }
  EXPECT_TRUE(is_without_area(a, a, a));
  EXPECT_TRUE(
      is_without_area(a, b, Eigen::Vector3d(0, std::numeric_limits<double>::quiet_NaN(), 0)));
}

TEST(NeedlessTriangles, DegenerateAndDuplicateTriangles_AreRemoved) {
  for (const std::array<int, 3>& needless :
       std::vector<std::array<int, 3>>{{1, 0, 4},     // on the rim, without area
                                       {0, 0, 3},     // a vertex twice
                                       {2, 0, 1},     // there already
                                       {2, 1, 0},     // turned round
                                       {4, 5, 6},     // a piece of its own, of two places
                                       {0, 5, 6}}) {  // a corner
    const Mesh mesh = without_needless_triangles(square({needless}));
    ASSERT_EQ(mesh.faces.rows(), 2) << needless[0] << needless[1] << needless[2];
    EXPECT_EQ(mesh.faces, square().faces) << needless[0] << needless[1] << needless[2];
    EXPECT_EQ(mesh.vertices.rows(), 7);
    EXPECT_NO_THROW(check_flattenable(mesh));
  }
}

TEST(NeedlessTriangles, StackedNeedlessTriangles_AreRemovedLayerByLayer) {
  // Two at the lower side, one behind the other.
  const Mesh mesh = without_needless_triangles(square({{1, 0, 5}, {1, 5, 4}}));
  ASSERT_EQ(mesh.faces.rows(), 2);
  EXPECT_EQ(mesh.faces, square().faces);
}

TEST(NeedlessTriangles, InnerAndJoiningTriangles_AreKept) {
  // The square's lower side is a third triangle's, beside which there is one without area.
  const Mesh inside = mesh_of({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0.5, 0, 0}, {0.5, -1, 0}},
                              {{0, 1, 2}, {1, 0, 3}, {3, 0, 4}, {1, 3, 4}});
  EXPECT_EQ(without_needless_triangles(inside).faces.rows(), 4);
  // Its one open edge is a short one: what is left would be slit open.
  const Mesh needle = mesh_of({{0, 0, 0}, {0, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {1, 0, 0}},
                              {{0, 1, 2}, {0, 2, 3}, {1, 4, 2}});
  EXPECT_EQ(without_needless_triangles(needle).faces.rows(), 3);
}

TEST(NeedlessTriangles, TextureFaces_AreRemovedAlong) {
  Mesh mesh = square({{1, 0, 4}});
  mesh.faces.row(2).swap(mesh.faces.row(0));
  mesh.uvs = Points2::Random(9, 2);
  mesh.uv_faces.resize(3, 3);
  mesh.uv_faces << 0, 1, 2, 3, 4, 5, 6, 7, 8;
  const Mesh left = without_needless_triangles(mesh);
  ASSERT_EQ(left.uv_faces.rows(), 2);
  EXPECT_EQ(left.uv_faces.row(0), mesh.uv_faces.row(1));
  EXPECT_EQ(left.uv_faces.row(1), mesh.uv_faces.row(2));
  EXPECT_EQ(without_needless_triangles(Mesh{}).faces.rows(), 0);
}

}  // namespace
}  // namespace atelier
