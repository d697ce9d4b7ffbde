#include "registration/flattening/find_seams.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "registration/flattening/flat_pattern.h"
#include "registration/flattening/front_and_back.h"
#include "tests/registration/cut_fixtures.h"
#include "tests/support/refusals.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

using fixtures::no_cut;
using fixtures::topology;

/// The pattern's panels stiffen where those of the search did.
FlattenOptions laid_as_found(const FindSeamsOptions& find) {
  FlattenOptions options;
  options.panel.even = stiffening_of(find.stretch);
  return options;
}

TEST(FindSeams, ConeAndTube_NeedAtMostOneSeam) {
  Mesh mesh = fixtures::tube(32, 10, 0.6);
  mesh.vertices.col(0) *= 0.2;
  mesh.vertices.col(2) *= 0.2;
  FindSeamsOptions options;
  options.front_and_back = false;
  const FoundSeams found = find_seams(mesh, no_cut(topology(mesh)), options);
  EXPECT_TRUE(found.reached);
  EXPECT_EQ(found.added, 0);
  const FlatPattern pattern = flatten_surface(mesh, found.cut);
  EXPECT_EQ(pattern.cut.panel_count, 1);
}

TEST(FindSeams, FrontAndBackOfATube_AreItsHalves) {
  Mesh mesh = fixtures::tube(32, 10, 0.6);
  mesh.vertices.col(0) *= 0.2;
  mesh.vertices.col(2) *= 0.2;
  const FoundSeams found = find_seams(mesh, no_cut(topology(mesh)));
  EXPECT_TRUE(found.reached);
  const FlatPattern pattern = flatten_surface(mesh, found.cut);
  EXPECT_EQ(pattern.cut.panel_count, 2);
  EXPECT_NEAR(measure_flat(mesh, pattern).seam_length, 1.2, 0.05);
}

TEST(FindSeams, FrontAndBack_RotateWithTheShape) {
  // A tube a third as deep as it is wide: its sides are where it is narrow, however it is turned.
  Mesh mesh = fixtures::tube(48, 10, 0.6);
  mesh.vertices.col(0) *= 0.3;
  mesh.vertices.col(2) *= 0.1;
  EXPECT_EQ(facing_of(mesh), Eigen::Vector3d::UnitZ());
  const Mesh ahead = mesh;
  for (const double degrees : {7.0, 30.0, 90.0, 137.0, 180.0}) {
    const double turn = degrees * std::numbers::pi / 180;
    const Eigen::Matrix3d by = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitY()).toRotationMatrix();
    mesh.vertices = ahead.vertices * by.transpose();
    const Eigen::Vector3d facing = facing_of(mesh);
    EXPECT_NEAR(std::abs(facing.dot(by.col(2))), 1, degrees < 10 ? 0.02 : 1e-9) << degrees;
    EXPECT_EQ(facing == Eigen::Vector3d::UnitZ(), degrees < 10 || degrees == 180) << degrees;
    EXPECT_EQ(front_and_back(mesh, degrees < 10 ? by.col(2) : facing),
              front_and_back(ahead, Eigen::Vector3d::UnitZ()))
        << degrees;
  }
  FindSeamsOptions said;  // by whoever knows better
  said.facing = Eigen::Vector3d::UnitX();
  EXPECT_EQ(find_seams(ahead, no_cut(topology(ahead)), said).sides,
            front_and_back(ahead, Eigen::Vector3d::UnitX()));
}

TEST(FindSeams, RoundShape_KeepsTheWorldsFront) {
  Mesh mesh = fixtures::tube(32, 10, 0.6);
  mesh.vertices.col(0) *= 0.2;
  mesh.vertices.col(2) *= 0.19;
  EXPECT_EQ(facing_of(mesh), Eigen::Vector3d::UnitZ());
  mesh.vertices.col(0) *= 0.93;
  EXPECT_EQ(facing_of(mesh), Eigen::Vector3d::UnitZ());
  EXPECT_THROW(facing_of(mesh, 0), LogicError);
  EXPECT_THROW(front_and_back(mesh, Eigen::Vector3d::Zero()), LogicError);
}

TEST(FindSeams, Hemisphere_IsCutUntilStretchIsWithinBounds) {
  Mesh sphere = fixtures::sphere(3);
  Mesh half;
  half.vertices = sphere.vertices * 0.12;
  half.faces.resize(0, 3);
  for (Index f = 0; f < sphere.faces.rows(); ++f) {
    if (sphere.vertices(sphere.faces(f, 0), 1) + sphere.vertices(sphere.faces(f, 1), 1) +
            sphere.vertices(sphere.faces(f, 2), 1) >
        0) {
      half.faces.conservativeResize(half.faces.rows() + 1, 3);
      half.faces.row(half.faces.rows() - 1) = sphere.faces.row(f);
    }
  }
  FindSeamsOptions options;
  options.stretch = 0.06;
  options.front_and_back = false;
  const FoundSeams found = find_seams(half, no_cut(topology(half)), options);
  EXPECT_TRUE(found.reached);
  EXPECT_GT(found.added, 0);
  const FlatPattern pattern = flatten_surface(half, found.cut, laid_as_found(options));
  const FlatMeasures measures = measure_flat(half, pattern);
  EXPECT_LT(measures.strain_p99, 0.066);
  EXPECT_EQ(measures.inverted, 0);
  EXPECT_EQ(measures.overlaps, 0);
}

