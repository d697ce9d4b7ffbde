#include <gtest/gtest.h>

#include "core/error.h"
#include "core/random.h"
#include "core/tree.h"
#include "tests/support/devices.h"
#include "tests/support/refusals.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

class TreeOnDevice : public fixtures::DeviceTest {};
ATELIER_ON_EVERY_DEVICE(TreeOnDevice);

Points random_points(Index n, double size, std::uint64_t seed) {
  Random random{seed};
  Points points(n, 3);
  for (Index i = 0; i < points.size(); ++i) {
    points.data()[i] = uniform(random, -size, size);
  }
  return points;
}

TEST_P(TreeOnDevice, ClosestPoints_MatchSingleQueries) {
  const Mesh mesh = fixtures::torus(60, 40);
  const TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
  const Points queries = random_points(1000, 1.5, 1);
  const auto found = closest_points(tree, queries, 0.5, device());
  ASSERT_EQ(found.size(), 1000u);
  for (Index i = 0; i < queries.rows(); ++i) {
    const ClosestPoint expected = closest_point(tree, queries.row(i), 0.5);
    ASSERT_EQ(found[i].face < 0, expected.face < 0);
    if (expected.face < 0) {
      continue;
    }
    EXPECT_NEAR(found[i].squared_distance, expected.squared_distance, 1e-13);
    EXPECT_LT((found[i].point - expected.point).norm(), 1e-9);
    if (found[i].face == expected.face) {
      EXPECT_LT((found[i].barycentric - expected.barycentric).norm(), 1e-9);
    }
  }
}

TEST_P(TreeOnDevice, QueryOnVertex_ReturnsLowestFace) {
  const Mesh mesh = fixtures::sphere(3);
  const auto found =
      closest_points(build_tree(mesh.vertices, mesh.faces), mesh.vertices, 1, device());
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    Index lowest = 0;
    while ((mesh.faces.row(lowest).array() != static_cast<int>(v)).all()) {
      ++lowest;
    }
    EXPECT_EQ(found[v].face, lowest);
    EXPECT_EQ(found[v].squared_distance, 0);
  }
}

TEST_P(TreeOnDevice, FirstHits_MatchSingleRays) {
  const Mesh mesh = fixtures::torus(60, 40);
  const TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
  const Points origins = random_points(1000, 1.5, 2);
  const Points directions = random_points(1000, 1, 3);
  std::vector<Ray> rays;
  for (Index i = 0; i < origins.rows(); ++i) {
    rays.push_back({origins.row(i), directions.row(i)});
  }
  const auto found = first_hits(tree, rays, device());
  const auto any = any_hits(tree, rays, device());
  int hits = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const RayHit expected = first_hit(tree, rays[i]);
    EXPECT_EQ(found[i].face, expected.face);
    EXPECT_EQ(any[i] != 0, expected.face >= 0);
    if (expected.face >= 0) {
      ++hits;
      EXPECT_NEAR(found[i].t, expected.t, 1e-11);
      EXPECT_LT((found[i].barycentric - expected.barycentric).norm(), 1e-9);
    }
  }
  EXPECT_GT(hits, 100);
}

TEST_P(TreeOnDevice, RaysThroughVertices_NeverMiss) {
  const Mesh mesh = fixtures::sphere(4);
  std::vector<Ray> rays;
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    const Eigen::Vector3d origin(0.1, -0.2, 0.05);
    rays.push_back({origin, mesh.vertices.row(v).transpose() - origin});
  }
  for (const RayHit& hit : first_hits(build_tree(mesh.vertices, mesh.faces), rays, device())) {
    EXPECT_NEAR(hit.t, 1, 1e-9);
  }
}

TEST_P(TreeOnDevice, RefitTree_MatchesRebuiltTree) {
  Mesh mesh = fixtures::torus(200, 100);
  TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
  mesh.vertices += random_points(mesh.vertices.rows(), 0.02, 4);
  tree = refit_tree(std::move(tree), mesh.vertices);
  const TriangleTree fresh = build_tree(mesh.vertices, mesh.faces);
  const Points queries = random_points(500, 1.5, 5);
  const auto found = closest_points(tree, queries, 10, device());
  const auto expected = closest_points(fresh, queries, 10, device());
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(found[i].face, expected[i].face);
    EXPECT_EQ(found[i].squared_distance, expected[i].squared_distance);
  }
}

TEST_P(TreeOnDevice, EmptyTreeOrQueries_GiveNoHits) {
  const TriangleTree empty = build_tree(Points(0, 3), Triangles(0, 3));
  EXPECT_EQ(closest_points(empty, Points::Zero(2, 3), 1, device())[1].face, -1);
  EXPECT_EQ(first_hits(empty, {Ray{}}, device())[0].face, -1);
  const Mesh mesh = fixtures::sphere(1);
  const TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
  EXPECT_TRUE(closest_points(tree, Points(0, 3), 1, device()).empty());
  EXPECT_TRUE(any_hits(tree, {}, device()).empty());
}

TEST(TreeRefuses, CudaWithoutGpu_Throws) {
  if (cuda_available()) {
    GTEST_SKIP() << "there is a CUDA device";
  }
  const TriangleTree tree = build_point_tree(Points::Zero(1, 3));
  ATELIER_EXPECT_REFUSED(closest_points(tree, Points::Zero(1, 3), 1, Device::Cuda),
                         EnvironmentError, "CUDA");
  ATELIER_EXPECT_REFUSED(first_hits(tree, {Ray{}}, Device::Cuda), EnvironmentError, "CUDA");
  ATELIER_EXPECT_REFUSED(any_hits(tree, {Ray{}}, Device::Cuda), EnvironmentError, "CUDA");
}

}  // namespace
}  // namespace atelier
