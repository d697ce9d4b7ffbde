#include "core/tree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "tests/support/refusals.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

using fixtures::mesh_of;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

Vec3d vec(const Eigen::Vector3d& v) {
  return {v[0], v[1], v[2]};
}

Eigen::Vector3d random_place(Random& random, double size) {
  const double x = uniform(random, -size, size);
  const double y = uniform(random, -size, size);
  return {x, y, uniform(random, -size, size)};
}

/// Triangles of all shapes: small, long, degenerate, doubled, crossing each other.
Mesh soup(int count, std::uint64_t seed) {
  Random random{seed};
  Mesh mesh;
  mesh.vertices.resize(3 * count, 3);
  mesh.faces.resize(count, 3);
  for (int f = 0; f < count; ++f) {
    const Eigen::Vector3d center = random_place(random, 1);
    const double size = std::exp(uniform(random, -7, 0));
    for (int k = 0; k < 3; ++k) {
      mesh.vertices.row(3 * f + k) = center + random_place(random, size);
      mesh.faces(f, k) = 3 * f + k;
    }
    if (f % 10 == 3) {
      mesh.faces(f, 2) = mesh.faces(f, 1);
    } else if (f % 10 == 5) {
      mesh.vertices.row(3 * f + 2) =
          0.25 * mesh.vertices.row(3 * f) + 0.75 * mesh.vertices.row(3 * f + 1);
    } else if (f % 10 == 7) {
      mesh.faces.row(f) = mesh.faces.row(f - 1);
    }
  }
  return mesh;
}

/// The answer by a loop over all faces.
TreePoint<double> closest_by_loop(const Mesh& mesh, const Eigen::Vector3d& query) {
  TreePoint<double> best{-1, {{}, {}, std::numeric_limits<double>::infinity()}};
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    const auto row = mesh.faces.row(f);
    const Corners<double> corners = {vec(mesh.vertices.row(row[0])),
                                     vec(mesh.vertices.row(row[1])),
                                     vec(mesh.vertices.row(row[2])),
                                     row[0],
                                     row[1],
                                     row[2]};
    const auto found = nearest_on_triangle(vec(query), corners);
    if (found.squared_distance < best.nearest.squared_distance) {
      best = {static_cast<int>(f), found};
    }
  }
  return best;
}

RayHit hit_by_loop(const Mesh& mesh, const Ray& ray) {
  RayHit best;
  const auto prepared = prepare_ray(vec(ray.origin), vec(ray.direction));
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    const auto row = mesh.faces.row(f);
    const Corners<double> corners = {vec(mesh.vertices.row(row[0])),
                                     vec(mesh.vertices.row(row[1])),
                                     vec(mesh.vertices.row(row[2])),
                                     row[0],
                                     row[1],
                                     row[2]};
    const auto found = intersect(prepared, corners);
    if (found.hit && found.t >= ray.t_min && found.t <= ray.t_max && found.t < best.t) {
      best = {static_cast<int>(f),
              found.t,
              {found.barycentric.x, found.barycentric.y, found.barycentric.z}};
    }
  }
  return best;
}

Eigen::Vector3d interpolate(const Mesh& mesh, int face, const Eigen::Vector3d& barycentric) {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    point += barycentric[k] * mesh.vertices.row(mesh.faces(face, k)).transpose();
  }
  return point;
}

