#include "appearance/place_shapes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/random.h"

namespace atelier {
namespace {

/// A fan round the first point.
FlatShape fan(const std::vector<Eigen::Vector2d>& outline) {
  FlatShape shape;
  const auto count = static_cast<int>(outline.size());
  shape.points.resize(count + 1, 2);
  shape.faces.resize(count, 3);
  shape.points.row(0).setZero();
  for (int i = 0; i < count; ++i) {
    shape.points.row(i + 1) = outline[static_cast<std::size_t>(i)].transpose();
    shape.faces.row(i) << 0, i + 1, (i + 1) % count + 1;
  }
  return shape;
}

/// Star-shaped about the origin, radii from a third to one times `size`.
FlatShape star(std::uint64_t seed, int corners, double size) {
  Random random{seed, 1};
  std::vector<Eigen::Vector2d> outline;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * std::numbers::pi * i / corners;
    const double radius = size * (1 + 2 * uniform(random)) / 3;
    outline.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  return fan(outline);
}

Points2 in_square(const FlatShape& shape, const PlacedShape& placed, double scale) {
  Points2 points(shape.points.rows(), 2);
  const Eigen::Rotation2Dd turn(placed.angle);
  for (Index i = 0; i < points.rows(); ++i) {
    points.row(i) = (scale * (turn * shape.points.row(i).transpose()) + placed.place).transpose();
  }
  return points;
}

double to_segment(const Eigen::RowVector2d& p, const Eigen::RowVector2d& a,
                  const Eigen::RowVector2d& b) {
  const Eigen::RowVector2d d = b - a;
  const double t = std::clamp((p - a).dot(d) / d.squaredNorm(), 0.0, 1.0);
  return (p - a - t * d).norm();
}

bool inside(const Eigen::RowVector2d& p, const Points2& points, const Triangles& faces) {
  for (Index f = 0; f < faces.rows(); ++f) {
    const auto side = [&](int i, int j) {
      const Eigen::RowVector2d a = points.row(faces(f, i));
      const Eigen::RowVector2d d = points.row(faces(f, j)) - a;
      return d.x() * (p - a).y() - d.y() * (p - a).x();
    };
    const double s[3] = {side(0, 1), side(1, 2), side(2, 0)};
    if ((s[0] > 0 && s[1] > 0 && s[2] > 0) || (s[0] < 0 && s[1] < 0 && s[2] < 0)) {
      return true;
    }
  }
  return false;
}

/// The least distance of two fans: of every corner of one to every outer edge of the other; 0 where
/// one has a corner or its centre in the other.
double distance(const Points2& a, const Triangles& fa, const Points2& b, const Triangles& fb) {
  double least = 1e300;
  for (Index i = 0; i < a.rows(); ++i) {
    least = inside(a.row(i), b, fb) ? 0 : least;
    for (Index f = 0; f < fb.rows(); ++f) {
      least = std::min(least, to_segment(a.row(i), b.row(fb(f, 1)), b.row(fb(f, 2))));
    }
  }
  for (Index i = 0; i < b.rows(); ++i) {
    least = inside(b.row(i), a, fa) ? 0 : least;
    for (Index f = 0; f < fa.rows(); ++f) {
      least = std::min(least, to_segment(b.row(i), a.row(fa(f, 1)), a.row(fa(f, 2))));
    }
  }
  return least;
}

TEST(PlaceShapes, PlacedShapes_KeepTheMargin) {
  constexpr double kMargin = 0.012;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    std::vector<FlatShape> shapes;
    for (std::uint64_t i = 0; i < 3 + 2 * seed; ++i) {
      shapes.push_back(star(100 * seed + i, 9, 0.2 + 0.1 * static_cast<double>(i % 4)));
    }
    const ShapePlacement placement = place_shapes(shapes, kMargin, 1e-3);
    ASSERT_GT(placement.scale, 0) << seed;
    ASSERT_EQ(placement.shapes.size(), shapes.size());
    std::vector<Points2> at;
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      at.push_back(in_square(shapes[i], placement.shapes[i], placement.scale));
      EXPECT_GE(at.back().minCoeff(), kMargin - 1e-9) << seed;
      EXPECT_LE(at.back().maxCoeff(), 1 - kMargin + 1e-9) << seed;
      for (std::size_t j = 0; j < i; ++j) {
        EXPECT_GE(distance(at[i], shapes[i].faces, at[j], shapes[j].faces), kMargin - 1e-9)
            << "shapes " << i << " and " << j << " of " << seed;
      }
    }
  }
}

TEST(PlaceShapes, Triangles_AreInterlocked) {
  // Two of them make a parallelogram: boxes side by side would be half empty.
  const FlatShape wedge = fan({{-0.5, -1.0 / 3}, {0.5, -1.0 / 3}, {0, 2.0 / 3}});
  const ShapePlacement placement = place_shapes({wedge, wedge}, 1.0 / 256, 0.1);
  const double boxes = 0.5;  // the scale at which two boxes of 1 x 1 lie side by side
  EXPECT_GT(placement.scale, 1.15 * boxes);
}

TEST(PlaceShapes, RepeatedPlacement_IsIdenticalAndScaleInvariant) {
  const std::vector<FlatShape> shapes = {star(1, 9, 1), star(2, 9, 1), star(3, 9, 0.5)};
  const ShapePlacement a = place_shapes(shapes, 0.01, 1e-3);
  const ShapePlacement b = place_shapes(shapes, 0.01, 1e-3);
  EXPECT_EQ(a.scale, b.scale);
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    EXPECT_EQ(a.shapes[i].place, b.shapes[i].place);
    EXPECT_EQ(a.shapes[i].angle, b.shapes[i].angle);
  }
  // Twice as large in metres: half the scale.
  std::vector<FlatShape> larger = shapes;
  for (FlatShape& shape : larger) {
    shape.points *= 2;
  }
  EXPECT_NEAR(place_shapes(larger, 0.01, 1e-3).scale, a.scale / 2, 0.02 * a.scale);
}

TEST(PlaceShapes, NoRoom_GivesScaleZero) {
  EXPECT_EQ(place_shapes({star(1, 9, 1)}, 0.01, 10).scale, 0);
  FlatShape flat;
  flat.points = Points2::Zero(3, 2);
  flat.faces.resize(1, 3);
  flat.faces << 0, 1, 2;
  EXPECT_EQ(place_shapes({flat}, 0.01, 1).scale, 0) << "no area";
  // A ribbon thirty times as long as wide, which no angle makes shorter than the diagonal.
  const FlatShape ribbon = fan({{-1.5, -0.05}, {1.5, -0.05}, {1.5, 0.05}, {-1.5, 0.05}});
  const ShapePlacement placed = place_shapes({ribbon}, 0.01, 0.1);
  EXPECT_GT(placed.scale, 1.2 / 3);
  EXPECT_LT(placed.scale, std::numbers::sqrt2 / 3);
}

TEST(PlaceShapes, EmptyOrNonFiniteShapes_AreRefused) {
  EXPECT_THROW(place_shapes({FlatShape{}}, 0.01, 1), LogicError);
  FlatShape nowhere = star(1, 9, 1);
  nowhere.points(0, 0) = NAN;
  EXPECT_THROW(place_shapes({nowhere}, 0.01, 1), LogicError);
  EXPECT_THROW(place_shapes({star(1, 9, 1)}, 0, 1), LogicError);
  EXPECT_THROW(place_shapes({star(1, 9, 1)}, 0.01, 0), LogicError);
}

}  // namespace
}  // namespace atelier
