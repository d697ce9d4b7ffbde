#include "core/io/polygon_mesh.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/normals.h"
#include "core/random.h"

namespace atelier {
namespace {

PolygonMesh polygon(const std::vector<Eigen::Vector3d>& corners) {
  PolygonMesh mesh;
  mesh.vertices.resize(static_cast<Index>(corners.size()), 3);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    mesh.vertices.row(static_cast<Index>(i)) = corners[i].transpose();
    mesh.corner_vertices.push_back(static_cast<int>(i));
  }
  mesh.polygon_starts.push_back(static_cast<int>(corners.size()));
  return mesh;
}

/// Every triangle faces the polygon's way, and together they have its area.
void expect_tiles(const PolygonMesh& mesh, const Eigen::Vector3d& normal, double area) {
  const Mesh cut = triangulated(mesh);
  ASSERT_EQ(cut.faces.rows(), static_cast<Index>(mesh.corner_vertices.size()) - 2);
  const Eigen::VectorXd areas = face_areas(cut.vertices, cut.faces);
  const Points normals = face_normals(cut.vertices, cut.faces);
  EXPECT_NEAR(areas.sum(), area, 1e-9 * area);
  for (Index f = 0; f < cut.faces.rows(); ++f) {
    if (areas[f] > 1e-12 * area) {
      EXPECT_GT(normals.row(f).dot(normal.transpose()), 0.99) << "face " << f;
    }
  }
}

TEST(Triangulated, ConcaveQuad_IsSplitAtReflexCorner) {
  // An arrow: a fan from its first corner would turn one triangle over.
  const Mesh mesh = triangulated(polygon({{0, 0, 0}, {2, 1, 0}, {0, 2, 0}, {0.5, 1, 0}}));
  ASSERT_EQ(mesh.faces.rows(), 2);
  expect_tiles(polygon({{0, 0, 0}, {2, 1, 0}, {0, 2, 0}, {0.5, 1, 0}}), {0, 0, 1}, 1.5);
}

TEST(Triangulated, ConcaveOutlines_AreTiledExactly) {
  const std::vector<Eigen::Vector3d> l = {{0, 0, 0}, {3, 0, 0}, {3, 1, 0},
                                          {1, 1, 0}, {1, 4, 0}, {0, 4, 0}};
  expect_tiles(polygon(l), {0, 0, 1}, 6);
  const std::vector<Eigen::Vector3d> u = {{0, 0, 0}, {5, 0, 0}, {5, 5, 0}, {4, 5, 0},
                                          {4, 1, 0}, {1, 1, 0}, {1, 5, 0}, {0, 5, 0}};
  expect_tiles(polygon(u), {0, 0, 1}, 13);
}

TEST(Triangulated, RandomStars_AreTiledInAnyPlane) {
  for (int trial = 0; trial < 50; ++trial) {
    Random random{7, static_cast<std::uint64_t>(trial), 0};
    const int n = 5 + trial % 60;
    const Eigen::Vector3d axis =
        Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(uniform(random, 0, 3), axis));
    std::vector<Eigen::Vector3d> corners;
    double area = 0;
    std::vector<Eigen::Vector2d> flat;
    for (int i = 0; i < n; ++i) {
      const double angle = 2 * std::numbers::pi * i / n;
      const double radius = uniform(random, 0.2, 1.0);
      flat.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
      corners.push_back(turn * Eigen::Vector3d(flat.back().x(), flat.back().y(), 0) +
                        Eigen::Vector3d(3, -2, 1));
    }
    for (int i = 0; i < n; ++i) {
      const Eigen::Vector2d& a = flat[static_cast<std::size_t>(i)];
      const Eigen::Vector2d& b = flat[static_cast<std::size_t>((i + 1) % n)];
      area += (a.x() * b.y() - a.y() * b.x()) / 2;
    }
    expect_tiles(polygon(corners), turn * Eigen::Vector3d(0, 0, 1), area);
  }
}

TEST(Triangulated, DegeneratePolygons_GiveAllTheirTriangles) {
  expect_tiles(polygon({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}}), {0, 0, 1}, 4);
  EXPECT_EQ(triangulated(polygon({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}})).faces.rows(), 2);
  EXPECT_EQ(triangulated(polygon({{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}})).faces.rows(), 2);
  // A bow tie.
  EXPECT_EQ(triangulated(polygon({{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}})).faces.rows(), 2);
}

TEST(Triangulated, HugeCoordinates_DoNotHang) {
  const double huge = 1e308;
  EXPECT_EQ(
      triangulated(
          polygon({{-huge, 0, 0}, {huge, 0, huge}, {huge, huge, 0}, {0, 0, -huge}, {1, 1, 1}}))
          .faces.rows(),
      3);
}

TEST(Triangulated, BrokenStructure_IsRefused) {
  PolygonMesh mesh = polygon({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}});
  mesh.corner_vertices[1] = 3;
  EXPECT_THROW(triangulated(mesh), LogicError);
  mesh = polygon({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}});
  mesh.polygon_starts = {0, 2, 3};
  EXPECT_THROW(triangulated(mesh), LogicError);
  mesh.polygon_starts = {0};
  EXPECT_THROW(triangulated(mesh), LogicError);
  mesh.polygon_starts = {};
  EXPECT_THROW(triangulated(mesh), LogicError);
  mesh = polygon({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}});
  mesh.corner_uvs = {0, 0, 0};
  EXPECT_THROW(triangulated(mesh), LogicError);
  mesh.corner_uvs = {-1, -1};
  EXPECT_THROW(triangulated(mesh), LogicError);
  mesh = polygon({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}});
  mesh.labels = {1};
  EXPECT_THROW(triangulated(mesh), LogicError);
}

TEST(InMetresYUp, UnitsAndUpAxis_AreConverted) {
  Mesh mesh;
  mesh.vertices.resize(1, 3);
  mesh.vertices << 1, 2, 3;
  mesh.normals.resize(1, 3);
  mesh.normals << 0, 0, 1;
  const Mesh from_z = in_metres_y_up(mesh, {.metres_per_unit = 0.01, .up = 'z'}, {1, 'y'});
  EXPECT_TRUE(from_z.vertices.isApprox(Eigen::RowVector3d(0.01, 0.03, -0.02)));
  EXPECT_EQ(from_z.normals.row(0), Eigen::RowVector3d(0, 1, 0));
  const Mesh from_x = in_metres_y_up(mesh, {}, {2, 'x'});
  EXPECT_EQ(from_x.vertices.row(0), Eigen::RowVector3d(-4, 2, 6));
  const Mesh same = in_metres_y_up(mesh, {1, 'y'}, {});
  EXPECT_EQ(same.vertices, mesh.vertices);
  EXPECT_THROW(in_metres_y_up(mesh, {}, {}), LogicError);
  EXPECT_THROW(in_metres_y_up(mesh, {-1, 'y'}, {}), LogicError);
  EXPECT_THROW(in_metres_y_up(mesh, {1, 'w'}, {1, 'y'}), LogicError);
}

TEST(MakeUnitRows, ZeroRow_IsRefused) {
  Points rows(2, 3);
  rows << 3, 0, 4, 0, 1, 0;
  EXPECT_TRUE(make_unit_rows(rows));
  EXPECT_EQ(rows.row(0), Eigen::RowVector3d(0.6, 0, 0.8));
  rows << 0, 0, 0, 0, 1, 0;
  EXPECT_FALSE(make_unit_rows(rows));
  rows << 1e300, 1e300, 0, 0, 1, 0;
  EXPECT_FALSE(make_unit_rows(rows));
}

}  // namespace
}  // namespace atelier
