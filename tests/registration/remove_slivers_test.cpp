#include "registration/remove_slivers.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/normals.h"
#include "core/topology.h"
#include "core/tree.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

double smallest(const Mesh& mesh) {
  return min_corners(mesh.vertices, mesh.faces).minCoeff();
}

/// The farthest that a vertex of one surface is from another, m.
double farthest_off(const Mesh& mesh, const Mesh& surface) {
  const TriangleTree tree = build_tree(surface.vertices, surface.faces);
  double farthest = 0;
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    farthest =
        std::max(farthest,
                 std::sqrt(closest_point(tree, mesh.vertices.row(v).transpose()).squared_distance));
  }
  return farthest;
}

/// A sheet of 20 x 12 rectangles in the plane y = 0, 1 m wide.
Mesh sheet() {
  return fixtures::grid(20, 12);
}

TEST(RemoveSlivers, KnownTriangles_HaveTheirMinAngles) {
  Points points(4, 3);
  points << 0, 0, 0, 1, 0, 0, 0.5, 0, std::sqrt(3.0) / 2, 1, 0, 0.001;
  Triangles faces(3, 3);
  faces << 0, 1, 2, 0, 1, 3, 0, 0, 1;
  const Eigen::VectorXd least = min_corners(points, faces);
  EXPECT_NEAR(least[0], 60, 1e-9);
  EXPECT_NEAR(least[1], 0.001 * 180 / M_PI, 1e-6);
  EXPECT_EQ(least[2], 0);
  Points2 flat(3, 2);
  flat << 0, 0, 2, 0, 0, 2;
  EXPECT_NEAR(min_corners(flat, Triangles(faces.topRows(1)))[0], 45, 1e-9);
}

TEST(RemoveSlivers, SurfaceWithoutSlivers_StaysUnchanged) {
  const Mesh mesh = sheet();
  const Mesh same = remove_slivers(mesh);
  EXPECT_EQ(same.vertices, mesh.vertices);
  EXPECT_EQ(same.faces, mesh.faces);
}

TEST(RemoveSlivers, NeedleAndFlatTriangle_AreWidened) {
  for (const bool flips : {true, false}) {
    Mesh mesh = sheet();
    const int inner = 7 * 21 + 9;
    const Eigen::RowVector3d beside = mesh.vertices.row(inner + 1);
    mesh.vertices.row(inner) += 0.99 * (beside - mesh.vertices.row(inner));  // a needle
    ASSERT_LT(smallest(mesh), 1);
    const Mesh blunt = remove_slivers(mesh, {.flips = flips});
    EXPECT_GE(smallest(blunt), 10);
    EXPECT_LT(farthest_off(blunt, mesh), 1e-9);
    EXPECT_NEAR(face_areas(blunt.vertices, blunt.faces).sum(),
                face_areas(sheet().vertices, sheet().faces).sum(), 1e-9);
    if (!flips) {
      EXPECT_EQ(blunt.faces, mesh.faces);
    }
  }
}

