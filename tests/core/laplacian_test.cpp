#include "core/laplacian.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/normals.h"
#include "core/random.h"
#include "tests/support/refusals.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

using fixtures::mesh_of;

/// A flat grid with jittered inner vertices, obtuse faces among them.
Mesh jittered_grid() {
  Mesh mesh = fixtures::grid(9, 7);
  Random random{1};
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    if (v % 10 > 0 && v % 10 < 9 && v >= 10 && v < 70) {
      mesh.vertices(v, 0) += uniform(random, -0.04, 0.04);
      mesh.vertices(v, 2) += uniform(random, -0.04, 0.04);
    }
  }
  return mesh;
}

TEST(Laplacian, CotangentMatrix_IsSymmetricWithZeroRowSums) {
  const Mesh mesh = fixtures::torus(20, 12);
  const auto laplacian = cotangent_laplacian(mesh.vertices, mesh.faces);
  const Eigen::MatrixXd dense = laplacian;
  EXPECT_EQ(dense, dense.transpose());  // to the bit
  EXPECT_LT(dense.rowwise().sum().cwiseAbs().maxCoeff(), 1e-12);
  const Eigen::VectorXd values =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(dense).eigenvalues();
  EXPECT_GT(values[0], -1e-12);
  EXPECT_GT(values[1], 1e-3);  // connected: only constants have no energy
}

TEST(Laplacian, OneTriangle_GivesItsCotangents) {
  // Right angle at vertex 0, 45 degrees at the others.
  const Mesh mesh = mesh_of({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}}, {{0, 1, 2}});
  Eigen::Matrix3d expected;
  expected << 1, -0.5, -0.5, -0.5, 0.5, 0, -0.5, 0, 0.5;
  const Eigen::MatrixXd laplacian = cotangent_laplacian(mesh.vertices, mesh.faces);
  EXPECT_LT((laplacian - expected).cwiseAbs().maxCoeff(), 1e-15);
}

TEST(Laplacian, LinearFunction_VanishesInside) {
  const Mesh mesh = jittered_grid();
  const auto laplacian = cotangent_laplacian(mesh.vertices, mesh.faces);
  const Eigen::VectorXd u = (2 * mesh.vertices.col(0) - 3 * mesh.vertices.col(2)).array() + 5;
  const Eigen::VectorXd lu = laplacian * u;
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    if (v % 10 > 0 && v % 10 < 9 && v >= 10 && v < 70) {
      EXPECT_NEAR(lu[v], 0, 1e-12);
    }
  }
}

TEST(Laplacian, LinearFunction_EnergyIsSlopeSquaredTimesArea) {
  const Mesh mesh = jittered_grid();
  const auto laplacian = cotangent_laplacian(mesh.vertices, mesh.faces);
  const Eigen::VectorXd u = 2 * mesh.vertices.col(0) - 3 * mesh.vertices.col(2);
  EXPECT_NEAR(u.dot(laplacian * u), 13, 1e-11);  // of the unit square
}

TEST(Laplacian, SphereEigenvalues_MatchSphericalHarmonics) {
  const Mesh mesh = fixtures::sphere(3);
  const Eigen::MatrixXd laplacian = cotangent_laplacian(mesh.vertices, mesh.faces);
  for (const Eigen::VectorXd& mass :
       {vertex_areas(mesh.vertices, mesh.faces), voronoi_areas(mesh.vertices, mesh.faces)}) {
    const Eigen::VectorXd scale = mass.cwiseSqrt().cwiseInverse();
    const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(
                                       scale.asDiagonal() * laplacian * scale.asDiagonal())
                                       .eigenvalues();
    EXPECT_NEAR(values[0], 0, 1e-10);
    int at = 1;
    for (const int degree : {1, 2, 3}) {  // l (l + 1), 2 l + 1 times
      for (int i = 0; i < 2 * degree + 1; ++i, ++at) {
        // The relative error of linear elements grows with the eigenvalue.
        const double exact = degree * (degree + 1);
        EXPECT_NEAR(values[at] / exact, 1, 0.005 * exact);
      }
    }
  }
}

TEST(Laplacian, SpherePositions_GiveCurvatureNormal) {
  // On the unit sphere the Laplacian of the position is minus twice the position.
  const auto error = [](int levels) {
    const Mesh mesh = fixtures::sphere(levels);
    const Eigen::VectorXd mass = voronoi_areas(mesh.vertices, mesh.faces);
    const Points curvature = mass.cwiseInverse().asDiagonal() *
                             (cotangent_laplacian(mesh.vertices, mesh.faces) * mesh.vertices);
    return (curvature - 2 * mesh.vertices).rowwise().norm().maxCoeff();
  };
  EXPECT_LT(error(4), 0.04);
  EXPECT_LT(error(5), 0.6 * error(4));
}

