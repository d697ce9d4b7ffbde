#include "bodymodel/underlying/outer_surface.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/bodymodel/clothed_body.h"

namespace atelier {
namespace {

using fixtures::ball;

constexpr double kRadius = 0.3;

/// Radius of a ball with a smooth bulge about the y axis: `height` metres at the pole.
double bulged(const Eigen::RowVector3d& direction, double height) {
  const double angle = std::acos(std::clamp(direction.normalized().y(), -1.0, 1.0));
  return kRadius + height * std::exp(-angle * angle / (2 * 0.4 * 0.4));
}

/// A scan of that, finer than the body, in one role, or with its top in another.
ClothedScan bulge(double height, ScanRole top = ScanRole::Skin) {
  ClothedScan scan{ball(1, 5), {}};
  for (Index v = 0; v < scan.mesh.vertices.rows(); ++v) {
    const Eigen::RowVector3d direction = scan.mesh.vertices.row(v).normalized();
    scan.mesh.vertices.row(v) = bulged(direction, height) * direction;
    scan.roles.push_back(direction.y() > 0.5 ? top : ScanRole::Skin);
  }
  return scan;
}

/// Largest distance of the surface's vertices from the true radius along their direction, m.
double worst(const Points& vertices, double height) {
  double most = 0;
  for (Index v = 0; v < vertices.rows(); ++v) {
    most = std::max(most, std::abs(vertices.row(v).norm() - bulged(vertices.row(v), height)));
  }
  return most;
}

TEST(OuterSurface, BulgeOfSkin_IsFound) {
  const Mesh body = ball(kRadius);
  const OuterSurface surface = outer_surface(body.faces, body.vertices, scan_surface(bulge(0.015)));
  EXPECT_LT(worst(surface.vertices, 0.015), 0.001);
  EXPECT_LT(surface.skin_distance, 0.0005);
  EXPECT_EQ(surface.cover_area, 0);
  EXPECT_EQ(surface.turned, 0);
  EXPECT_GT(surface.support.minCoeff(), 0.3);
}

TEST(OuterSurface, HairFarFromTheHead_IsReached) {
  const Mesh body = ball(kRadius);
  const OuterSurface surface =
      outer_surface(body.faces, body.vertices, scan_surface(bulge(0.08, ScanRole::Cover)));
  EXPECT_LT(worst(surface.vertices, 0.08), 0.004);
  EXPECT_LT(surface.cover_distance, 0.002);
  EXPECT_GT(surface.cover_area, 0.1);
  EXPECT_GT(surface.cover.maxCoeff(), 0.99);
  EXPECT_LT(surface.cover.minCoeff(), 0.01);
  EXPECT_EQ(surface.turned, 0);
}

TEST(OuterSurface, ClothesOverSkin_PullNothing) {
  const Mesh body = ball(kRadius);
  const OuterSurface surface =
      outer_surface(body.faces, body.vertices, scan_surface(bulge(0.08, ScanRole::Ignored)));
  for (Index v = 0; v < body.vertices.rows(); ++v) {
    if (body.vertices(v, 1) > 0.9 * kRadius) {
      EXPECT_LT((surface.vertices.row(v) - body.vertices.row(v)).norm(), 0.01);
    }
  }
  EXPECT_LT(surface.support[0] + surface.support.minCoeff(), 1.5);
}

TEST(OuterSurface, EarOutOfTheHair_IsDrawnIntoIt) {
  Mesh body = ball(kRadius);
  Index ear = 0;
  body.vertices.col(1).maxCoeff(&ear);
  body.vertices.row(ear) *= 1 + 0.02 / kRadius;  // 1.5 cm above hair that is 5 mm thick
  ClothedScan hair = bulge(0);
  for (Index v = 0; v < hair.mesh.vertices.rows(); ++v) {
    hair.mesh.vertices.row(v) *= 1 + 0.005 / kRadius;
    hair.roles[static_cast<std::size_t>(v)] = ScanRole::Cover;
  }
  const OuterSurface surface = outer_surface(body.faces, body.vertices, scan_surface(hair));
  EXPECT_LT(surface.vertices.row(ear).norm(), kRadius + 0.015) << "without, 2.5 cm";
}

TEST(OuterSurface, BrimThatNoNormalMeets_IsReached) {
  const Mesh body = ball(kRadius);
  // A ring round the ball, of which only what looks down is seen.
  ClothedScan scan = bulge(0);
  for (Index v = 0; v < scan.mesh.vertices.rows(); ++v) {
    scan.roles[static_cast<std::size_t>(v)] = ScanRole::Ignored;
  }
  constexpr int kSteps = 90;
  const auto first = static_cast<int>(scan.mesh.vertices.rows());
  const Index faces = scan.mesh.faces.rows();
  scan.mesh.vertices.conservativeResize(first + 2 * kSteps, 3);
  scan.mesh.faces.conservativeResize(faces + 2 * kSteps, 3);
  constexpr double kHeight = 0.1;
  for (int i = 0; i < kSteps; ++i) {
    const double angle = 2 * M_PI * i / kSteps;
    const Eigen::RowVector3d out(std::cos(angle), 0, std::sin(angle));
    for (int k = 0; k < 2; ++k) {
      scan.mesh.vertices.row(first + 2 * i + k) =
          (k == 0 ? 0.3 : 0.32) * out + Eigen::RowVector3d(0, kHeight, 0);
      scan.roles.push_back(ScanRole::Cover);
    }
    const int at = first + 2 * i;
    const int next = first + 2 * ((i + 1) % kSteps);
    scan.mesh.faces.row(faces + 2 * i) << at, at + 1, next + 1;
    scan.mesh.faces.row(faces + 2 * i + 1) << at, next + 1, next;
  }
  const ScanSurface seen = scan_surface(scan);
  ASSERT_LT(seen.normals(first, 1), -0.9);
  const OuterSurface surface = outer_surface(body.faces, body.vertices, seen);
  const auto distance = [&](const Points& vertices) {
    const Points ring = scan.mesh.vertices.bottomRows(2 * kSteps);
    double sum = 0;
    for (const ClosestPoint& closest : closest_points(build_tree(vertices, body.faces), ring)) {
      sum += std::sqrt(closest.squared_distance) / static_cast<double>(ring.rows());
    }
    return sum;
  };
  EXPECT_LT(distance(surface.vertices), 0.6 * distance(body.vertices));
}

TEST(OuterSurface, NoScan_KeepsTheBody) {
  const Mesh body = ball(kRadius);
  const OuterSurface surface = outer_surface(body.faces, body.vertices, scan_surface({}));
  EXPECT_EQ(surface.vertices, body.vertices);
  EXPECT_EQ(surface.support.maxCoeff(), 0);
}

TEST(OuterSurface, BodyThatIsNotFinite_IsADefect) {
  Mesh body = ball(kRadius);
  body.vertices(3, 1) = NAN;
  EXPECT_THROW(outer_surface(body.faces, body.vertices, scan_surface({})), LogicError);
}

TEST(DifferentlyCovered, ShoesOfOneSequence_AreFound) {
  const Mesh body = ball(kRadius);
  const OuterSurface bare = outer_surface(body.faces, body.vertices, scan_surface(bulge(0.01)));
  const OuterSurface shod =
      outer_surface(body.faces, body.vertices, scan_surface(bulge(0.01, ScanRole::Cover)));
  OuterSurface unseen = bare;
  unseen.support.setZero();
  const std::vector<char> differs = differently_covered(body.faces, {&bare}, {&shod}, 0);
  for (Index v = 0; v < body.vertices.rows(); ++v) {
    const double height = body.vertices(v, 1) / kRadius;
    if (std::abs(height - 0.5) > 0.1) {
      EXPECT_EQ(differs[static_cast<std::size_t>(v)] != 0, height > 0.5) << height;
    }
  }
  const auto count = [](const std::vector<char>& flags) {
    return std::count(flags.begin(), flags.end(), 1);
  };
  EXPECT_GT(count(differently_covered(body.faces, {&bare}, {&shod}, 2)), count(differs));
  EXPECT_EQ(count(differently_covered(body.faces, {&bare}, {&bare})), 0);
  EXPECT_EQ(count(differently_covered(body.faces, {&unseen}, {&shod})), 0);
  EXPECT_THROW(differently_covered(body.faces, {}, {&shod}), LogicError);
}

TEST(MeanDisplacement, Frames_CountByTheirSupport) {
  const Points seen = Points::Constant(2, 3, 0.02);
  const Points unseen = Points::Zero(2, 3);
  const Eigen::Vector2d first(1, 0);
  const Eigen::Vector2d second(0, 0);
  const Points mean = mean_displacement({seen, unseen}, {first, second});
  EXPECT_NEAR(mean(0, 0), 0.02, 0.0003) << "one frame has seen it";
  EXPECT_NEAR(mean(1, 2), 0.01, 1e-9) << "neither has";
}

TEST(MeanDisplacement, FramesOfTwoBodies_AreADefect) {
  EXPECT_THROW(mean_displacement({}, {}), LogicError);
  EXPECT_THROW(mean_displacement({Points::Zero(2, 3), Points::Zero(3, 3)},
                                 {Eigen::VectorXd::Ones(2), Eigen::VectorXd::Ones(3)}),
               LogicError);
}

}  // namespace
}  // namespace atelier
