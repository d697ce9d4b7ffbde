#include "simulation/cloth/median_rest.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "core/error.h"
#include "simulation/cloth/cloth.h"
#include "tests/simulation/cloth_fixtures.h"

namespace atelier {
namespace {

double rest_length(const Garment& garment, Index face, int a, int b) {
  const auto corner = [&](int k) { return garment.rest.row(garment.rest_faces(face, k)); };
  return (corner(a) - corner(b)).norm();
}

Garment triangle(double base, double x, double y) {
  Garment garment;
  garment.mesh.vertices.resize(3, 3);
  garment.mesh.vertices << 0, 0, 0, base, 0, 0, x, y, 0;
  garment.mesh.faces.resize(1, 3);
  garment.mesh.faces << 0, 1, 2;
  return garment;
}

TEST(MedianRest, UnchangingShape_IsTheRestShape) {
  const Mesh sheet = fixtures::sheet(5, 4, 0.02, 'a');
  Garment garment = fixtures::garment_of(sheet, 0.15, 300, 4e-6);
  rest_on_median_lengths(garment, {sheet.vertices, sheet.vertices, sheet.vertices});
  ASSERT_EQ(garment.rest_faces.rows(), sheet.faces.rows());
  for (Index f = 0; f < sheet.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int next = (k + 1) % 3;
      const double length =
          (sheet.vertices.row(sheet.faces(f, k)) - sheet.vertices.row(sheet.faces(f, next))).norm();
      EXPECT_NEAR(rest_length(garment, f, k, next), length, 1e-12);
    }
    EXPECT_GT(garment.rest(garment.rest_faces(f, 2), 1), 0) << "faces up";
  }
}

TEST(MedianRest, FrameWithAFoldedEdge_DoesNotCount) {
  Garment garment = triangle(0.02, 0.01, 0.02);
  const Points flat = garment.mesh.vertices;
  Points folded = flat;
  folded(1, 0) = 0.004;
  rest_on_median_lengths(garment, {folded, flat, flat});
  EXPECT_NEAR(rest_length(garment, 0, 0, 1), 0.02, 1e-12);
  rest_on_median_lengths(garment, {folded, flat, folded});
  EXPECT_NEAR(rest_length(garment, 0, 0, 1), 0.004, 1e-12);
}

TEST(MedianRest, ImpossibleEdgeLengths_KeepTheTriangleShape) {
  Garment garment = triangle(0.02, 0.01, 0.02);
  const Points shape = garment.mesh.vertices;
  Points long_base = shape;
  long_base.row(1) << 0.2, 0, 0;  // and the third vertex beside the first, or beside the second
  Points other = long_base;
  other.row(2) << 0.19, 0.001, 0;
  rest_on_median_lengths(garment, {long_base, long_base, other, other, shape});
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    EXPECT_TRUE(std::isfinite(rest_length(garment, 0, k, next)));
    EXPECT_NEAR(rest_length(garment, 0, k, next), (shape.row(k) - shape.row(next)).norm(), 1e-12);
  }
}

TEST(MedianRest, Slivers_GetASolvableWidth) {
  for (const auto& [base, x, y] :
       {std::array<double, 3>{0.02, 0.01, 1e-9}, std::array<double, 3>{0, 0, 0.02},
        std::array<double, 3>{0.02, 0, 0}, std::array<double, 3>{0, 0, 0}}) {
    Garment garment = triangle(base, x, y);
    garment.name = "sliver";
    garment.material =
        fixtures::garment_of(fixtures::sheet(2, 2, 0.02, 'a'), 0.15, 300, 4e-6).material;
    rest_on_median_lengths(garment, {garment.mesh.vertices});
    EXPECT_TRUE(garment.rest.allFinite());
    const double longest = std::max({rest_length(garment, 0, 0, 1), rest_length(garment, 0, 1, 2),
                                     rest_length(garment, 0, 2, 0)});
    EXPECT_GE(garment.rest(2, 1), 0.04 * longest);
    EXPECT_GE(rest_length(garment, 0, 0, 1), 0.04 * longest);
  }
}

TEST(MedianRest, FramesOfAnotherMesh_AreRefused) {
  Garment garment = triangle(0.02, 0.01, 0.02);
  EXPECT_THROW(rest_on_median_lengths(garment, {}), LogicError);
  EXPECT_THROW(rest_on_median_lengths(garment, {Points::Zero(4, 3)}), LogicError);
}

}  // namespace
}  // namespace atelier
