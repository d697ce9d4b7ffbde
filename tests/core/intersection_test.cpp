#include "core/intersection.h"

#include <Eigen/Geometry>
#include <limits>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/random.h"

namespace atelier {
namespace {

Eigen::Matrix3d triangle(Eigen::Vector3d a, Eigen::Vector3d b, Eigen::Vector3d c) {
  Eigen::Matrix3d m;
  m << a.transpose(), b.transpose(), c.transpose();
  return m;
}

bool triangles_meet(const Eigen::Matrix3d& first, const Eigen::Matrix3d& second) {
  Points vertices(6, 3);
  vertices << first, second;
  Triangles faces(2, 3);
  faces << 0, 1, 2, 3, 4, 5;
  return !self_intersections(vertices, faces).empty();
}

const Eigen::Matrix3d kFlat = triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});

TEST(TrianglesMeet, PiercingAndTouchingTriangles_MeetAndSeparateDoNot) {
  EXPECT_TRUE(triangles_meet(kFlat, triangle({0.2, 0.2, -1}, {0.2, 0.2, 1}, {0.3, 0.9, 1})));
  EXPECT_FALSE(triangles_meet(kFlat, triangle({0.2, 0.2, 1e-6}, {0.2, 0.2, 1}, {0.3, 0.9, 1})));
  EXPECT_TRUE(triangles_meet(kFlat, triangle({0.2, 0.2, 0}, {0.2, 0.2, 1}, {0.3, 0.9, 1})));
  EXPECT_FALSE(triangles_meet(kFlat, triangle({2, 2, -1}, {2, 2, 1}, {3, 2, 1})));
}

TEST(TrianglesMeet, CoplanarTriangles_MeetWhereTheyOverlap) {
  EXPECT_TRUE(triangles_meet(kFlat, triangle({0.1, 0.1, 0}, {0.2, 0.1, 0}, {0.1, 0.2, 0})));
  EXPECT_TRUE(triangles_meet(kFlat, triangle({-1, 0.4, 0}, {2, 0.4, 0}, {0.5, 3, 0})));
  EXPECT_FALSE(triangles_meet(kFlat, triangle({0.6, 0.6, 0}, {1.6, 0.6, 0}, {0.6, 1.6, 0})));
  EXPECT_TRUE(triangles_meet(kFlat, triangle({0.5, 0.5, 0}, {1.6, 0.6, 0}, {0.6, 1.6, 0})));
}

TEST(TrianglesMeet, RandomPairs_AgreeWithEdgeIntersection) {
  Random random{3, 0, 0};
  int met = 0;
  for (int i = 0; i < 400; ++i) {
    Eigen::Matrix3d a;
    Eigen::Matrix3d b;
    for (int k = 0; k < 9; ++k) {
      a.data()[k] = uniform(random, -1, 1);
      b.data()[k] = uniform(random, -1, 1);
    }
    EXPECT_EQ(triangles_meet(a, b), triangles_meet(b, a));
    // An edge of one crosses the other: solved in floating point.
    bool crosses = false;
    const auto edges_cross = [&](const Eigen::Matrix3d& s, const Eigen::Matrix3d& t) {
      for (int e = 0; e < 3; ++e) {
        const Eigen::Vector3d p = s.row(e);
        const Eigen::Vector3d d = s.row((e + 1) % 3).transpose() - p;
        Eigen::Matrix3d m;
        m << d, t.row(0).transpose() - t.row(1).transpose(),
            t.row(0).transpose() - t.row(2).transpose();
        const Eigen::Vector3d x = m.inverse() * (t.row(0).transpose() - p);
        crosses = crosses || (x[0] >= 0 && x[0] <= 1 && x[1] >= 0 && x[2] >= 0 && x[1] + x[2] <= 1);
      }
    };
    edges_cross(a, b);
    edges_cross(b, a);
    EXPECT_EQ(triangles_meet(a, b), crosses);
    met += crosses;
  }
  EXPECT_GT(met, 30);
}

TEST(TrianglesMeet, TriangleWithoutArea_MeetsNothingAndFarOneIsRefused) {
  EXPECT_FALSE(triangles_meet(kFlat, triangle({0, 0, 0}, {1, 0, 0}, {2, 0, 0})));
  EXPECT_THROW(triangles_meet(kFlat, triangle({0, 0, 0}, {300, 0, 0}, {0, 300, 0})), LogicError);
}

TEST(SelfIntersections, OverlappingTetrahedra_IntersectAndOneDoesNot) {
  Points v(8, 3);
  v << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0.1, 0.1, 0.1, 1.1, 0.1, 0.1, 0.1, 1.1, 0.1, 0.1, 0.1,
      1.1;
  Triangles f(8, 3);
  f << 0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3, 4, 6, 5, 4, 5, 7, 5, 6, 7, 6, 4, 7;
  EXPECT_TRUE(self_intersections(v.topRows(4), f.topRows(4)).empty());
  const auto pairs = self_intersections(v, f);
  EXPECT_FALSE(pairs.empty());
  for (const auto& pair : pairs) {
    EXPECT_LT(pair[0], 4);
    EXPECT_GE(pair[1], 4);
  }
}

TEST(SelfIntersections, FoldOverSharedEdgeOrVertex_Counts) {
  Points v(5, 3);
  v << 0, 0, 0, 1, 0, 0, 0.3, 1, 0, 0.4, 0.5, 0, 0.6, -1, 0;
  Triangles f(2, 3);
  f << 0, 1, 2, 0, 1, 3;  // both on the same side of their edge, in one plane
  EXPECT_EQ(self_intersections(v, f).size(), 1u);
  f << 0, 1, 2, 1, 0, 4;  // on different sides
  EXPECT_TRUE(self_intersections(v, f).empty());
  Points w(5, 3);
  w << 0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0.5, 1, 1, -0.5;
  f << 0, 1, 2, 0, 3, 4;  // a corner shared, the far edge pierces
  EXPECT_EQ(self_intersections(w, f).size(), 1u);
  w.row(3) << 1, 1, 2;
  w.row(4) << 1, 1, 1;
  EXPECT_TRUE(self_intersections(w, f).empty());
}

TEST(SelfIntersections, NonFiniteVertexOrBadIndex_IsRefused) {
  Points v(3, 3);
  v << 0, 0, 0, 1, 0, 0, 0, 1, std::numeric_limits<double>::infinity();
  Triangles f(1, 3);
  f << 0, 1, 2;
  EXPECT_THROW(self_intersections(v, f), LogicError);
  v(2, 2) = 0;
  f << 0, 1, 3;
  EXPECT_THROW(self_intersections(v, f), LogicError);
}

}  // namespace
}  // namespace atelier
