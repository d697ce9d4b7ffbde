#include "registration/flattening/find_pattern.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/normals.h"
#include "core/tree.h"
#include "registration/flattening/straight_seams.h"
#include "registration/flattening/surface_cut.h"
#include "registration/flattening/unstretched_surface.h"
#include "registration/remove_slivers.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

/// A tube 60 cm high and 40 cm wide.
Mesh sewn_tube() {
  Mesh mesh = fixtures::tube(40, 24, 0.6);
  mesh.vertices.col(0) *= 0.2;
  mesh.vertices.col(2) *= 0.2;
  return mesh;
}

/// A sheet in the plane y = 0, and a cut right through it that goes one step up and one down.
struct ZigzagSheet {
  Mesh mesh;
  std::vector<char> cut;
};
ZigzagSheet zigzag_sheet() {
  ZigzagSheet sheet{fixtures::grid(20, 12), {}};
  std::vector<int> labels;
  const double tall = sheet.mesh.vertices.col(2).maxCoeff() / 12;
  for (Index f = 0; f < sheet.mesh.faces.rows(); ++f) {
    const Eigen::RowVector3d middle = (sheet.mesh.vertices.row(sheet.mesh.faces(f, 0)) +
                                       sheet.mesh.vertices.row(sheet.mesh.faces(f, 1)) +
                                       sheet.mesh.vertices.row(sheet.mesh.faces(f, 2))) /
                                      3;
    const double wide = sheet.mesh.vertices.col(0).maxCoeff() / 20;
    const bool odd = static_cast<int>(middle.x() / wide) % 2 != 0;
    labels.push_back(middle.z() > (odd ? 7 : 6) * tall ? 1 : 0);
  }
  sheet.cut = cut_between_labels(topology_of(sheet.mesh.faces, sheet.mesh.vertices.rows()), labels);
  return sheet;
}

double length_of_cut(const Mesh& mesh, const Points& vertices, const std::vector<char>& cut) {
  const Topology topology = topology_of(mesh.faces, vertices.rows());
  double length = 0;
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    if (cut[static_cast<std::size_t>(e)] != 0) {
      length += (vertices.row(topology.edges(e, 0)) - vertices.row(topology.edges(e, 1))).norm();
    }
  }
  return length;
}

double farthest_from(const Mesh& surface, const Points& points) {
  const TriangleTree tree = build_tree(surface.vertices, surface.faces);
  double farthest = 0;
  for (Index v = 0; v < points.rows(); ++v) {
    farthest = std::max(farthest,
                        std::sqrt(closest_point(tree, points.row(v).transpose()).squared_distance));
  }
  return farthest;
}

TEST(StraightSeams, ZigzagSeam_BecomesStraight) {
  const ZigzagSheet sheet = zigzag_sheet();
  const double wide = sheet.mesh.vertices.col(0).maxCoeff() - sheet.mesh.vertices.col(0).minCoeff();
  EXPECT_GT(length_of_cut(sheet.mesh, sheet.mesh.vertices, sheet.cut), 1.4 * wide);
  const Points straight = straightened_seams(sheet.mesh, sheet.cut);
  EXPECT_LT(length_of_cut(sheet.mesh, straight, sheet.cut), 1.15 * wide);  // the rim holds its ends
}

TEST(StraightSeams, Straightening_KeepsSurfaceBoundaryAndArea) {
  const ZigzagSheet sheet = zigzag_sheet();
  const Points straight = straightened_seams(sheet.mesh, sheet.cut);
  EXPECT_LT(farthest_from(sheet.mesh, straight), 1e-9);
  const Topology topology = topology_of(sheet.mesh.faces, straight.rows());
  for (const auto& loop : boundary_loops(topology)) {
    for (const int v : loop) {
      EXPECT_EQ(straight.row(v), sheet.mesh.vertices.row(v));
    }
  }
  // No triangle is turned over, so that areas add up to the same.
  EXPECT_NEAR(face_areas(straight, sheet.mesh.faces).sum(),
              face_areas(sheet.mesh.vertices, sheet.mesh.faces).sum(), 1e-9);
  const Points before = face_normals(sheet.mesh.vertices, sheet.mesh.faces);
  const Points after = face_normals(straight, sheet.mesh.faces);
  EXPECT_GT((before.array() * after.array()).rowwise().sum().minCoeff(), 0.5);
}

