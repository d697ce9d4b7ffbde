#include "simulation/contact/min_gap.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "core/random.h"
#include "simulation/contact/crossings.h"
#include "tests/simulation/cloth_fixtures.h"

namespace atelier {
namespace {

Points shifted(const Points& points, double x, double y, double z) {
  return points.rowwise() + Eigen::RowVector3d(x, y, z);
}

TEST(LeastGap, ParallelSheets_HaveTheirDistanceAsGap) {
  const Mesh sheet = fixtures::sheet(6, 6, 0.05);
  for (const double height : {1e-6, 0.001, 0.004, 0.02}) {
    const Points above = shifted(sheet.vertices, 0.013, height, 0.021);
    EXPECT_NEAR(min_gap(sheet.vertices, sheet.faces, above, sheet.faces, 0.01),
                std::min(height / 0.01, 1.0), 1e-10);
  }
  EXPECT_EQ(min_gap(sheet.vertices, sheet.faces, 0.004, {}), 1) << "neighbours are farther";
  EXPECT_EQ(min_gap(sheet.vertices, sheet.faces, sheet.vertices, Triangles(0, 3), 0.01), 1);
}

TEST(LeastGap, PassingEdges_HaveTheirDistanceAsGap) {
  Points x(6, 3);
  x << -1, 0, 0, 1, 0, 0, 0, 5, 0, 0, 0.003, -1, 0, 0.003, 1, 0, 5, 5;
  Triangles one(1, 3);
  one << 0, 1, 2;
  Points first = x.topRows(3);
  first.row(2) << 0, -5, 0;  // below: the edges are what is nearest
  EXPECT_NEAR(min_gap(first, one, x.bottomRows(3), one, 0.1), 0.03, 1e-10);
}

TEST(LeastGap, Crease_HasTheGapOfItsFlaps) {
  // A strip of two quads' width, folded over a ridge of 2 mm.
  Points x(8, 3);
  x << 0, 0, 0, 0, 0, 1, 1, 0, 0, 1, 0, 1, 1, 0.002, 0, 1, 0.002, 1, 0.2, 0.002, 0, 0.2, 0.002, 1;
  Triangles faces(6, 3);
  faces << 0, 1, 2, 2, 1, 3, 2, 3, 4, 4, 3, 5, 4, 5, 6, 6, 5, 7;
  EXPECT_NEAR(min_gap(x, faces, 0.01, {}), 0.2, 1e-5) << "slanted edges of the ridge";
  EXPECT_EQ(count_crossings(x, faces), 0);
}

// What lies near each other at rest may do so; another layer may not.
TEST(LeastGap, Gap_IsRelativeToTheRestDistance) {
  const Mesh sheet = fixtures::sheet(4, 4, 0.05);
  const Index n = sheet.vertices.rows();
  Points x(2 * n, 3);
  x.topRows(n) = sheet.vertices;
  x.bottomRows(n) = shifted(sheet.vertices, 0, 0.001, 0);
  Triangles faces(2 * sheet.faces.rows(), 3);
  faces.topRows(sheet.faces.rows()) = sheet.faces;
  faces.bottomRows(sheet.faces.rows()) = sheet.faces.array() + static_cast<int>(n);
  EXPECT_NEAR(min_gap(x, faces, 0.004, {}), 0.25, 1e-10);
  EXPECT_EQ(min_gap(x, faces, 0.004, {&x, nullptr}), 1) << "a millimetre apart from the first";
  Points nearer = x;
  nearer.bottomRows(n).col(1).array() = 0.00045;
  EXPECT_NEAR(min_gap(nearer, faces, 0.004, {&x, nullptr}), 0.5, 1e-10);
  std::vector<int> layer(static_cast<std::size_t>(2 * n), 0);
  std::fill(layer.begin() + n, layer.end(), 1);
  EXPECT_NEAR(min_gap(x, faces, 0.004, {&x, &layer}), 0.25, 1e-10);
}

// Every pair of triangles, sampled densely: never nearer than the gap, and it is come near to.
TEST(LeastGap, RandomTriangles_AgreeWithDenseSamples) {
  Random random{11, 0, 0};
  const auto number = [&] { return uniform(random) - 0.5; };
  for (int trial = 0; trial < 40; ++trial) {
    Points x(6, 3);
    for (Index i = 0; i < x.size(); ++i) {
      x.data()[i] = number();
    }
    Triangles face(1, 3);
    face << 0, 1, 2;
    const Points a = x.topRows(3);
    const Points b = shifted(x.bottomRows(3), 0.6, 0, 0);
    const double gap = 10 * min_gap(a, face, b, face, 10);
    double sampled = 10;
    constexpr int kSteps = 24;
    const auto at = [&](const Points& t, int i, int j) -> Eigen::RowVector3d {
      const double u = i / static_cast<double>(kSteps);
      const double v = j / static_cast<double>(kSteps);
      return t.row(0) + u * (t.row(1) - t.row(0)) + v * (t.row(2) - t.row(0));
    };
    for (int i = 0; i <= kSteps; ++i) {
      for (int j = 0; i + j <= kSteps; ++j) {
        for (int k = 0; k <= kSteps; ++k) {
          for (int l = 0; k + l <= kSteps; ++l) {
            sampled = std::min(sampled, (at(a, i, j) - at(b, k, l)).norm());
          }
        }
      }
    }
    if (count_crossings(a, face, b, face) == 0) {
      EXPECT_LE(gap, sampled + 1e-12) << trial;
      EXPECT_GT(gap, sampled - 0.06) << trial;
    }
  }
}

}  // namespace
}  // namespace atelier