TEST(VoronoiAreas, Areas_SumToSurfaceArea) {
  for (const Mesh& mesh : {jittered_grid(), fixtures::torus(20, 12), fixtures::sphere(3)}) {
    const Eigen::VectorXd areas = voronoi_areas(mesh.vertices, mesh.faces);
    EXPECT_NEAR(areas.sum(), face_areas(mesh.vertices, mesh.faces).sum(), 1e-12);
    EXPECT_GT(areas.minCoeff(), 0);
  }
}

TEST(VoronoiAreas, RightAndObtuseTriangle_MatchHandComputedAreas) {
  const Mesh right = mesh_of({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}}, {{0, 1, 2}});
  EXPECT_TRUE(
      voronoi_areas(right.vertices, right.faces).isApprox(Eigen::Vector3d(1, 0.5, 0.5), 1e-14));
  const Mesh obtuse = mesh_of({{0, 0, 0}, {2, 0, 0}, {-2, 1, 0}}, {{0, 1, 2}});  // area 1
  EXPECT_TRUE(voronoi_areas(obtuse.vertices, obtuse.faces)
                  .isApprox(Eigen::Vector3d(0.5, 0.25, 0.25), 1e-14));
}

TEST(Laplacian, QuadraticForm_IsTheIntegralOfTheSquaredGradient) {
  const Mesh mesh = fixtures::torus(16, 10);
  const Eigen::VectorXd u =
      (3 * mesh.vertices.col(0) - mesh.vertices.col(1).cwiseProduct(mesh.vertices.col(2)));
  const Points normals = face_normals(mesh.vertices, mesh.faces);
  const Eigen::VectorXd areas = face_areas(mesh.vertices, mesh.faces);
  double integral = 0;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    const auto corner = mesh.faces.row(f);
    Eigen::Matrix3d frame;
    frame << mesh.vertices.row(corner[1]) - mesh.vertices.row(corner[0]),
        mesh.vertices.row(corner[2]) - mesh.vertices.row(corner[0]), normals.row(f);
    const Eigen::Vector3d rise(u[corner[1]] - u[corner[0]], u[corner[2]] - u[corner[0]], 0);
    integral += areas[f] * (frame.inverse() * rise).squaredNorm();
  }
  EXPECT_NEAR(u.dot(cotangent_laplacian(mesh.vertices, mesh.faces) * u), integral,
              1e-12 * integral);
}

TEST(Laplacian, EmptyMesh_GivesEmptyOperators) {
  EXPECT_EQ(cotangent_laplacian(Points(0, 3), Triangles(0, 3)).rows(), 0);
  EXPECT_EQ(cotangent_laplacian(Points::Zero(3, 3), Triangles(0, 3)).nonZeros(), 0);
  EXPECT_TRUE(voronoi_areas(Points::Zero(3, 3), Triangles(0, 3)).isZero(0));
}

Mesh with_flat_face() {
  return mesh_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 0, 0}}, {{0, 1, 2}, {0, 1, 3}});
}

TEST(LaplacianRefuses, ZeroAreaFace_Throws) {
  const Mesh mesh = with_flat_face();
  ATELIER_EXPECT_REFUSED(cotangent_laplacian(mesh.vertices, mesh.faces), DataError, "face 1");
  ATELIER_EXPECT_REFUSED(cotangent_laplacian(mesh.vertices, mesh.faces), DataError,
                         "skip_degenerate");
}

TEST(LaplacianRefuses, FaceWithRepeatedVertex_Throws) {
  const Mesh mesh = mesh_of({{0, 0, 0}, {1, 0, 0}}, {{0, 1, 1}});
  ATELIER_EXPECT_REFUSED(cotangent_laplacian(mesh.vertices, mesh.faces), DataError, "face 0");
}

TEST(Laplacian, SkipDegenerate_IgnoresZeroAreaFaces) {
  const Mesh mesh = with_flat_face();
  const Eigen::MatrixXd all = cotangent_laplacian(mesh.vertices, mesh.faces, {true});
  const Eigen::MatrixXd one = cotangent_laplacian(mesh.vertices, mesh.faces.topRows(1));
  EXPECT_EQ(all, one);
  EXPECT_EQ(voronoi_areas(mesh.vertices, mesh.faces)[3], 0);
}

TEST(LaplacianRefuses, OutOfRangeFaceIndex_Throws) {
  Mesh mesh = fixtures::sphere(1);
  mesh.faces(0, 0) = 99;
  ATELIER_EXPECT_REFUSED(cotangent_laplacian(mesh.vertices, mesh.faces), LogicError, "not there");
  ATELIER_EXPECT_REFUSED(voronoi_areas(mesh.vertices, mesh.faces), LogicError, "not there");
}

TEST(LaplacianRefuses, NonFiniteVertex_Throws) {
  Mesh mesh = fixtures::sphere(1);
  mesh.vertices(4, 1) = std::numeric_limits<double>::quiet_NaN();
  ATELIER_EXPECT_REFUSED(cotangent_laplacian(mesh.vertices, mesh.faces), LogicError, "finite");
  ATELIER_EXPECT_REFUSED(voronoi_areas(mesh.vertices, mesh.faces), LogicError, "finite");
}

}  // namespace
}  // namespace atelier