// On the triangles themselves slides would cut through what bulges: 6.7% less after four times.
TEST(StraightSeams, StraighteningOverABulge_KeepsTheArea) {
  ZigzagSheet sheet = zigzag_sheet();
  const double wide = sheet.mesh.vertices.col(0).maxCoeff() - sheet.mesh.vertices.col(0).minCoeff();
  for (Index v = 0; v < sheet.mesh.vertices.rows(); ++v) {
    sheet.mesh.vertices(v, 1) =
        0.08 * wide * std::sin(4 * std::numbers::pi * sheet.mesh.vertices(v, 2) / wide);
  }
  const double area = face_areas(sheet.mesh.vertices, sheet.mesh.faces).sum();
  for (int i = 0; i < 4; ++i) {
    sheet.mesh.vertices = straightened_seams(sheet.mesh, sheet.cut);
  }
  EXPECT_NEAR(face_areas(sheet.mesh.vertices, sheet.mesh.faces).sum(), area, 0.012 * area);
}

// Whatever seams and surfaces, no corner becomes smaller than 10 degrees that was not.
TEST(StraightSeams, Straightening_MakesNoSlivers) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> noise(-0.012, 0.012);
  std::bernoulli_distribution cut_here(0.15);
  for (int trial = 0; trial < 20; ++trial) {
    ZigzagSheet sheet = zigzag_sheet();
    for (Index v = 0; v < sheet.mesh.vertices.rows(); ++v) {
      sheet.mesh.vertices.row(v) += Eigen::RowVector3d(noise(random), noise(random), noise(random));
    }
    for (std::size_t e = 0; trial % 2 != 0 && e < sheet.cut.size(); ++e) {
      sheet.cut[e] = static_cast<char>(cut_here(random));
    }
    const double before = min_corners(sheet.mesh.vertices, sheet.mesh.faces).minCoeff();
    const Points straight = straightened_seams(sheet.mesh, sheet.cut);
    EXPECT_NE(straight, sheet.mesh.vertices);
    EXPECT_GE(min_corners(straight, sheet.mesh.faces).minCoeff(), std::min(before, 10.0));
  }
}

TEST(StraightSeams, NoSeamsOrNoRounds_MoveNothing) {
  const ZigzagSheet sheet = zigzag_sheet();
  EXPECT_EQ(straightened_seams(sheet.mesh, std::vector<char>(sheet.cut.size(), 0)),
            sheet.mesh.vertices);
  EXPECT_EQ(straightened_seams(sheet.mesh, sheet.cut, 0), sheet.mesh.vertices);
}

TEST(StraightSeams, MismatchedEdgeFlags_AreRefused) {
  EXPECT_THROW(straightened_seams(sewn_tube(), {}), LogicError);
}

/// A tube in two halves whose middle bulges by so many metres, and its pattern.
struct Bulging {
  Mesh mesh;
  FlatPattern pattern;
};
Bulging bulging(double height) {
  Bulging result{sewn_tube(), {}};
  std::vector<int> front;
  for (Index f = 0; f < result.mesh.faces.rows(); ++f) {
    front.push_back(result.mesh.vertices.col(2)(result.mesh.faces.row(f)).sum() > 0 ? 1 : 0);
  }
  for (Index v = 0; v < result.mesh.vertices.rows(); ++v) {
    const double x = result.mesh.vertices(v, 0) / 0.05;
    const double y = (result.mesh.vertices(v, 1) - 0.3) / 0.05;
    if (result.mesh.vertices(v, 2) > 0) {
      result.mesh.vertices(v, 2) += height * std::exp(-(x * x + y * y) / 2);
    }
  }
  const std::vector<char> cut =
      cut_between_labels(topology_of(result.mesh.faces, result.mesh.vertices.rows()), front);
  result.pattern = flatten_surface(result.mesh, cut);
  return result;
}

TEST(UnstretchedSurface, DevelopableSurface_StaysUnchanged) {
  const Bulging tube = bulging(0);
  const Points points =
      unstretched_surface(tube.mesh, tube.pattern, 0.03, 0.002, tube.mesh.vertices);
  EXPECT_LT((points - tube.mesh.vertices).rowwise().norm().maxCoeff(), 2e-4);
}