/// Every box holds what is below it, every face is in one slot, children come after parents.
void expect_sound(const TriangleTree& tree, Index face_count) {
  std::vector<int> seen(static_cast<std::size_t>(face_count), 0);
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
    const auto& node = tree.nodes[i];
    const auto holds = [&](Vec3d low, Vec3d high) {
      return node.low.x <= low.x && node.low.y <= low.y && node.low.z <= low.z &&
             node.high.x >= high.x && node.high.y >= high.y && node.high.z >= high.z;
    };
    if (node.count == 0) {
      for (const int child : {node.first, node.first + 1}) {
        ASSERT_GT(child, static_cast<int>(i));
        EXPECT_TRUE(holds(tree.nodes[child].low, tree.nodes[child].high));
      }
    }
    for (int slot = node.first; slot < node.first + node.count; ++slot) {
      ++seen[tree.faces[slot].face];
      for (const int v : tree.faces[slot].vertex) {
        EXPECT_TRUE(holds(tree.vertices[v], tree.vertices[v]));
      }
    }
  }
  EXPECT_EQ(seen, std::vector<int>(seen.size(), 1));
  EXPECT_EQ(tree.level_begin.back(), static_cast<int>(tree.nodes.size()));
  EXPECT_LE(tree.level_begin.size() - 1, static_cast<std::size_t>(kTreeDepth));
}

TEST(Tree, ClosestPoints_MatchBruteForceBitExact) {
  for (const int count : {1, 4, 5, 60, 700}) {
    const Mesh mesh = soup(count, 1);
    const TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
    expect_sound(tree, count);
    Random random{2};
    for (int i = 0; i < 300; ++i) {
      const Eigen::Vector3d query = random_place(random, i % 10 == 0 ? 100 : 1.5);
      const auto expected = closest_by_loop(mesh, query);
      const ClosestPoint found = closest_point(tree, query);
      ASSERT_EQ(found.face, expected.face);
      ASSERT_EQ(found.squared_distance, expected.nearest.squared_distance);
      EXPECT_NEAR(found.barycentric.sum(), 1, 1e-12);
      EXPECT_GE(found.barycentric.minCoeff(), -1e-12);
      EXPECT_LT((interpolate(mesh, found.face, found.barycentric) - found.point).norm(), 1e-9);
      EXPECT_NEAR((found.point - query).squaredNorm(), found.squared_distance, 1e-9);
    }
  }
}

TEST(Tree, ClosestPoint_IsNearerThanSurfaceSamples) {
  const Mesh mesh = soup(80, 3);
  const TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
  Random random{4};
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d query = random_place(random, 1.5);
    const double distance = std::sqrt(closest_point(tree, query).squared_distance);
    for (int f = 0; f < 80; ++f) {
      for (int u = 0; u <= 6; ++u) {
        for (int v = 0; u + v <= 6; ++v) {
          const Eigen::Vector3d sample =
              interpolate(mesh, f, {(6 - u - v) / 6.0, u / 6.0, v / 6.0});
          EXPECT_GE((sample - query).norm(), distance - 1e-12);
        }
      }
    }
  }
}

TEST(Tree, QueryOnVertexOrEdge_ReturnsLowestFace) {
  const Mesh mesh = fixtures::sphere(3);
  const TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int a = mesh.faces(f, k);
      const int b = mesh.faces(f, (k + 1) % 3);
      const ClosestPoint at_vertex = closest_point(tree, mesh.vertices.row(a));
      EXPECT_EQ(at_vertex.squared_distance, 0);
      Index lowest = 0;
      while ((mesh.faces.row(lowest).array() != a).all()) {
        ++lowest;
      }
      EXPECT_EQ(at_vertex.face, lowest);
      // Outside of a convex surface above an edge: both faces give the same bits.
      const Eigen::Vector3d above = (mesh.vertices.row(a) * 0.3 + mesh.vertices.row(b) * 0.7) * 1.5;
      lowest = 0;
      while ((mesh.faces.row(lowest).array() != a).all() ||
             (mesh.faces.row(lowest).array() != b).all()) {
        ++lowest;
      }
      EXPECT_EQ(closest_point(tree, above).face, lowest);
    }
  }
}

TEST(Tree, MaxDistance_BoundsTheSearch) {
  const Mesh mesh = mesh_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
  const TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
  EXPECT_EQ(closest_point(tree, {0, 0, 2}, 1.5).face, -1);
  EXPECT_EQ(closest_point(tree, {0, 0, 2}, 2).face, 0);  // the bound belongs to it
  EXPECT_EQ(closest_point(tree, {0, 0, 0}, 0).face, 0);
  EXPECT_TRUE(std::isinf(closest_point(tree, {0, 0, 2}, 1.5).squared_distance));
}

