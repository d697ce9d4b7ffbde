#include <gtest/gtest.h>

#include "simulation/contact/body_contact_math.h"
#include "simulation/contact/contact_tree.h"
#include "tests/simulation/test_bodies.h"

namespace atelier {
namespace {

/// Spheres at rest, as the contact sees them.
struct StillBody {
  std::vector<FaceIndices> faces;
  std::vector<Vec4<double>> vertices;
  ContactTree<double> tree;

  explicit StillBody(const std::vector<double>& centres, double radius = 0.2) {
    for (const double centre : centres) {
      const Mesh ball = fixtures::sphere(radius, 24, 48);
      const int first = static_cast<int>(vertices.size());
      for (Index v = 0; v < ball.vertices.rows(); ++v) {
        vertices.push_back(
            {ball.vertices(v, 0) + centre, ball.vertices(v, 1), ball.vertices(v, 2), 0});
      }
      for (Index f = 0; f < ball.faces.rows(); ++f) {
        faces.push_back(
            {first + ball.faces(f, 0), first + ball.faces(f, 1), first + ball.faces(f, 2)});
      }
    }
    std::vector<Box<double>> boxes;
    for (std::size_t f = 0; f < faces.size(); ++f) {
      boxes.push_back(swept_box(view(), static_cast<int>(f)));
    }
    tree = build_contact_tree(boxes);
  }

  BodyView<double> view() const {
    return {faces.data(), vertices.data(), vertices.data(), tree.nodes.data(),
            static_cast<int>(faces.size())};
  }
};

constexpr BodyContactRule<double> kRule{1e-3, 0.3, 0.02, 1e-3};  // 1 cm in a frame of ten substeps

/// Where a particle ends that a frame leaves at `x`. `count`: as in BodyOutlook.
Vec3<double> ended(const StillBody& body, Vec3<double> x, int count, Vec3<double> frame_start) {
  const BodyOutlook<double> outlook{1e-3, 0, 0, {}, count};
  Vec4<double> p = with_w(x, 2.0);
  end_outside(body.view(), kRule, outlook, FreeFlight<double>{frame_start, {0, 0, 0}}, 10, p,
              AloneInTree{});
  EXPECT_EQ(p.w, 2.0);
  return xyz(p);
}

TEST(EndOutside, VertexPushedInside_IsSetOnTheSurface) {
  const StillBody body({0});
  const Vec3<double> outside{0, 0.21, 0};
  for (const double depth : {1e-4, 1e-3, 0.019, 0.05}) {
    const Vec3<double> end = ended(body, {0.01, 0.2 - depth, 0.013}, 3, outside);
    EXPECT_EQ(times_inside(body.view(), end, 1.0, AloneInTree{}), 0) << depth;
    EXPECT_NEAR(norm(end), 0.2, 2e-3) << depth << ": facets lie up to 1.7 mm within the sphere";
  }
}

TEST(EndOutside, VertexOutside_StaysInPlace) {
  const StillBody body({0});
  const Vec3<double> x{0.0, 0.2001, 0.0};
  const Vec3<double> end = ended(body, x, kSearchTree, {0, 0.3, 0});
  EXPECT_EQ(norm(end - x), 0);
}

TEST(EndOutside, VertexDeepInsideBefore_IsReleasedSlowly) {
  const StillBody body({0});
  for (const int count : {kSearchDeep, kSearchBuried}) {
    const Vec3<double> deep{0, 0.196, 0};
    EXPECT_EQ(norm(ended(body, deep, count, deep) - deep), 0) << "more than a quarter of a frame";
    const Vec3<double> end = ended(body, {0, 0.1985, 0}, count, deep);
    EXPECT_EQ(times_inside(body.view(), end, 1.0, AloneInTree{}), 0);
  }
}

TEST(EndOutside, VertexDeeperThanFourTimesTheReach_StaysInPlace) {
  const StillBody body({0});
  const Vec3<double> x{0, 0.11, 0};
  EXPECT_EQ(norm(ended(body, x, kSearchTree, {0, 0.3, 0}) - x), 0);
}

TEST(EndOutside, OverlappingBody_HasNoOutside) {
  const StillBody body({-0.15, 0.15});
  const Vec3<double> x{0.0, 0.01, 0.0};
  ASSERT_EQ(times_inside(body.view(), x, 1.0, AloneInTree{}), 2);
  EXPECT_EQ(norm(ended(body, x, kSearchTree, {0, 0.3, 0}) - x), 0);
}

// Deeper than contact looks: a garment that is put on a body in its middle.
TEST(EndOutside, StartDeeperThanTheReach_IsNotThrownOut) {
  const StillBody body({0});
  const Vec3<double> x{0, 0.15, 0};
  EXPECT_EQ(norm(ended(body, x, kSearchTree, {0, 0.14, 0}) - x), 0);
}

TEST(EndOutside, VertexBetweenOverlappingLimbs_IsNoDeeperThanTheOverlap) {
  for (const double overlap : {0.002, 0.01, 0.02}) {
    const StillBody body({overlap / 2 - 0.2, 0.2 - overlap / 2});
    const Vec3<double> x{overlap / 2 + 1e-3, 0.0021, 0.0013};
    ASSERT_EQ(times_inside(body.view(), x, 1.0, AloneInTree{}), 1);
    const Vec3<double> end = ended(body, x, kSearchTree, {0, 0.3, 0});
    const double deepest = std::max(0.2 - norm(end - Vec3<double>{overlap / 2 - 0.2, 0, 0}),
                                    0.2 - norm(end - Vec3<double>{0.2 - overlap / 2, 0, 0}));
    EXPECT_LT(deepest, overlap + 2e-3) << overlap << ": facets lie within the sphere";
  }
}

// Between two limbs with less room than the cloth is thick it ends in the gap.
TEST(EndOutside, VertexBetweenTwoLimbs_EndsInTheGap) {
  const StillBody body({-0.2005, 0.2005});
  const Vec3<double> end = ended(body, {0.01, 0.0, 0.0}, kSearchTree, {0, 0.3, 0});
  EXPECT_EQ(times_inside(body.view(), end, 1.0, AloneInTree{}), 0);
  EXPECT_LT(std::abs(end.x), 1e-3);
}

TEST(EndOutside, VertexWithinItsSweptBound_IsNotMoved) {
  const StillBody body({0});
  const Vec3<double> x{0, 0.1995, 0};
  EXPECT_EQ(norm(ended(body, x, 3, x) - x), 0) << "its candidates have seen to it";
  EXPECT_EQ(norm(ended(body, x, 0, x) - x), 0) << "nothing near";
}

}  // namespace
}  // namespace atelier
