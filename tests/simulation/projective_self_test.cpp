// Projective dynamics: contact of cloth with cloth in the solution, against known answers.
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "simulation/contact/crossings.h"
#include "simulation/projective/contact_impulses.h"
#include "simulation/projective/projective.h"
#include "tests/simulation/cloth_fixtures.h"
#include "tests/simulation/test_bodies.h"

namespace atelier {
namespace {

using fixtures::still;

SolverOptions with_self_contact(double time_step, int substeps, int iterations) {
  SolverOptions options;
  options.name = "projective-friction";
  options.time_step = time_step;
  options.projective.substeps = substeps;
  options.projective.iterations = iterations;
  options.self_contact = true;
  options.report = false;
  return options;
}

/// Two sheets, the smaller on the larger one, on a plane that falls along +x; each at its distance.
struct Stack {
  Cloth cloth;
  Mesh plane;
  ClothState state;
  Eigen::RowVector3d down;
  Index lower;  ///< vertices of the lower sheet, which come first
};
Stack stacked_sheets(double angle) {
  Stack out;
  const double thickness = 1e-3;
  const auto sheet = [&](int cells, double from, double height) {
    Garment garment = fixtures::garment_of(fixtures::sheet(cells, cells, 0.03), 0.2, 500, 1e-4);
    garment.mesh.vertices.rowwise() += Eigen::RowVector3d(from, height, from);
    garment.material.thickness = thickness;
    return make_cloth(garment);
  };
  const Cloth lower = sheet(10, 0, thickness);
  out.lower = lower.rest_positions.rows();
  out.cloth = join_cloths({lower, sheet(3, 0.047, 2 * thickness)});
  out.plane = fixtures::incline(angle, 20);
  out.state = rest_state(out.cloth);
  out.down = {std::cos(angle), -std::sin(angle), 0};
  const Eigen::AngleAxisd turn(-angle, Eigen::Vector3d::UnitZ());
  for (Index v = 0; v < out.state.positions.rows(); ++v) {
    out.state.positions.row(v) = (turn * out.state.positions.row(v).transpose()).transpose();
  }
  return out;
}

/// Speeds down the slope of both sheets after `seconds`.
struct Speeds {
  double lower, upper;
};
Speeds speeds_after(double seconds, double angle, double on_plane, double on_cloth) {
  const Stack stack = stacked_sheets(angle);
  // Steps in which sheets slide by less than their distance.
  SolverOptions options = with_self_contact(0.01, 20, 20);
  options.friction = on_plane;
  options.self_friction = on_cloth;
  ProjectiveSolver solver(stack.cloth, stack.plane.faces, options);
  solver.set_state(stack.state);
  for (int i = 0; i < static_cast<int>(std::lround(seconds / options.time_step)); ++i) {
    solver.advance(still(stack.plane.vertices));
  }
  const Points v = solver.state().velocities;
  const Index upper = v.rows() - stack.lower;
  return {v.topRows(stack.lower).colwise().mean().dot(stack.down),
          v.bottomRows(upper).colwise().mean().dot(stack.down)};
}

TEST(ProjectiveStack, UpperSheet_SlidesByCoulombsLaw) {
  const double angle = std::numbers::pi / 4;
  for (const double mu : {0.0, 0.3, 0.6, 0.9}) {
    const double seconds = mu > 0 ? 0.2 : 0.1;  // up to 1 m/s, half their distance in a step
    const Speeds found = speeds_after(seconds, angle, 2, mu);
    const double expected = 9.81 * (std::sin(angle) - mu * std::cos(angle)) * seconds;
    EXPECT_NEAR(found.upper, expected, 1e-3 * 9.81 * seconds) << mu;
    EXPECT_NEAR(found.lower, 0, 1e-5) << mu;
    RecordProperty("off_" + std::to_string(mu),
                   std::to_string((found.upper - expected) / (9.81 * seconds)));
  }
}

TEST(ProjectiveStack, UpperSheet_StaysWhereFrictionHolds) {
  const Speeds found = speeds_after(1, std::numbers::pi / 4, 2, 1.1);
  EXPECT_NEAR(found.upper, 0, 1e-6);
  EXPECT_NEAR(found.lower, 0, 1e-6);
}

TEST(ProjectiveStack, BothSheets_SlideAsOneOnAnIncline) {
  const double angle = std::numbers::pi / 4;
  const double mu = 0.3;
  const Speeds found = speeds_after(0.5, angle, mu, 1.5);
  const double expected = 9.81 * (std::sin(angle) - mu * std::cos(angle)) * 0.5;
  EXPECT_NEAR(found.upper, expected, 1e-3 * expected);
  EXPECT_NEAR(found.lower, expected, 1e-3 * expected);
}

/// Cloth of a strip along a line with its flat rest shape along x.
Garment ribbon_along(const std::vector<Eigen::RowVector3d>& line, double width,
                     const std::vector<Eigen::RowVector3d>& across) {
  const int rows = static_cast<int>(line.size());
  Garment garment = fixtures::garment_of(fixtures::sheet(1, rows - 1, 1), 0.25, 200, 2e-6);
  double along = 0;
  garment.rest.resize(2 * rows, 2);
  garment.rest_faces = garment.mesh.faces;
  for (int r = 0; r < rows; ++r) {
    along += r > 0 ? (line[r] - line[r - 1]).norm() : 0;
    for (int side = 0; side < 2; ++side) {
      garment.mesh.vertices.row(2 * r + side) = line[r] + (side - 0.5) * width * across[r];
      garment.rest.row(2 * r + side) << (side - 0.5) * width, along;
    }
  }
  return garment;
}

// A ribbon that is let go upright over a floor folds on itself, again and again.
TEST(ProjectiveRibbon, FallingRibbon_FoldsWithoutCrossing) {
  std::vector<Eigen::RowVector3d> line;
  const int rows = 60;
  for (int r = 0; r < rows; ++r) {
    line.emplace_back(0.003 * std::sin(0.9 * r), 0.01 + 0.01 * r, 0);
  }
  Garment garment =
      ribbon_along(line, 0.02, std::vector<Eigen::RowVector3d>(rows, Eigen::RowVector3d(0, 0, 1)));
  garment.material.thickness = 1.5e-3;
  garment.material.friction = 0.3;
  const Cloth cloth = make_cloth(garment);
  const Mesh floor = fixtures::incline(0, 2);
  ProjectiveSolver solver(cloth, floor.faces, with_self_contact(1.0 / 60, 5, 20));
  int contacts = 0;
  for (int i = 0; i < 90; ++i) {
    solver.advance(still(floor.vertices));
    contacts = std::max(contacts, solver.residual().cloth_contacts);
    ASSERT_EQ(count_crossings(solver.state().positions, cloth.faces), 0) << i;
  }
  const Points x = solver.state().positions;
  EXPECT_GT(contacts, 20);
  EXPECT_GT(x.col(1).minCoeff(), 0);
  EXPECT_LT(x.col(1).maxCoeff(), 0.2) << "it lies in folds";
}

// An overhand knot (the polynomial trefoil of Shastri 1992) that is pulled tight stays one: nothing
// passes, and its ends do not come apart as far as the ribbon is long.
TEST(ProjectiveKnot, PulledKnot_DoesNotPassThroughItself) {
  std::vector<Eigen::RowVector3d> fine;
  const auto at = [](double t) {
    return Eigen::RowVector3d(t * t * t - 3 * t, t * t * t * t - 4 * t * t,
                              0.35 * (t * t * t * t * t - 10 * t));
  };
  for (int i = 0; i <= 4000; ++i) {
    fine.push_back(0.02 * at(-2.15 + 4.3 * i / 4000));
  }
  std::vector<Eigen::RowVector3d> line{fine[0]};
  const double step = 0.008;
  for (const Eigen::RowVector3d& p : fine) {
    if ((p - line.back()).norm() >= step) {
      line.push_back(p);
    }
  }
  // Across the line, turned along it as little as may be.
  std::vector<Eigen::RowVector3d> across;
  Eigen::RowVector3d side(0, 0, 1);
  for (std::size_t r = 0; r < line.size(); ++r) {
    const Eigen::RowVector3d along =
        (line[std::min(r + 1, line.size() - 1)] - line[r > 0 ? r - 1 : 0]).normalized();
    side = (side - side.dot(along) * along).normalized();
    across.push_back(side);
  }
  Garment garment = ribbon_along(line, 0.006, across);
  garment.material.thickness = 1.5e-3;
  garment.material.friction = 0.2;
  const int last = static_cast<int>(garment.mesh.vertices.rows()) - 1;
  const Cloth cloth = make_cloth(garment, {0, 1, last - 1, last});
  ASSERT_EQ(count_crossings(cloth.rest_positions, cloth.faces), 0);
  ProjectiveSolver solver(cloth, {}, with_self_contact(1.0 / 60, 10, 20));
  Control control;
  control.gravity.setZero();
  control.pin_targets = cloth.rest_positions;
  const Eigen::RowVector3d pull = (line.back() - line.front()).normalized();
  const double length = step * static_cast<double>(line.size());
  const double start = (line.back() - line.front()).norm();
  const int frames = 120;
  const double speed = 0.5 * (0.8 * length - start) / frames;  // to four fifths of its length
  for (int i = 0; i < frames; ++i) {
    for (int end : {0, 1}) {
      control.pin_targets.row(end) -= speed * pull;
      control.pin_targets.row(last - end) += speed * pull;
    }
    solver.advance(control);
    ASSERT_EQ(count_crossings(solver.state().positions, cloth.faces), 0) << i;
  }
  EXPECT_GT(solver.residual().cloth_contacts, 10) << "it is a knot still";
}

// Layers on a ball: what is left of Coulomb's law between them falls with iterations too.
TEST(ProjectiveSelfResidual, CoulombsLaw_IsMetWithIterations) {
  const Mesh ball = fixtures::sphere(0.1, 24, 48);
  std::vector<Cloth> sheets;
  for (int k = 0; k < 2; ++k) {
    Garment garment = fixtures::garment_of(fixtures::sheet(10, 10, 0.02, 'a'), 0.2, 300, 1e-5);
    garment.mesh.vertices.rowwise() -= Eigen::RowVector3d(0.1, -0.102 - 0.0015 * k, 0.1);
    garment.material.friction = 0.4;
    garment.material.thickness = 1e-3;
    sheets.push_back(make_cloth(garment));
  }
  const Cloth cloth = join_cloths(sheets);
  double last = 1e9;
  for (const int iterations : {5, 20, 80, 300}) {
    ProjectiveSolver solver(cloth, ball.faces, with_self_contact(1.0 / 60, 10, iterations));
    double sum = 0;
    for (int i = 0; i < 12; ++i) {
      solver.advance(still(ball.vertices));
      sum += i < 8 ? 0 : solver.residual().cloth_contact / 4;
    }
    EXPECT_GT(solver.residual().cloth_contacts, 5);
    EXPECT_LT(sum, last) << iterations;
    last = sum;
    RecordProperty("of_" + std::to_string(iterations), std::to_string(sum));
  }
  EXPECT_LT(last, 1e-2);
}

// Two walls at a right angle, without friction: each takes its half.
TEST(ContactImpulses, TwoWalls_HoldAParticleTogether) {
  const double s = std::numbers::sqrt2 / 2;
  ContactImpulses impulses;
  impulses.begin_step({{0, {{s, s, 0}, {}, 0, 1}}}, {}, {0, 0}, {0.5});
  EXPECT_EQ(impulses.add_across({{0, {{-s, s, 0}, {}, 0, 1}}}), 1);
  EXPECT_EQ(impulses.add_across({{0, {{-s, s, 0}, {}, 0, 1}}}), 0) << "it has one already";
  std::vector<Vec4<double>> v{{0, -1, 0, 0}};
  impulses.hold(v, v);
  EXPECT_NEAR(v[0].x, 0, 1e-12);
  EXPECT_NEAR(v[0].y, 0, 1e-12);
  EXPECT_NEAR(impulses.with_body()[0].impulse.y, 1, 1e-12);
  EXPECT_NEAR(impulses.across()[0].impulse.y, 1, 1e-12);
  EXPECT_NEAR(impulses.body_residual({{0, 2, 0, 0}}, v, 1).most, 0, 1e-12);
}

// Two particles on one another and the lower one on the ground: each impulse by hand.
TEST(ContactImpulses, Levels_CarryTheLoadDown) {
  const Vec3d up{0, 1, 0};
  // Particle 0 lies on the body; 1 lies on the face 0, 2, 3, over 0.
  const std::vector<TouchedBody> body{{0, {up, {}, 0, 1}}};
  const std::vector<TouchedCloth> cloth{{{1, 0, 2, 3}, {1, -1, 0, 0}, up, 0}};
  const std::vector<double> inverse_mass{1, 0.5, 1, 1};
  ContactImpulses impulses;
  impulses.begin_step(body, cloth, {0.5, 0.5}, inverse_mass);
  std::vector<Vec4<double>> without{{0, -1, 0, 0}, {0, -1, 0, 0}, {}, {}};
  std::vector<Vec4<double>> v;
  for (int i = 0; i < 40; ++i) {
    v = without;
    impulses.hold(v, v);
  }
  EXPECT_NEAR(v[0].y, 0, 1e-9);
  EXPECT_NEAR(v[1].y, 0, 1e-9);
  EXPECT_NEAR(impulses.with_cloth()[0].impulse.y, 2, 1e-8) << "it carries 2 kg m/s";
  EXPECT_NEAR(impulses.with_body()[0].impulse.y, 3, 1e-8) << "and the body all three";
  EXPECT_NEAR(impulses.cloth_residual(v, 1).most, 0, 1e-8);
  // Pulled sideways by 0.8 kg m/s, within the cone of 1, it stays; by 4 the cone takes 1 from its
  // 2 kg, and the body's cone of 1.5 holds the lower one. On a smoother body, of a cone of 0.3,
  // both slide as one, and the lower one gets its third of the rest from the upper.
  struct Pulled {
    double friction_of_body, pull, upper, lower;
  };
  for (const Pulled& c : {Pulled{0.5, 0.4, 0, 0}, {0.5, 2, 1.5, 0}, {0.1, 0.4, 0.5 / 3, 0.5 / 3}}) {
    impulses.begin_step(body, cloth, {c.friction_of_body, 0.5}, inverse_mass);
    without[1].x = c.pull;
    for (int i = 0; i < 200; ++i) {
      v = without;
      impulses.hold(v, v);
    }
    EXPECT_NEAR(v[1].x, c.upper, 1e-7) << c.pull;
    EXPECT_NEAR(v[0].x, c.lower, 1e-7) << c.pull;
    EXPECT_NEAR(impulses.with_cloth()[0].impulse.x, 2 * (c.upper - c.pull), 1e-7) << c.pull;
  }
}

}  // namespace
}  // namespace atelier