TEST(Tree, EmptyTree_FindsNothing) {
  const TriangleTree tree = build_tree(Points(0, 3), Triangles(0, 3));
  EXPECT_EQ(closest_point(tree, {0, 0, 0}).face, -1);
  EXPECT_EQ(first_hit(tree, {}).face, -1);
  EXPECT_FALSE(any_hit(tree, {}));
  EXPECT_THAT(faces_within(tree, {0, 0, 0}, 10), IsEmpty());
  EXPECT_THAT(faces_in_box(tree, {-1, -1, -1}, {1, 1, 1}), IsEmpty());
  EXPECT_TRUE(refit_tree(tree, Points(0, 3)).nodes.empty());
}

TEST(Tree, CoincidentOrExponentiallySpacedFaces_StayShallow) {
  const Mesh one = soup(1, 5);
  Triangles same = one.faces.replicate(500, 1);
  expect_sound(build_tree(one.vertices, same), 500);
  EXPECT_EQ(closest_point(build_tree(one.vertices, same), {0, 0, 0}).face, 0);
  // Each face twice as far as the one before: every cut parts one face from the rest.
  Points points(600, 3);
  for (int i = 0; i < 600; ++i) {
    points.row(i).setConstant(std::ldexp(1.0, -i));
  }
  expect_sound(build_point_tree(points, {1}), 600);
}

TEST(Tree, RefitTree_MatchesBruteForce) {
  Mesh mesh = soup(300, 6);
  TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
  Random random{7};
  for (Index i = 0; i < mesh.vertices.rows(); ++i) {
    mesh.vertices.row(i) += random_place(random, 0.3);
  }
  tree = refit_tree(std::move(tree), mesh.vertices);
  expect_sound(tree, 300);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d query = random_place(random, 1.5);
    const auto expected = closest_by_loop(mesh, query);
    EXPECT_EQ(closest_point(tree, query).face, expected.face);
    const Ray ray = {query, random_place(random, 1)};
    EXPECT_EQ(first_hit(tree, ray).face, hit_by_loop(mesh, ray).face);
  }
}

TEST(Tree, PointTree_FindsNearestNeighbors) {
  Random random{8};
  Points points(500, 3);
  for (Index i = 0; i < points.rows(); ++i) {
    points.row(i) = random_place(random, 1);
  }
  points.row(401) = points.row(17);
  const TriangleTree tree = build_point_tree(points);
  EXPECT_EQ(closest_point(tree, points.row(401)).face, 17);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d query = random_place(random, 1.2);
    Index nearest = 0;
    (points.rowwise() - query.transpose()).rowwise().squaredNorm().minCoeff(&nearest);
    const ClosestPoint found = closest_point(tree, query);
    EXPECT_EQ(found.face, nearest);
    EXPECT_EQ(found.point, points.row(nearest).transpose());
  }
}

TEST(Tree, FirstHits_MatchBruteForce) {
  const Mesh mesh = soup(400, 9);
  const TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
  Random random{10};
  int hits = 0;
  for (int i = 0; i < 2000; ++i) {
    Ray ray = {random_place(random, 2), random_place(random, 1)};
    if (i % 3 == 0) {
      ray.direction[i % 2] = 0;  // along the planes of boxes
    }
    if (i % 5 == 0) {
      ray.t_min = 0.5;
      ray.t_max = 1.5;
    }
    const RayHit expected = hit_by_loop(mesh, ray);
    const RayHit found = first_hit(tree, ray);
    ASSERT_EQ(found.face, expected.face);
    ASSERT_EQ(found.t, expected.t);
    EXPECT_EQ(any_hit(tree, ray), expected.face >= 0);
    if (found.face >= 0) {
      ++hits;
      const Eigen::Vector3d point = ray.origin + found.t * ray.direction;
      EXPECT_LT((interpolate(mesh, found.face, found.barycentric) - point).norm(), 1e-9);
      EXPECT_NEAR(found.barycentric.sum(), 1, 1e-12);
      EXPECT_GE(found.barycentric.minCoeff(), 0);
    }
  }
  EXPECT_GT(hits, 200);
}