TEST(UnstretchedSurface, BulgeWithinTolerance_LosesItsStretch) {
  const Bulging tube = bulging(0.012);
  Mesh moved = tube.mesh;
  moved.vertices = unstretched_surface(tube.mesh, tube.pattern, 0.01, 0.004, tube.mesh.vertices);
  const double before = measure_flat(tube.mesh, tube.pattern).strain_p99;
  const std::vector<char> cut =
      cut_between_labels(topology_of(moved.faces, moved.vertices.rows()), tube.pattern.cut.panels);
  const double after = measure_flat(moved, flatten_surface(moved, cut)).strain_p99;
  EXPECT_LT(after, 0.7 * before);
  EXPECT_LT((moved.vertices - tube.mesh.vertices).rowwise().norm().maxCoeff(), 1.5 * 0.004);
}

// Round by round creases are ironed out and the pattern follows what is left.
TEST(UnstretchedSurface, RepeatedDeviation_KeepsTheArea) {
  Bulging tube = bulging(0);
  for (Index v = 0; v < tube.mesh.vertices.rows(); ++v) {
    tube.mesh.vertices(v, 2) *= 1 + 0.04 * std::sin(70 * tube.mesh.vertices(v, 1)) *
                                        std::sin(70 * tube.mesh.vertices(v, 0));
  }
  const std::vector<char> cut = cut_between_labels(
      topology_of(tube.mesh.faces, tube.mesh.vertices.rows()), tube.pattern.cut.panels);
  Mesh moved = tube.mesh;
  for (int round = 0; round < 8; ++round) {
    moved.vertices =
        unstretched_surface(tube.mesh, flatten_surface(moved, cut), 0.03, 0.005, moved.vertices);
  }
  const double area = face_areas(tube.mesh.vertices, tube.mesh.faces).sum();
  EXPECT_NEAR(face_areas(moved.vertices, moved.faces).sum(), area, 0.01 * area);
}

TEST(UnstretchedSurface, BulgeBeyondTolerance_StaysInPlace) {
  const Bulging tube = bulging(0.08);
  const Points points =
      unstretched_surface(tube.mesh, tube.pattern, 0.03, 0.001, tube.mesh.vertices);
  const Eigen::VectorXd ways = (points - tube.mesh.vertices).rowwise().norm();
  EXPECT_LT(ways.mean(), 0.001);
  EXPECT_LT(ways.maxCoeff(), 0.02);  // of the 8 cm
}

TEST(UnstretchedSurface, OtherTrianglesOrZeroTolerance_AreRefused) {
  const Bulging tube = bulging(0);
  const Points& start = tube.mesh.vertices;
  EXPECT_THROW(unstretched_surface(fixtures::grid(3, 3), tube.pattern, 0.03, 0.002, start),
               LogicError);
  EXPECT_THROW(unstretched_surface(tube.mesh, tube.pattern, 0, 0.002, start), LogicError);
  EXPECT_THROW(unstretched_surface(tube.mesh, tube.pattern, 0.03, 0, start), LogicError);
  EXPECT_THROW(unstretched_surface(tube.mesh, tube.pattern, 0.03, 0.002, Points(3, 3)), LogicError);
}

TEST(FindPattern, Tube_GivesTwoHalvesWithStraightSeams) {
  const FoundPattern found = find_pattern(sewn_tube());
  EXPECT_TRUE(found.reached);
  EXPECT_EQ(found.pattern.cut.panel_count, 2);
  EXPECT_NEAR(found.measures.seam_length, 1.2, 0.02);
  EXPECT_LT(found.deviation_max, 0.002);
}

TEST(FindPattern, NoiseWithinTolerance_NeedsNoSeams) {
  // Waves of 12 cm and 4 mm either way, which no panel of the tube can have.
  Mesh mesh = sewn_tube();
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    const double angle = std::atan2(mesh.vertices(v, 2), mesh.vertices(v, 0));
    const double wave = 0.004 * std::cos(10 * angle) * std::sin(52 * mesh.vertices(v, 1));
    mesh.vertices(v, 0) *= 1 + wave / 0.2;
    mesh.vertices(v, 2) *= 1 + wave / 0.2;
  }
  FindPatternOptions options;
  options.find.stretch = 0.01;
  options.tolerance = 0;
  const FoundPattern as_it_is = find_pattern(mesh, options);
  options.tolerance = 0.004;
  const FoundPattern found = find_pattern(mesh, options);
  EXPECT_TRUE(found.reached);
  EXPECT_LT(found.measures.seam_length, as_it_is.measures.seam_length);
  EXPECT_LT(found.deviation_mean, 0.004);
  EXPECT_EQ(as_it_is.deviation_max, 0);
}

