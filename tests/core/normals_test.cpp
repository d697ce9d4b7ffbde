#include "core/normals.h"

#include <Eigen/Geometry>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/support/refusals.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

using fixtures::mesh_of;

TEST(Normals, SphereFaceNormals_PointOutwards) {
  const Mesh mesh = fixtures::sphere(3);
  const Points normals = face_normals(mesh.vertices, mesh.faces);
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    EXPECT_NEAR(normals.row(f).norm(), 1, 1e-14);
    EXPECT_GT(normals.row(f).dot(mesh.vertices.row(mesh.faces(f, 0))), 0.9);
  }
}

TEST(Normals, RefinedSphere_VertexNormalsConverge) {
  const auto error = [](int levels) {
    const Mesh mesh = fixtures::sphere(levels);
    return (vertex_normals(mesh.vertices, mesh.faces) - mesh.vertices).rowwise().norm().maxCoeff();
  };
  EXPECT_LT(error(4), 0.02);
  EXPECT_LT(error(5), 0.6 * error(4));
}

TEST(Normals, CubeCorner_NormalIsIndependentOfTriangulation) {
  // Corner 0 of a cube: two triangles in one side, one each in the others.
  const Mesh mesh = mesh_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 0}},
                            {{0, 4, 1}, {0, 2, 4}, {0, 1, 3}, {0, 3, 2}});
  const Eigen::Vector3d normal = vertex_normals(mesh.vertices, mesh.faces).row(0);
  EXPECT_LT((normal + Eigen::Vector3d::Ones() / std::sqrt(3)).norm(), 1e-14);
}

TEST(Normals, ZeroAreaFaces_HaveZeroNormals) {
  const Mesh mesh = mesh_of({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}, {0, 0, 1}});
  EXPECT_TRUE(face_normals(mesh.vertices, mesh.faces).isZero(0));
  EXPECT_TRUE(vertex_normals(mesh.vertices, mesh.faces).isZero(0));
  EXPECT_TRUE(face_areas(mesh.vertices, mesh.faces).isZero(0));
}

TEST(Normals, OppositeFaces_CancelToZeroNormal) {
  const Mesh mesh = mesh_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 1}});
  EXPECT_TRUE(vertex_normals(mesh.vertices, mesh.faces).isZero(0));
}

TEST(Normals, TinyFaces_HaveUnitNormals) {
  const Mesh mesh = mesh_of({{0, 0, 0}, {1e-90, 0, 0}, {0, 1e-90, 0}}, {{0, 1, 2}});
  EXPECT_EQ(face_normals(mesh.vertices, mesh.faces).row(0), Eigen::RowVector3d(0, 0, 1));
}

TEST(Areas, TriangleAndSphere_HaveKnownAreas) {
  const Mesh triangle = mesh_of({{0, 0, 0}, {3, 0, 0}, {0, 4, 0}}, {{0, 1, 2}});
  EXPECT_DOUBLE_EQ(face_areas(triangle.vertices, triangle.faces)[0], 6);
  EXPECT_DOUBLE_EQ(vertex_areas(triangle.vertices, triangle.faces)[1], 2);
  const Mesh ball = fixtures::sphere(5);
  EXPECT_NEAR(face_areas(ball.vertices, ball.faces).sum(), 4 * std::numbers::pi, 0.01);
  EXPECT_NEAR(vertex_areas(ball.vertices, ball.faces).sum(),
              face_areas(ball.vertices, ball.faces).sum(), 1e-12);
}

TEST(Areas, EmptyMesh_HasZeroAreas) {
  EXPECT_EQ(face_areas(Points(0, 3), Triangles(0, 3)).size(), 0);
  EXPECT_TRUE(vertex_areas(Points::Zero(2, 3), Triangles(0, 3)).isZero(0));
  EXPECT_TRUE(vertex_normals(Points::Zero(2, 3), Triangles(0, 3)).isZero(0));
}

TEST(NormalsRefuse, OutOfRangeFaceIndex_Throws) {
  const Points vertices = Points::Zero(3, 3);
  for (const int bad : {3, -1}) {
    Triangles faces(1, 3);
    faces << 0, 1, bad;
    ATELIER_EXPECT_REFUSED(face_normals(vertices, faces), LogicError, "a vertex that is not there");
    ATELIER_EXPECT_REFUSED(vertex_normals(vertices, faces), LogicError,
                           "a vertex that is not there");
  }
}

TEST(AreasRefuse, OutOfRangeFaceIndex_Throws) {
  const Points vertices = Points::Zero(3, 3);
  for (const int bad : {3, -1}) {
    Triangles faces(1, 3);
    faces << 0, 1, bad;
    ATELIER_EXPECT_REFUSED(face_areas(vertices, faces), LogicError, "a vertex that is not there");
    ATELIER_EXPECT_REFUSED(vertex_areas(vertices, faces), LogicError, "a vertex that is not there");
  }
}

}  // namespace
}  // namespace atelier