TEST(Tree, RaysThroughVerticesAndEdges_NeverMiss) {
  // Rays from inside through every vertex and edge midpoint of a closed surface.
  const Mesh mesh = fixtures::sphere(3);
  const TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
  Random random{11};
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d origin = random_place(random, 0.3);
      const Eigen::Vector3d a = mesh.vertices.row(mesh.faces(f, k));
      const Eigen::Vector3d b = mesh.vertices.row(mesh.faces(f, (k + 1) % 3));
      for (const Eigen::Vector3d& target : {a, Eigen::Vector3d(0.5 * (a + b))}) {
        const RayHit hit = first_hit(tree, {origin, target - origin});
        ASSERT_GE(hit.face, 0);
        EXPECT_NEAR(hit.t, 1, 1e-9);
      }
    }
  }
}

TEST(Tree, AxisAlignedRays_HitFlatBoxes) {
  const Mesh mesh = fixtures::grid(8, 8);  // in the plane y = 0
  const TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
  for (int x = 0; x <= 16; ++x) {
    for (int z = 0; z <= 16; ++z) {
      const RayHit hit = first_hit(tree, {{x / 16.0, 1, z / 16.0}, {0, -2, 0}});
      ASSERT_GE(hit.face, 0);
      EXPECT_EQ(hit.t, 0.5);
      EXPECT_TRUE(any_hit(tree, {{x / 16.0, -1, z / 16.0}, {-0.0, 1, -0.0}}));
    }
  }
  EXPECT_FALSE(any_hit(tree, {{-1, 0, 0.5}, {1, 0, 0}}));  // in the plane: seen from the edge
}

TEST(Tree, RayInterval_IsClosed) {
  const Mesh mesh = mesh_of({{0, 0, 1}, {1, 0, 1}, {0, 1, 1}}, {{0, 1, 2}});
  const TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
  Ray ray = {{0.25, 0.25, 0}, {0, 0, 1}, 1, 1};
  EXPECT_EQ(first_hit(tree, ray).face, 0);
  ray.t_min = 1.0000001;
  ray.t_max = 2;
  EXPECT_EQ(first_hit(tree, ray).face, -1);
  ray = {{0.2, 0.2, 3}, {0, 0, 1}};  // behind the origin
  EXPECT_EQ(first_hit(tree, ray).face, -1);
  EXPECT_TRUE(std::isinf(first_hit(tree, ray).t));
}

TEST(Tree, FacesWithinRadius_MatchBruteForce) {
  const Mesh mesh = soup(300, 12);
  const TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
  Random random{13};
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d query = random_place(random, 1);
    const double radius = uniform(random, 0, 0.6);
    std::vector<int> expected;
    for (int f = 0; f < 300; ++f) {
      Mesh one = mesh;
      one.faces = mesh.faces.row(f);
      if (closest_by_loop(one, query).nearest.squared_distance <= radius * radius) {
        expected.push_back(f);
      }
    }
    EXPECT_EQ(faces_within(tree, query, radius), expected);
  }
}

TEST(Tree, FacesInBox_IncludeTouching) {
  const Mesh mesh = fixtures::grid(10, 10);
  const TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
  EXPECT_THAT(faces_in_box(tree, {0.01, -1, 0.01}, {0.02, 1, 0.02}), ElementsAre(0, 1));
  EXPECT_EQ(faces_in_box(tree, {-1, -1, -1}, {2, 1, 2}).size(), 200u);
  EXPECT_THAT(faces_in_box(tree, {0, 0.1, 0}, {1, 1, 1}), IsEmpty());
  EXPECT_EQ(faces_in_box(tree, {0.1, 0, 0.1}, {0.1, 0, 0.1}).size(), 8u);  // touching counts
}

