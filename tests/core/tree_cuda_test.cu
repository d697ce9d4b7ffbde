#include <gtest/gtest.h>

#include "core/random.h"
#include "core/tree_cuda.cuh"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

template <class T>
class CudaTreeTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!cuda_available()) {
      GTEST_SKIP() << "no CUDA device";
    }
  }
};
using Scalars = ::testing::Types<float, double>;
TYPED_TEST_SUITE(CudaTreeTest, Scalars);

template <class T>
std::vector<Vec3<T>> random_vectors(std::size_t n, double size, std::uint64_t seed) {
  Random random{seed};
  std::vector<Vec3<T>> vectors(n);
  for (Vec3<T>& v : vectors) {
    v.x = static_cast<T>(uniform(random, -size, size));
    v.y = static_cast<T>(uniform(random, -size, size));
    v.z = static_cast<T>(uniform(random, -size, size));
  }
  return vectors;
}

TYPED_TEST(CudaTreeTest, RefitTree_AnswersAsOnTheCpu) {
  using T = TypeParam;
  Mesh mesh = fixtures::torus(300, 200);  // 120,000 faces: several launches and the top block
  TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
  CudaTree<T> device_tree(tree);
  std::vector<Vec3<T>> moved(static_cast<std::size_t>(mesh.vertices.rows()));
  for (Index i = 0; i < mesh.vertices.rows(); ++i) {
    mesh.vertices.row(i) *= 1 + 0.1 * std::sin(static_cast<double>(i % 97));
    moved[i] = {static_cast<T>(mesh.vertices(i, 0)), static_cast<T>(mesh.vertices(i, 1)),
                static_cast<T>(mesh.vertices(i, 2))};
    mesh.vertices.row(i) << moved[i].x, moved[i].y, moved[i].z;
  }
  tree = refit_tree(std::move(tree), mesh.vertices);
  const CudaBuffer<Vec3<T>> vertices(moved);
  device_tree.refit(vertices.data());

  const auto queries = random_vectors<T>(5000, 1.5, 1);
  const CudaBuffer<Vec3<T>> device_queries(queries);
  const auto found =
      device_tree.nearest(device_queries.data(), queries.size(), std::numeric_limits<T>::infinity())
          .download();
  const double tolerance = sizeof(T) == 4 ? 5e-6 : 1e-12;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const ClosestPoint expected = closest_point(tree, {queries[i].x, queries[i].y, queries[i].z});
    ASSERT_GE(found[i].face, 0);
    EXPECT_NEAR(std::sqrt(found[i].nearest.squared_distance), std::sqrt(expected.squared_distance),
                tolerance);
  }
}

TYPED_TEST(CudaTreeTest, RepeatedQueries_AreBitIdentical) {
  using T = TypeParam;
  const Mesh mesh = fixtures::torus(100, 60);
  const TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
  const auto queries = random_vectors<T>(3000, 1.5, 2);
  const auto directions = random_vectors<T>(3000, 1, 3);
  std::vector<TreeRay<T>> rays;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    rays.push_back({queries[i], directions[i], 0, std::numeric_limits<T>::infinity()});
  }
  const CudaBuffer<Vec3<T>> device_queries(queries);
  const CudaBuffer<TreeRay<T>> device_rays(rays);
  std::vector<TreePoint<T>> points;
  std::vector<TreeHit<T>> hits;
  for (int run = 0; run < 3; ++run) {
    const CudaTree<T> device_tree(tree);
    const auto new_points =
        device_tree.nearest(device_queries.data(), queries.size(), T(100)).download();
    const auto new_hits = device_tree.hits(device_rays.data(), rays.size(), false).download();
    if (run > 0) {
      for (std::size_t i = 0; i < points.size(); ++i) {
        EXPECT_EQ(new_points[i].face, points[i].face);
        EXPECT_EQ(new_points[i].nearest.squared_distance, points[i].nearest.squared_distance);
        EXPECT_EQ(new_hits[i].face, hits[i].face);
        EXPECT_EQ(new_hits[i].t, hits[i].t);
      }
    }
    points = new_points;
    hits = new_hits;
  }
}

}  // namespace
}  // namespace atelier
