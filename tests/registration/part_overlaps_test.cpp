#include "registration/flattening/part_overlaps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "core/cross.h"
#include "core/error.h"
#include "registration/drafting/draft_pattern.h"
#include "registration/flattening/flat_overlaps.h"
#include "registration/flattening/pattern_pieces.h"
#include "tests/registration/cut_fixtures.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

using fixtures::no_cut;
using fixtures::opened;
using fixtures::topology;
using Pairs = std::vector<std::array<int, 2>>;

/// What two counter-clockwise triangles have in common, by clipping one at the edges of the other.
double common_area(const Points2& flat, const Triangles& faces, Index f, Index g) {
  std::vector<Eigen::Vector2d> shape;
  for (int k = 0; k < 3; ++k) {
    shape.emplace_back(flat.row(faces(f, k)));
  }
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector2d a = flat.row(faces(g, k));
    const Eigen::Vector2d along = flat.row(faces(g, (k + 1) % 3)).transpose() - a;
    std::vector<Eigen::Vector2d> left;
    for (std::size_t i = 0; i < shape.size(); ++i) {
      const Eigen::Vector2d& p = shape[i];
      const Eigen::Vector2d& q = shape[(i + 1) % shape.size()];
      const double at_p = cross(along, p - a);
      const double at_q = cross(along, q - a);
      if (at_p >= 0) {
        left.push_back(p);
      }
      if ((at_p < 0) != (at_q < 0)) {
        left.emplace_back(p + at_p / (at_p - at_q) * (q - p));
      }
    }
    shape = std::move(left);
  }
  double area = 0;
  for (std::size_t i = 0; i < shape.size(); ++i) {
    area += cross(shape[i], shape[(i + 1) % shape.size()]) / 2;
  }
  return area;
}

TEST(OverlappingFaces, FoundPairs_MatchTriangleClipping) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(0, 1);
  Points2 flat(60, 2);
  for (Index v = 0; v < flat.rows(); ++v) {
    flat.row(v) << place(random), place(random);
  }
  std::uniform_int_distribution<int> vertex(0, 59);
  Triangles faces(80, 3);  // some share vertices and edges
  for (Index f = 0; f < faces.rows(); ++f) {
    do {
      faces.row(f) << vertex(random), vertex(random), vertex(random);
    } while (turned_faces(flat, faces.row(f)) != 0);
  }
  Pairs clipped;
  for (int f = 0; f < faces.rows(); ++f) {
    for (int g = f + 1; g < faces.rows(); ++g) {
      if (common_area(flat, faces, f, g) > 1e-12) {
        clipped.push_back({f, g});
      }
    }
  }
  EXPECT_GT(clipped.size(), 100U);
  EXPECT_EQ(overlapping_faces(flat, faces), clipped);
}

TEST(OverlappingFaces, AdjacentFaces_DoNotOverlapHoweverThin) {
  Points2 flat(4, 2);
  flat << 0, 0, 1, 0.1, 0.3, 0.03 + 1e-16, 0.3, -1;
  Triangles faces(2, 3);
  faces << 0, 1, 2, 1, 0, 3;
  EXPECT_EQ(overlapping_faces(flat, faces), Pairs{});
  faces.row(1) << 0, 1, 2;  // twice the same
  const bool thin_has_area = turned_faces(flat, faces) == 0;
  EXPECT_EQ(overlapping_faces(flat, faces).size(), thin_has_area ? 1U : 0U);
}

TEST(OverlappingFaces, BadPlacesAndVertices_AreRefused) {
  Points2 flat(3, 2);
  flat << 0, 0, 1, 0, 0, 1;
  Triangles faces(1, 3);
  faces << 0, 1, 3;
  EXPECT_THROW(overlapping_faces(flat, faces), LogicError);
  EXPECT_THROW(turned_faces(flat, faces), LogicError);
  faces << 0, 1, 2;
  flat(1, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(overlapping_faces(flat, faces), LogicError);
}

TEST(CrossesItself, CollinearSegments_DoNotCross) {
  Points2 rectangle(8, 2);  // segments in one line, apart from each other
  rectangle << 0, 0, 1, 0, 2, 0, 3, 0, 3, 1, 2, 1, 1, 1, 0, 1;
  EXPECT_FALSE(crosses_itself(rectangle));
  rectangle.row(6) << 1, 0;  // touches the other side
  EXPECT_TRUE(crosses_itself(rectangle));
}

/// A flat ring sector of so many turns, as a helix: isometric, but no plane holds it.
Mesh spiral(double turns) {
  Mesh mesh = fixtures::grid(40, 4);
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    const double angle = 2 * std::numbers::pi * turns * mesh.vertices(v, 0);
    const double radius = 0.5 + 0.2 * mesh.vertices(v, 2);
    mesh.vertices.row(v) << radius * std::cos(angle), 0.02 * turns * mesh.vertices(v, 0),
        -radius * std::sin(angle);
  }
  return mesh;
}