TEST(Tree, AnyThreadCount_GivesTheSameTree) {
  const Mesh mesh = soup(5000, 14);
  set_thread_count(1);
  const TriangleTree one = build_tree(mesh.vertices, mesh.faces);
  set_thread_count(0);
  const TriangleTree many = build_tree(mesh.vertices, mesh.faces);
  ASSERT_EQ(one.nodes.size(), many.nodes.size());
  for (std::size_t i = 0; i < one.nodes.size(); ++i) {
    EXPECT_EQ(one.nodes[i].first, many.nodes[i].first);
    EXPECT_EQ(one.nodes[i].low.x, many.nodes[i].low.x);
  }
  for (std::size_t i = 0; i < one.faces.size(); ++i) {
    EXPECT_EQ(one.faces[i].face, many.faces[i].face);
  }
}

TEST(Tree, FloatTree_AgreesWithDouble) {
  const Mesh mesh = fixtures::sphere(3);
  const TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
  std::vector<Vec3f> vertices;
  for (const Vec3d& v : tree.vertices) {
    vertices.push_back({static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)});
  }
  std::vector<TreeNode<float>> nodes;
  for (const auto& node : tree.nodes) {
    nodes.push_back({{}, {}, node.first, node.count});
  }
  for (int i = static_cast<int>(nodes.size()) - 1; i >= 0; --i) {
    refit_node(nodes.data(), i, tree.faces.data(), vertices.data());
  }
  const TreeView<float> view = {nodes.data(), tree.faces.data(), vertices.data(),
                                static_cast<int>(nodes.size())};
  Random random{15};
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d query = random_place(random, 2);
    const Vec3f q = {static_cast<float>(query.x()), static_cast<float>(query.y()),
                     static_cast<float>(query.z())};
    const auto near = nearest_in_tree(view, q, std::numeric_limits<float>::infinity());
    EXPECT_NEAR(std::sqrt(near.nearest.squared_distance),
                std::sqrt(closest_point(tree, query).squared_distance), 2e-6);
    const auto hit = hit_in_tree(view, q, -q, 0.0f, std::numeric_limits<float>::infinity(), false);
    ASSERT_GE(hit.face, 0);
    EXPECT_NEAR(hit.t, first_hit(tree, {query, -query}).t, 1e-5);
  }
}

// What must be refused.

constexpr double kTreeNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

TriangleTree some_tree() {
  const Mesh mesh = soup(20, 16);
  return build_tree(mesh.vertices, mesh.faces);
}

TEST(TreeRefuses, NonFiniteVertex_Throws) {
  const Mesh good = soup(20, 16);
  for (const double bad : {kTreeNan, kInf, -kInf, 1e100}) {
    Mesh mesh = good;
    mesh.vertices(7, 1) = bad;
    ATELIER_EXPECT_REFUSED(build_tree(mesh.vertices, mesh.faces), LogicError, "finite coordinates");
    ATELIER_EXPECT_REFUSED(build_point_tree(mesh.vertices), LogicError, "finite coordinates");
    ATELIER_EXPECT_REFUSED(refit_tree(some_tree(), mesh.vertices), LogicError,
                           "finite coordinates");
  }
}

TEST(TreeRefuses, FaceIndexOutOfRange_Throws) {
  const Points vertices = Points::Zero(3, 3);
  for (const int bad : {3, -1}) {
    Triangles faces(1, 3);
    faces << 0, 1, bad;
    ATELIER_EXPECT_REFUSED(build_tree(vertices, faces), LogicError, "a vertex that is not there");
  }
}

TEST(TreeRefuses, RefitWithOtherVertexCount_Throws) {
  ATELIER_EXPECT_REFUSED(refit_tree(some_tree(), Points::Zero(59, 3)), LogicError,
                         "as many vertices as it was built from");
}