TEST(FindPattern, Ball_KeepsTheStretchBoundWithEqualSeams) {
  Mesh ball = fixtures::sphere(3);
  ball.vertices *= 0.12;
  FindPatternOptions options;
  options.find.stretch = 0.05;
  const FoundPattern found = find_pattern(ball, options);
  EXPECT_TRUE(found.reached);
  const FlatMeasures again = measure_flat(found.mesh, found.pattern);
  EXPECT_LE(again.strain_p99, 0.05);
  EXPECT_LT(again.seam_mismatch, 0.003);
  EXPECT_EQ(again.inverted, 0);
  EXPECT_EQ(again.overlaps, 0);
  EXPECT_EQ(found.mesh.faces, ball.faces);
}

// What a simulation is given: neither the surface nor its flat rest shape has slivers.
TEST(FindPattern, RoughSurfaces_GivePanelsWithoutSlivers) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> noise(-0.004, 0.004);
  for (int trial = 0; trial < 4; ++trial) {
    Mesh mesh = trial % 2 != 0 ? fixtures::sphere(3) : sewn_tube();
    mesh.vertices *= trial % 2 != 0 ? 0.15 : 1;
    for (Index v = 0; v < mesh.vertices.rows(); ++v) {
      mesh.vertices.row(v) += Eigen::RowVector3d(noise(random), noise(random), noise(random));
    }
    FindPatternOptions options;
    options.find.stretch = 0.06;
    const FoundPattern found = find_pattern(remove_slivers(mesh), options);
    EXPECT_GE(min_corners(found.mesh.vertices, found.mesh.faces).minCoeff(), 10) << trial;
    EXPECT_GE(min_corners(found.pattern.vertices, found.pattern.cut.faces).minCoeff(), 5) << trial;
  }
}

// The search sews on the surface as it is; what gives way needs fewer seams.
TEST(FindPattern, SewingSeamsAgain_KeepsTheStretchBound) {
  Mesh ball = fixtures::sphere(3);
  ball.vertices *= 0.12;
  FindPatternOptions options;
  options.find.stretch = 0.06;
  int tried = 0;
  double shortest = std::numeric_limits<double>::infinity();  // of what keeps the bound
  const SeamWatch watch = [&](const std::string& line) {
    int panels = 0;
    double length = 0;
    double stretch = 0;
    const std::size_t at = line.find(": ");
    if (std::sscanf(line.c_str() + at, ": %d panels, %lf m, stretch p99 %lf%%", &panels, &length,
                    &stretch) == 3) {
      tried += line.starts_with("sewn") ? 1 : 0;
      shortest = stretch < 5.99 ? std::min(shortest, length + 0.15 * panels) : shortest;
    }
  };
  const FoundPattern sewn = find_pattern(ball, options, watch);
  EXPECT_GT(tried, 0);
  ASSERT_TRUE(sewn.reached);
  EXPECT_LE(sewn.measures.strain_p99, options.find.stretch);
  EXPECT_EQ(sewn.measures.overlaps + sewn.measures.inverted, 0);
  EXPECT_GE(sewn.pattern.cut.panel_count, 2);  // a front and a back
  EXPECT_LE(sewn.measures.seam_length + 0.15 * sewn.pattern.cut.panel_count, 1.03 * shortest);
  tried = 0;
  options.find.join = false;
  find_pattern(ball, options, watch);
  EXPECT_EQ(tried, 0);
}

TEST(FindPattern, UnreachableStretchBound_IsReported) {
  Mesh ball = fixtures::sphere(3);
  ball.vertices *= 0.12;
  FindPatternOptions options;
  options.find.stretch = 0.005;
  options.find.cuts = 0;
  options.tolerance = 0;
  const FoundPattern found = find_pattern(ball, options);
  EXPECT_FALSE(found.reached);
  EXPECT_GT(found.measures.strain_p99, 0.005);
}

TEST(FindPattern, BadSurfaces_AreRefused) {
  EXPECT_THROW(find_pattern(Mesh{}), DataError);
  Mesh mesh = sewn_tube();
  mesh.vertices(3, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(find_pattern(mesh), DataError);
}

}  // namespace
}  // namespace atelier