TEST(FindSeams, OverlappingPanel_IsNotCalledStretched) {
  // A ramp of a turn and a half, which lies flat twice over half a ring.
  constexpr int kSteps = 60;
  Mesh ramp;
  ramp.vertices.resize(2 * (kSteps + 1), 3);
  ramp.faces.resize(2 * kSteps, 3);
  for (int i = 0; i <= kSteps; ++i) {
    const double turn = 3 * std::numbers::pi * i / kSteps;
    for (int side = 0; side < 2; ++side) {
      const double radius = 0.2 + 0.1 * side;
      ramp.vertices.row(2 * i + side) << radius * std::cos(turn), 0.01 * turn,
          radius * std::sin(turn);
    }
    if (i < kSteps) {
      ramp.faces.row(2 * i) << 2 * i, 2 * i + 2, 2 * i + 1;
      ramp.faces.row(2 * i + 1) << 2 * i + 1, 2 * i + 2, 2 * i + 3;
    }
  }
  FindSeamsOptions options;
  options.front_and_back = false;
  std::vector<std::string> said;
  find_seams(ramp, no_cut(topology(ramp)), options,
             [&](const std::string& line) { said.push_back(line); });
  ASSERT_GE(said.size(), 2U);
  EXPECT_EQ(said.front(), "opened: 1 panels, 0.0% stretched too far, 1 over themselves");
  EXPECT_THAT(said.back(), ::testing::EndsWith("0.0% stretched too far"));
}

TEST(FindSeams, GivenSeams_StayAndNeedlessOnesAreSewnAgain) {
  // A tube's side is all it needs; a ring that was given stays.
  Mesh mesh = fixtures::tube(32, 10, 0.6);
  mesh.vertices.col(0) *= 0.2;
  mesh.vertices.col(2) *= 0.2;
  const Topology whole = topology(mesh);
  std::vector<int> upper;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    upper.push_back(mesh.vertices.col(1)(mesh.faces.row(f)).maxCoeff() > 0.301 ? 1 : 0);
  }
  const std::vector<char> ring = cut_between_labels(whole, upper);
  FindSeamsOptions options;
  options.front_and_back = false;
  const FoundSeams found = find_seams(mesh, ring, options);
  EXPECT_TRUE(found.reached);
  for (std::size_t e = 0; e < ring.size(); ++e) {
    EXPECT_TRUE(ring[e] == 0 || found.cut[e] != 0);
  }
  EXPECT_EQ(flatten_surface(mesh, found.cut).cut.panel_count, 2);
}

TEST(FindSeams, SewingSeamsAgain_KeepsTheBoundWithFewerSeams) {
  // A ball, whose greedy cuts are more than it needs.
  Mesh ball = fixtures::sphere(3);
  ball.vertices *= 0.12;
  FindSeamsOptions options;
  options.stretch = 0.05;
  options.join = false;
  const FoundSeams cut = find_seams(ball, no_cut(topology(ball)), options);
  options.join = true;
  const FoundSeams sewn = find_seams(ball, no_cut(topology(ball)), options);
  EXPECT_TRUE(cut.reached);
  EXPECT_TRUE(sewn.reached);
  EXPECT_GT(sewn.joined, 0);
  EXPECT_EQ(sewn.added, cut.added);
  const FlatPattern before = flatten_surface(ball, cut.cut, laid_as_found(options));
  const FlatPattern after = flatten_surface(ball, sewn.cut, laid_as_found(options));
  EXPECT_LT(measure_flat(ball, after).seam_length, measure_flat(ball, before).seam_length);
  EXPECT_LT(measure_flat(ball, after).strain_p99, 1.1 * options.stretch);
  EXPECT_EQ(measure_flat(ball, after).overlaps, 0);
}

TEST(FindSeams, SeamsFoundBefore_AreContinuedFrom) {
  Mesh ball = fixtures::sphere(3);
  ball.vertices *= 0.12;
  FindSeamsOptions options;
  options.stretch = 0.05;
  const FoundSeams found = find_seams(ball, no_cut(topology(ball)), options);
  options.join = false;
  const FoundSeams again = find_seams(ball, no_cut(topology(ball)), options, {}, found);
  EXPECT_TRUE(again.reached);
  EXPECT_EQ(again.added, 0);
  EXPECT_EQ(again.cut, found.cut);
  EXPECT_EQ(again.sides, found.sides);
}

TEST(FindSeams, MismatchedFlagsOrBadSurfaces_AreRefused) {
  const Mesh mesh = fixtures::grid(3, 3);
  EXPECT_THROW(find_seams(mesh, {}), LogicError);
  FoundSeams other;
  other.cut = {1};
  EXPECT_THROW(find_seams(mesh, no_cut(topology(mesh)), {}, {}, other), LogicError);
  ATELIER_EXPECT_REFUSED(find_seams(Mesh{}, {}), DataError, "no triangle");
}

}  // namespace
}  // namespace atelier