// Whatever the noise, corners end above the bound, on the surface, which hangs together as before.
TEST(RemoveSlivers, RandomSheetsAndBalls_EndAboveTheMinAngle) {
  std::mt19937 random(20);
  int slivers = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const bool ball = trial % 2 != 0;
    Mesh mesh = ball ? fixtures::sphere(3) : sheet();
    const Mesh smooth = mesh;
    const double edge = ball ? 0.15 : 0.05;
    std::uniform_real_distribution<double> noise(-edge, edge);
    const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
    std::vector<char> rim(static_cast<std::size_t>(mesh.vertices.rows()), 0);
    for (const auto& loop : boundary_loops(topology)) {
      for (const int v : loop) {
        rim[static_cast<std::size_t>(v)] = 1;
      }
    }
    const TriangleTree tree = build_tree(smooth.vertices, smooth.faces);
    const Points normals = face_normals(smooth.vertices, smooth.faces);
    const Adjacency around = vertex_faces(topology);
    for (Index v = 0; v < mesh.vertices.rows(); ++v) {
      const Eigen::RowVector3d before = mesh.vertices.row(v);
      const Eigen::Vector3d off(noise(random), noise(random), noise(random));
      mesh.vertices.row(v) = closest_point(tree, before.transpose() + off).point.transpose();
      const Points now = face_normals(mesh.vertices, mesh.faces);
      for (const int face : around[v]) {
        if (rim[static_cast<std::size_t>(v)] != 0 || now.row(face).dot(normals.row(face)) < 0.9) {
          mesh.vertices.row(v) = before;  // folded over
        }
      }
    }
    slivers += static_cast<int>((min_corners(mesh.vertices, mesh.faces).array() < 10).count());
    const Mesh blunt = remove_slivers(mesh);
    EXPECT_GE(smallest(blunt), std::min(10.0, smallest(mesh)));
    EXPECT_GE(smallest(blunt), 9) << trial;
    EXPECT_LT(farthest_off(blunt, mesh), 0.002) << trial;
    const Topology after = topology_of(blunt.faces, blunt.vertices.rows());
    EXPECT_TRUE(is_manifold(manifold_defects(after)));
    EXPECT_EQ(euler_characteristic(after), euler_characteristic(topology));
    EXPECT_EQ(boundary_loops(after).size(), boundary_loops(topology).size());
  }
  EXPECT_GT(slivers, 400);
}

TEST(RemoveSlivers, HostileSurfaces_AreNoWorse) {
  // A wheel of 800 spokes, whose corners cannot be wide.
  Mesh wheel;
  const int count = 800;
  wheel.vertices = Points::Zero(count + 1, 3);
  wheel.faces.resize(count, 3);
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * M_PI * i / count;
    wheel.vertices.row(i + 1) << std::cos(angle), 0, -std::sin(angle);
    wheel.faces.row(i) << 0, 1 + i, 1 + (i + 1) % count;
  }
  // Points that lie on one another, a line, and three triangles at an edge.
  Mesh touching = sheet();
  touching.vertices.row(100) = touching.vertices.row(101);
  Mesh line = sheet();
  line.vertices.col(2).setZero();
  Mesh branching =
      fixtures::mesh_of({{0, 0, 0}, {1, 0, 0}, {0.5, 0.01, 0}, {0.5, -0.01, 0}, {0.5, 0, 0.01}},
                        {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}});
  for (const Mesh& mesh : {wheel, touching, line, branching, Mesh{}}) {
    const Mesh blunt = remove_slivers(mesh);
    EXPECT_TRUE(blunt.vertices.allFinite());
    if (mesh.faces.rows() > 0) {
      EXPECT_GE(smallest(blunt), smallest(mesh));
    }
  }
  EXPECT_GE(smallest(remove_slivers(touching)), 10);
}

TEST(RemoveSlivers, Folds_StayInPlace) {
  // A needle at the edge of a box: flipping across the edge would cut its corner off by 1 cm.
  Mesh mesh = sheet();
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    const double beyond = mesh.vertices(v, 0) - 0.5;
    if (beyond > 1e-9) {
      mesh.vertices.row(v) << 0.5, -beyond, mesh.vertices(v, 2);
    }
  }
  const Mesh box = mesh;
  const int inner = 7 * 21 + 11;
  mesh.vertices.row(inner) += 0.98 * (mesh.vertices.row(inner - 1) - mesh.vertices.row(inner));
  ASSERT_LT(smallest(mesh), 2);
  const Mesh blunt = remove_slivers(mesh);
  EXPECT_GE(smallest(blunt), 10);
  EXPECT_LT(farthest_off(blunt, box), 1e-9);
  EXPECT_LT(farthest_off(box, blunt), 0.006);
}

TEST(RemoveSlivers, OptionsOutOfRange_AreRefused) {
  EXPECT_THROW(remove_slivers(sheet(), {.least = -1}), LogicError);
  EXPECT_THROW(remove_slivers(sheet(), {.least = 31}), LogicError);
  EXPECT_THROW(remove_slivers(sheet(), {.off = -1}), LogicError);
  EXPECT_THROW(remove_slivers(sheet(), {.least = std::numeric_limits<double>::quiet_NaN()}),
               LogicError);
}

}  // namespace
}  // namespace atelier
