// Known answers of friction for projective dynamics; friction_test.cpp has XPBD's.
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <utility>

#include <gtest/gtest.h>

#include "simulation/projective/coulomb.h"
#include "simulation/projective/projective.h"
#include "simulation/solver.h"
#include "tests/simulation/cloth_fixtures.h"
#include "tests/simulation/test_bodies.h"

namespace atelier {
namespace {

using fixtures::still;

SolverOptions projective_options(double time_step, int substeps, int iterations) {
  SolverOptions options;
  options.name = "projective-friction";
  options.time_step = time_step;
  options.projective.substeps = substeps;
  options.projective.iterations = iterations;
  options.report = false;
  return options;
}

/// A patch of cloth on a plane that falls along +x, at its contact distance.
struct SlopedPatch {
  Cloth cloth;
  Mesh plane;
  ClothState state;
  Eigen::RowVector3d down;
};
SlopedPatch sloped_patch(double angle, double friction) {
  SlopedPatch out;
  Garment garment = fixtures::garment_of(fixtures::sheet(3, 3, 0.03), 0.2, 500, 1e-4);
  garment.material.friction = friction;
  garment.material.thickness = 1e-3;
  out.cloth = make_cloth(garment);
  out.plane = fixtures::incline(angle, 20);
  out.state = rest_state(out.cloth);
  out.down = {std::cos(angle), -std::sin(angle), 0};
  const Eigen::AngleAxisd turn(-angle, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d normal = turn * Eigen::Vector3d::UnitY();
  for (Index v = 0; v < out.state.positions.rows(); ++v) {
    out.state.positions.row(v) =
        (turn * out.state.positions.row(v).transpose() + 1e-3 * normal).transpose();
  }
  return out;
}

/// Speed down the slope after a second.
double speed_after_a_second(double angle, double friction, const SolverOptions& options,
                            Device device) {
  const SlopedPatch patch = sloped_patch(angle, friction);
  const std::unique_ptr<Solver> solver =
      create_solver({patch.cloth, patch.plane.faces}, options, device);
  solver->set_state(patch.state);
  const int frames = static_cast<int>(std::lround(1 / options.time_step));
  for (int i = 0; i < frames; ++i) {
    solver->step(still(patch.plane.vertices));
  }
  return solver->state().velocities.colwise().mean().dot(patch.down);
}

TEST(ProjectiveIncline, SlidingCloth_AcceleratesByCoulombsLaw) {
  const double angle = std::numbers::pi / 4;
  const SolverOptions options = projective_options(0.01, 10, 10);
  for (const Device device : fixtures::devices()) {
    for (const double mu : {0.0, 0.1, 0.3, 0.6, 0.9, 0.99}) {
      const double expected = 9.81 * (std::sin(angle) - mu * std::cos(angle));
      const double found = speed_after_a_second(angle, mu, options, device);
      EXPECT_NEAR(found, expected, 1e-4 * 9.81) << mu << device_name(device);
      RecordProperty("off_" + std::to_string(mu), std::to_string((found - expected) / 9.81));
    }
  }
}

TEST(ProjectiveIncline, Threshold_IsTheFrictionCoefficient) {
  const double mu = 0.4;
  const SolverOptions options = projective_options(0.01, 4, 10);
  for (const Device device : fixtures::devices()) {
    EXPECT_LT(speed_after_a_second(std::atan(mu - 1e-3), mu, options, device), 1e-9);
    EXPECT_GT(speed_after_a_second(std::atan(mu + 1e-3), mu, options, device), 5e-3);
  }
}

TEST(ProjectiveIncline, HighFriction_HoldsWithoutCreepForTenSeconds) {
  for (const Device device : fixtures::devices()) {
    for (const double mu : {1.01, 1.1}) {
      const SlopedPatch patch = sloped_patch(std::numbers::pi / 4, mu);
      const std::unique_ptr<Solver> solver = create_solver(
          {patch.cloth, patch.plane.faces}, projective_options(1.0 / 60, 4, 10), device);
      solver->set_state(patch.state);
      for (int i = 0; i < 600; ++i) {
        solver->step(still(patch.plane.vertices));
      }
      const ClothState end = solver->state();
      EXPECT_LT((end.positions - patch.state.positions).rowwise().norm().maxCoeff(), 1e-6) << mu;
      EXPECT_LT(end.velocities.rowwise().norm().maxCoeff(), 1e-9) << mu << device_name(device);
    }
  }
}

// A belt brings cloth to its speed in t = v / (mu g).
TEST(ProjectiveBelt, MovingBelt_AcceleratesClothByFriction) {
  const double mu = 0.4;
  const double belt = 1.0;
  const SlopedPatch patch = sloped_patch(0, mu);
  ProjectiveSolver solver(patch.cloth, patch.plane.faces, projective_options(1.0 / 60, 10, 10));
  solver.set_state(patch.state);
  const double until = belt / (mu * 9.81);
  Points at = patch.plane.vertices;
  for (int i = 0; i < 30; ++i) {
    Control control;
    control.body_start = at;
    at.col(0).array() += belt / 60;
    control.body_end = at;
    solver.advance(control);
    const double t = (i + 1) / 60.0;
    const double speed = solver.state().velocities.col(0).mean();
    EXPECT_NEAR(speed, std::min(belt, mu * 9.81 * t), t < until ? 1e-6 : 1e-9) << t;
  }
}

/// What is left of Coulomb's law at the contacts of a sheet over a ball whose middle it touches:
/// mean of four frames of the root mean square and of the worst contact.
std::pair<double, double> residual_on_a_ball(int iterations, int acceleration) {
  Garment garment = fixtures::garment_of(fixtures::sheet(14, 14, 0.02, 'a'), 0.2, 300, 1e-5);
  garment.mesh.vertices.rowwise() -= Eigen::RowVector3d(0.14, -0.102, 0.14);
  garment.material.friction = 0.4;
  garment.material.thickness = 1e-3;
  const Mesh ball = fixtures::sphere(0.1, 24, 48);
  SolverOptions options = projective_options(1.0 / 60, 10, iterations);
  options.projective.acceleration = acceleration;
  ProjectiveSolver solver(make_cloth(garment), ball.faces, options);
  double sum = 0;
  double worst = 0;
  for (int i = 0; i < 12; ++i) {
    solver.advance(still(ball.vertices));
    const ProjectiveResidual now = solver.residual();
    EXPECT_LE(now.contact, now.worst_contact);
    sum += i < 8 ? 0 : now.contact / 4;
    worst += i < 8 ? 0 : now.worst_contact / 4;
  }
  EXPECT_GT(solver.residual().contacts, 5);
  return {sum, worst};
}

TEST(ProjectiveResidual, CoulombsLaw_IsMetWithIterations) {
  for (const int acceleration : {0, 5}) {
    double last = 1e9;
    double last_worst = 1e9;
    for (const int iterations : {5, 10, 20, 30, 300}) {
      const auto [residual, worst] = residual_on_a_ball(iterations, acceleration);
      EXPECT_LT(residual, last) << iterations;
      EXPECT_LT(worst, last_worst) << iterations;
      last = residual;
      last_worst = worst;
      RecordProperty("of_" + std::to_string(iterations) + "_with_" + std::to_string(acceleration),
                     std::to_string(residual) + ", worst " + std::to_string(worst));
    }
    EXPECT_LT(last_worst, acceleration > 0 ? 1e-5 : 1);
  }
}

// T13: T2 / T1 > exp(mu phi) slips. A line over half of a cylinder with a weight at either end.
bool slips_over_a_cylinder(double friction, double ratio) {
  const double radius = 0.1;
  const int sectors = 256;
  Mesh cylinder;
  cylinder.vertices.resize(2 * sectors, 3);
  cylinder.faces.resize(2 * sectors, 3);
  for (int i = 0; i < sectors; ++i) {
    const double a = 2 * std::numbers::pi * i / sectors;
    cylinder.vertices.row(2 * i) << radius * std::cos(a), radius * std::sin(a), -0.1;
    cylinder.vertices.row(2 * i + 1) << radius * std::cos(a), radius * std::sin(a), 0.1;
    const int n = (i + 1) % sectors;
    cylinder.faces.row(2 * i) << 2 * i, 2 * n + 1, 2 * i + 1;
    cylinder.faces.row(2 * i + 1) << 2 * i, 2 * n, 2 * n + 1;
  }
  const double thickness = 1e-3;
  const double line = radius + thickness;
  const int on_arc = 64;
  const int hanging = 12;
  const double step = std::numbers::pi * line / on_arc;
  Points p(2 * hanging + on_arc + 1, 3);
  for (Index i = 0; i < p.rows(); ++i) {
    const double along = static_cast<double>(i) - hanging;
    const double angle = std::numbers::pi * along / on_arc;
    if (along < 0) {
      p.row(i) << line, along * step, 0;
    } else if (along > on_arc) {
      p.row(i) << -line, -(along - on_arc) * step, 0;
    } else {
      p.row(i) << line * std::cos(angle), line * std::sin(angle), 0;
    }
  }
  std::vector<double> mass(static_cast<std::size_t>(p.rows()), 1e-4);
  mass.front() = 0.05 * ratio;
  mass.back() = 0.05;
  std::vector<ClothSpring> springs;
  for (int i = 1; i < p.rows(); ++i) {
    springs.push_back({i - 1, i, step, 2000});
  }
  Cloth cloth = make_spring_net(p, mass, springs, {});
  cloth.material.friction = friction;
  cloth.material.thickness = thickness;
  SolverOptions options = projective_options(1.0 / 60, 30, 30);
  options.velocity_damping = 2;
  ProjectiveSolver solver(cloth, cylinder.faces, options);
  const Index middle = hanging + on_arc / 2;
  double before = 0;
  for (int i = 0; i < 90; ++i) {
    solver.advance(still(cylinder.vertices));
    before = i == 45 ? solver.state().positions(middle, 0) : before;
  }
  return std::abs(solver.state().positions(middle, 0) - before) > 2e-3;
}

TEST(ProjectiveCapstan, Line_SlipsAtTheExponentialOfTheAngle) {
  for (const double mu : {0.3, 0.6}) {
    const double expected = std::exp(mu * std::numbers::pi);
    EXPECT_FALSE(slips_over_a_cylinder(mu, 0.95 * expected)) << mu;
    EXPECT_TRUE(slips_over_a_cylinder(mu, 1.05 * expected)) << mu;
  }
}

// A spring pulls a particle down one wall of a groove and through the other: it ends where both
// hold it.
TEST(ProjectiveGroove, ParticleBetweenTwoWalls_RestsInTheGroove) {
  Mesh groove;
  groove.vertices.resize(6, 3);
  groove.vertices << -1, 1, -1, -1, 1, 1, 0, 0, -1, 0, 0, 1, 1, 1, -1, 1, 1, 1;
  groove.faces.resize(4, 3);
  groove.faces << 0, 1, 2, 1, 3, 2, 2, 3, 4, 3, 5, 4;
  Points x(2, 3);
  x << 0.03, -0.05, 0, -0.02, 0.0215, 0;
  const Cloth cloth = make_spring_net(x, {0.001, 0.001}, {{0, 1, 0.01, 2000}}, {0});
  SolverOptions options;
  options.name = "projective-friction";
  options.thickness = 1e-3;
  options.friction = 0;
  options.report = false;
  for (const Device device : fixtures::devices()) {
    const std::unique_ptr<Solver> solver = create_solver({cloth, groove.faces}, options, device);
    for (int i = 0; i < 60; ++i) {
      solver->step(still(groove.vertices));
    }
    const ClothState end = solver->state();
    const Eigen::RowVector3d bottom(0, std::numbers::sqrt2 * 1e-3, 0);
    EXPECT_LT((end.positions.row(1) - bottom).norm(), 1e-6)
        << device_name(device) << end.positions.row(1);
    EXPECT_LT(end.velocities.row(1).norm(), 1e-6) << device_name(device);
  }
  ProjectiveSolver solver(cloth, groove.faces, options);
  for (int i = 0; i < 60; ++i) {
    solver.advance(still(groove.vertices));
  }
  EXPECT_LT(solver.residual().contact, 1e-6);
}

TEST(CoulombImpulse, Impulse_StaysInTheCone) {
  const Vec3d up{0, 1, 0};
  const auto at = [&](double x, double y, double friction) {
    return coulomb_impulse({x, y, 0}, up, friction);
  };
  EXPECT_EQ(norm(at(1, -1, 0.5)), 0);
  EXPECT_EQ(at(0.4, 1, 0.5).x, 0.4);
  EXPECT_EQ(at(2, 1, 0.5).x, 0.5);
  EXPECT_EQ(at(2, 1, 0.5).y, 1);
  EXPECT_EQ(at(2, 1, 0).x, 0);
  // Sticks within the cone, slips on its border, is apart: no residual. All else has one.
  EXPECT_EQ(coulomb_residual({0.2, 1, 0}, {}, up, 0.5, 1), 0);
  EXPECT_NEAR(coulomb_residual({-0.5, 1, 0}, {3, 0, 0}, up, 0.5, 1), 0, 1e-12);
  EXPECT_EQ(coulomb_residual({}, {1, 2, 0}, up, 0.5, 1), 0);
  EXPECT_GT(coulomb_residual({0.2, 1, 0}, {0.1, 0, 0}, up, 0.5, 1), 0.05);
  EXPECT_GT(coulomb_residual({}, {0, -0.1, 0}, up, 0.5, 1), 0.05);
  EXPECT_GT(coulomb_residual({0, -1, 0}, {}, up, 0.5, 1), 0.5);
}

}  // namespace
}  // namespace atelier