TEST(TreeRefuses, LeafSizeOutOfRange_Throws) {
  const Mesh mesh = soup(20, 18);
  for (const int bad : {0, -1, 65}) {
    ATELIER_EXPECT_REFUSED(build_tree(mesh.vertices, mesh.faces, {bad}), LogicError,
                           "leaf_size must be 1..64");
  }
}

TEST(TreeRefuses, NonFiniteQuery_Throws) {
  const TriangleTree tree = some_tree();
  for (const double bad : {kTreeNan, kInf, -kInf}) {
    ATELIER_EXPECT_REFUSED(closest_point(tree, {0, bad, 0}), LogicError, "a query must be finite");
    ATELIER_EXPECT_REFUSED(closest_points(tree, Points::Constant(2, 3, bad)), LogicError,
                           "a query must be finite");
    ATELIER_EXPECT_REFUSED(faces_within(tree, {0, bad, 0}, 1), LogicError,
                           "a query must be finite");
  }
}

TEST(TreeRefuses, NegativeDistance_Throws) {
  const TriangleTree tree = some_tree();
  for (const double bad : {-1.0, kTreeNan}) {
    ATELIER_EXPECT_REFUSED(closest_point(tree, {0, 0, 0}, bad), LogicError, "0 or more");
    ATELIER_EXPECT_REFUSED(closest_points(tree, Points::Zero(1, 3), bad), LogicError, "0 or more");
    ATELIER_EXPECT_REFUSED(faces_within(tree, {0, 0, 0}, bad), LogicError, "0 or more");
  }
}

TEST(TreeRefuses, NonFiniteRay_Throws) {
  const TriangleTree tree = some_tree();
  for (const double bad : {kTreeNan, kInf, -kInf}) {
    ATELIER_EXPECT_REFUSED(first_hit(tree, {{bad, 0, 0}, {1, 0, 0}}), LogicError,
                           "origin must be finite");
    ATELIER_EXPECT_REFUSED(any_hit(tree, {{0, 0, 0}, {1, 0, bad}}), LogicError,
                           "direction must be finite");
    ATELIER_EXPECT_REFUSED(first_hits(tree, {{{0, 0, 0}, {1, 0, bad}}}), LogicError,
                           "direction must be finite");
  }
}

TEST(TreeRefuses, ZeroRayDirection_Throws) {
  ATELIER_EXPECT_REFUSED(first_hit(some_tree(), {{0, 0, 0}, {0, 0, 0}}), LogicError, "not 0");
  ATELIER_EXPECT_REFUSED(any_hits(some_tree(), {{{0, 0, 0}, {0, 0, 0}}}), LogicError, "not 0");
}

TEST(TreeRefuses, EmptyRayInterval_Throws) {
  const TriangleTree tree = some_tree();
  ATELIER_EXPECT_REFUSED(first_hit(tree, {{0, 0, 0}, {0, 0, 1}, 2, 1}), LogicError, "t_min");
  ATELIER_EXPECT_REFUSED(first_hit(tree, {{0, 0, 0}, {0, 0, 1}, kTreeNan, 1}), LogicError, "t_min");
  ATELIER_EXPECT_REFUSED(any_hits(tree, {{{0, 0, 0}, {0, 0, 1}, 0, kTreeNan}}), LogicError,
                         "t_min");
}

TEST(TreeRefuses, InvertedOrNonFiniteBox_Throws) {
  const TriangleTree tree = some_tree();
  ATELIER_EXPECT_REFUSED(faces_in_box(tree, {1, 0, 0}, {0, 1, 1}), LogicError, "low <= high");
  for (const double bad : {kTreeNan, kInf, -kInf}) {
    ATELIER_EXPECT_REFUSED(faces_in_box(tree, {0, bad, 0}, {1, 1, 1}), LogicError,
                           "a box must be finite");
  }
}

}  // namespace
}  // namespace atelier