/// What every panel keeps to, judged by itself: not over itself as it lies, nor as it is drawn.
void expect_apart(const Mesh& mesh, const FlatPattern& pattern) {
  EXPECT_TRUE(pattern.overlapping.empty());
  EXPECT_EQ(turned_faces(pattern.vertices, pattern.cut.faces), 0);
  for (const auto& [f, g] : overlapping_faces(pattern.vertices, pattern.cut.faces)) {
    const auto panel = [&](int face) { return pattern.cut.panels[static_cast<std::size_t>(face)]; };
    EXPECT_NE(panel(f), panel(g));  // panels lie one over another until they are packed
  }
  const FlatMeasures measures = measure_flat(mesh, pattern);
  EXPECT_EQ(measures.inverted, 0);
  EXPECT_EQ(measures.overlaps, 0);
  EXPECT_LE(measures.seam_mismatch, 0.003);
  for (const PatternPiece& piece : lay_out_pattern(pattern).pieces) {
    EXPECT_FALSE(crosses_itself(piece.sew_line)) << piece.name;
  }
}

TEST(CutWhereOverlapping, Spiral_IsCutInItsMiddle) {
  const Mesh mesh = spiral(1.2);
  const std::vector<char> whole = no_cut(topology(mesh));
  const FlatPattern over = flatten_surface(mesh, whole);
  ASSERT_EQ(over.overlapping, std::vector<int>{0});
  const FlatPattern parted = flatten_surface(mesh, cut_where_overlapping(mesh, whole, over));
  EXPECT_EQ(parted.cut.panel_count, 2);
  expect_apart(mesh, parted);
  EXPECT_LT(measure_flat(mesh, parted).seam_length, 0.3);  // across, 0.2 wide
}

TEST(CutWhereOverlapping, PatternWithoutOverlap_StaysUnchanged) {
  const Mesh mesh = fixtures::tube(24, 8, 2);
  const std::vector<char> cut = opened(mesh);
  EXPECT_EQ(cut_where_overlapping(mesh, cut, flatten_surface(mesh, cut)), cut);
}

TEST(CutWhereOverlapping, MismatchedCut_IsRefused) {
  const Mesh mesh = spiral(1.2);
  const std::vector<char> whole = no_cut(topology(mesh));
  const FlatPattern pattern = flatten_surface(mesh, whole);
  EXPECT_THROW(cut_where_overlapping(mesh, {}, pattern), LogicError);
  const Mesh other = fixtures::grid(2, 2);
  EXPECT_THROW(cut_where_overlapping(other, no_cut(topology(other)), pattern), LogicError);
}

TEST(FlattenApart, SpiralOfManyTurns_LiesApart) {
  const Mesh mesh = spiral(5.5);
  std::size_t parted = 0;
  const FlatPattern pattern = flatten_apart(mesh, no_cut(topology(mesh)), {},
                                            [&](std::size_t panels) { parted += panels; });
  expect_apart(mesh, pattern);
  EXPECT_GE(parted, 1U);
  EXPECT_GE(pattern.cut.panel_count, 6);
  EXPECT_LE(pattern.cut.panel_count, 16);
  EXPECT_NEAR(measure_flat(mesh, pattern).area_ratio, 1, 0.02);
}

TEST(FlattenApart, RoughSurfaces_LieApart) {
  std::mt19937 random(3);
  for (const double rough : {0.1, 0.4, 1.5}) {  // of an edge's length
    std::uniform_real_distribution<double> noise(-rough / 16, rough / 16);
    Mesh crumpled = fixtures::grid(16, 16);
    for (Index v = 0; v < crumpled.vertices.rows(); ++v) {
      crumpled.vertices.row(v) += Eigen::RowVector3d(noise(random), noise(random), noise(random));
    }
    expect_apart(crumpled, flatten_apart(crumpled, no_cut(topology(crumpled))));
  }
  const Mesh ball = fixtures::sphere(3);  // slit between two points
  expect_apart(ball, flatten_apart(ball, opened(ball)));
  std::bernoulli_distribution cut_here(0.2);
  for (int trial = 0; trial < 4; ++trial) {  // seams that no tailor would cut
    std::vector<char> cut = no_cut(topology(ball));
    for (char& flag : cut) {
      flag = cut_here(random) ? 1 : 0;
    }
    const Topology whole = topology(ball);
    expect_apart(ball,
                 flatten_apart(ball, cut_to_disks(whole, cut, edge_lengths(whole, ball.vertices))));
  }
}

}  // namespace
}  // namespace atelier
