#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/simulation/cloth_fixtures.h"
#include "tests/support/devices.h"

namespace atelier {
namespace {

class Air : public fixtures::DeviceTest {};
class Pins : public fixtures::DeviceTest {};
class Sewing : public fixtures::DeviceTest {};
class Tethers : public fixtures::DeviceTest {};
class NotFinite : public fixtures::DeviceTest {};

constexpr double kForcesDensity = 0.1;

Garment square() {
  return fixtures::garment_of(fixtures::sheet(6, 6, 0.02, 'a'), kForcesDensity, 500, 1e-5);
}

// m g = 1/2 rho c A v^2, flat to the air.
TEST_P(Air, FallingSheet_ReachesItsTerminalSpeed) {
  for (const double drag : {1.0, 2.0}) {
    XpbdOptions options;
    options.time_step = 1.0 / 240;
    options.substeps = 4;
    options.drag = drag;
    ClothSolver solver(make_cloth(square()), {}, options, device());
    for (int i = 0; i < 480; ++i) {
      solver.advance({});
    }
    const double expected = std::sqrt(2 * kForcesDensity * 9.81 / (1.2 * drag));
    const ClothState state = solver.state();
    EXPECT_NEAR(-state.velocities.col(1).mean() / expected, 1, 0.005);
    EXPECT_LT(state.velocities.col(0).cwiseAbs().maxCoeff(), 1e-3);
  }
}

// Drag and lift of a plate at rest in the wind, as they are defined.
TEST_P(Air, Wind_PushesAlongTheNormalAndLiftsAcross) {
  Garment garment = square();
  const double slope = 0.5;
  for (Index v = 0; v < garment.mesh.vertices.rows(); ++v) {
    garment.mesh.vertices(v, 1) = garment.mesh.vertices(v, 0) * std::sin(slope);
    garment.mesh.vertices(v, 0) *= std::cos(slope);
  }
  const Eigen::Vector3d normal(-std::sin(slope), std::cos(slope), 0);
  const double speed = 3;
  const double step = 1e-4;
  XpbdOptions options;
  options.time_step = step;
  options.substeps = 1;
  options.drag = 1.3;
  options.lift = 0.7;
  for (const bool field : {false, true}) {
    Control control;
    control.gravity.setZero();
    const Eigen::Vector3d wind(speed, 0, 0);
    if (field) {
      control.wind_field = Points::Zero(garment.mesh.vertices.rows(), 3);
      control.wind_field.col(0).setConstant(speed);
    } else {
      control.wind = wind;
    }
    const Cloth cloth = make_cloth(garment);
    ClothSolver solver(cloth, {}, options, device());
    solver.advance(control);
    const double along = wind.dot(normal);
    const Eigen::Vector3d across = normal - along / wind.squaredNorm() * wind;
    const Eigen::Vector3d pressure =
        0.5 * 1.2 * (1.3 * std::abs(along) * along * normal + 0.7 * along * speed * across);
    const Eigen::Vector3d gained = solver.state().velocities.colwise().mean() / step;
    EXPECT_LT((gained - pressure / kForcesDensity).norm(), 0.002 * pressure.norm() / kForcesDensity)
        << (field ? "field" : "everywhere");
  }
}

// Still air takes energy, and never gives any.
TEST_P(Air, StillAir_OnlySlowsDown) {
  XpbdOptions options;
  options.iterations = 30;
  options.precision = "double";
  options.drag = 1.5;
  options.lift = 0.5;
  const Cloth cloth = make_cloth(square());
  ClothSolver solver(cloth, {}, options, device());
  ClothState state = rest_state(cloth);
  for (Index v = 0; v < state.velocities.rows(); ++v) {
    state.velocities.row(v) << 1, 2 * std::sin(30 * state.positions(v, 0)), 0.5;
  }
  solver.set_state(state);
  Control control;
  control.gravity.setZero();
  double last = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 60; ++i) {
    const FrameReport report = solver.advance(control);
    EXPECT_LE(report.kinetic_energy + report.elastic_energy, last * (1 + 1e-5));
    last = report.kinetic_energy + report.elastic_energy;
  }
}

TEST_P(Pins, PinsAndAttachments_FollowControlAndBodyExactly) {
  Garment garment = square();
  Mesh body;
  body.vertices.resize(3, 3);
  body.vertices << -0.5, -0.3, -0.5, 0.5, -0.3, -0.5, 0, -0.3, 0.7;
  body.faces.resize(1, 3);
  body.faces << 0, 2, 1;
  garment.attachments = {{5, 0, {0.2, 0.5, 0.3}, 0.25}};
  const Cloth cloth = make_cloth(garment, {0, 42});
  XpbdOptions options;
  ClothSolver solver(cloth, body.faces, options, device());
  Control control;
  control.pin_targets = cloth.rest_positions;
  Points previous = body.vertices;
  for (int i = 1; i <= 20; ++i) {
    const Eigen::AngleAxisd turn(0.02 * i, Eigen::Vector3d(0.2, 1, 0.1).normalized());
    Points now = body.vertices;
    for (Index v = 0; v < 3; ++v) {
      now.row(v) = (turn * Eigen::Vector3d(body.vertices.row(v).transpose())).transpose();
    }
    control.body_start = previous;
    control.body_end = now;
    control.pin_targets.row(0) = cloth.rest_positions.row(0) + Eigen::RowVector3d(0, 0.001 * i, 0);
    solver.advance(control);
    previous = now;
    const ClothState state = solver.state();
    const auto corner = [&](int k) { return Eigen::Vector3d(now.row(body.faces(0, k))); };
    const Eigen::Vector3d normal =
        (corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized();
    const Eigen::Vector3d expected =
        0.2 * corner(0) + 0.5 * corner(1) + 0.3 * corner(2) + 0.25 * normal;
    EXPECT_LT((state.positions.row(5).transpose() - expected).norm(), 1e-6) << i;
    EXPECT_LT((state.positions.row(0) - control.pin_targets.row(0)).norm(), 1e-6) << i;
    EXPECT_LT((state.positions.row(42) - cloth.rest_positions.row(42)).norm(), 1e-6) << i;
  }
}

// The weight of what hangs on a seam, over the stiffness of its threads.
TEST_P(Sewing, SewingThreads_HoldTheHangingWeight) {
  Garment garment = fixtures::garment_of(fixtures::sheet(4, 2, 0.05), kForcesDensity, 2000, 1e-5);
  const Index half = garment.mesh.vertices.rows();
  const Index faces = garment.mesh.faces.rows();
  // Upright, the second panel below the first.
  Points upper = garment.mesh.vertices;
  upper.col(1) = upper.col(2);
  upper.col(2).setZero();
  garment.mesh.vertices.resize(2 * half, 3);
  garment.mesh.vertices.topRows(half) = upper;
  garment.mesh.vertices.bottomRows(half) = upper;
  garment.mesh.vertices.bottomRows(half).col(1).array() -= 0.12;
  garment.mesh.faces.conservativeResize(2 * faces, 3);
  garment.mesh.faces.bottomRows(faces) = garment.mesh.faces.topRows(faces).array() + int(half);
  Seam seam{"waist", {}, {}};
  std::vector<int> pins;
  for (int c = 0; c <= 4; ++c) {
    seam.a.push_back(c);
    seam.b.push_back(static_cast<int>(half) + 10 + c);
    pins.push_back(10 + c);
  }
  garment.seams = {seam};
  ClothOptions cloth_options;
  cloth_options.seam_stiffness = 200;
  const Cloth cloth = make_cloth(garment, pins, cloth_options);
  EXPECT_EQ(cloth.springs.size() - static_cast<std::size_t>(cloth.sewing_begin), 5U);
  XpbdOptions options;
  options.substeps = 300;
  options.precision = "double";
  options.velocity_damping = 8;
  ClothSolver solver(cloth, {}, options, device());
  const ClothState state = fixtures::settle(solver, {}, 120, 1e-6);
  double pull = 0;
  double weight = 0;
  double tension = 0;
  for (int c = 0; c <= 4; ++c) {
    pull += 200 * (state.positions(seam.a[c], 1) - state.positions(seam.b[c], 1));
    tension += solver.spring_forces()[static_cast<std::size_t>(cloth.sewing_begin + c)];
  }
  for (Index v = half; v < 2 * half; ++v) {
    weight += 9.81 * cloth.mass[static_cast<std::size_t>(v)];
  }
  EXPECT_NEAR(pull / weight, 1, 0.02);
  EXPECT_NEAR(tension / weight, 1, 0.02);
}

TEST_P(Tethers, HangingCloth_StaysWithinItsTethers) {
  const Garment garment = fixtures::garment_of(fixtures::sheet(10, 20, 0.02), 2, 10, 1e-6);
  const std::vector<int> top = fixtures::vertices_where(
      garment.mesh.vertices, [](double, double, double z) { return z < 1e-9; });
  for (const bool held : {false, true}) {
    ClothOptions cloth_options;
    cloth_options.tether_stretch = 1.05;
    Cloth cloth = make_cloth(garment, top, cloth_options);
    const std::vector<ClothTether> tethers = cloth.tethers;
    EXPECT_EQ(tethers.size(), 220U);
    if (!held) {
      cloth.tethers.clear();
    }
    ClothSolver solver(cloth, {}, {}, device());
    double worst = 0;
    for (int i = 0; i < 60; ++i) {
      solver.advance({});
      const Points x = solver.state().positions;
      for (const ClothTether& t : tethers) {
        worst = std::max(worst, (x.row(t.vertex) - x.row(t.anchor)).norm() / t.length);
      }
    }
    if (held) {
      EXPECT_LT(worst, 1.0001);
    } else {
      EXPECT_GT(worst, 1.2) << "cloth this soft hangs far down by itself";
    }
  }
}

TEST_P(NotFinite, NonFiniteState_IsNamedAndTheLastGoodStateKept) {
  const Cloth cloth = make_cloth(square(), {0});
  XpbdOptions options;
  options.drag = 1;
  for (const bool by_wind : {true, false}) {
    ClothSolver solver(cloth, {}, options, device());
    solver.advance({});
    solver.advance({});
    const ClothState good = solver.state();
    Control control;
    if (by_wind) {
      control.wind_field = Points::Zero(cloth.rest_positions.rows(), 3);
      control.wind_field(17, 1) = std::numeric_limits<double>::quiet_NaN();
    } else {
      control.pin_targets = cloth.rest_positions;
      control.pin_targets(0, 2) = std::numeric_limits<double>::quiet_NaN();
    }
    try {
      solver.advance(control);
      ADD_FAILURE() << "went on";
    } catch (const DataError& error) {
      EXPECT_NE(error.where.find("frame 3"), std::string::npos) << error.where;
      EXPECT_NE(error.where.find("vertex"), std::string::npos) << error.where;
    }
    EXPECT_EQ(solver.state().frame, good.frame);
    EXPECT_EQ(solver.state().positions, good.positions);
    // And goes on from there.
    EXPECT_NO_THROW(solver.advance({}));
    EXPECT_EQ(solver.state().frame, 3);
  }
}

TEST_P(NotFinite, TeleportingBodyOrBadWind_IsRefused) {
  const Cloth cloth = make_cloth(square());
  Mesh body;
  body.vertices.resize(3, 3);
  body.vertices << -1, -1, -1, 1, -1, -1, 0, -1, 1;
  body.faces.resize(1, 3);
  body.faces << 0, 2, 1;
  ClothSolver solver(cloth, body.faces, {}, device());
  Control control;
  control.body_start = control.body_end = body.vertices;
  EXPECT_NO_THROW(solver.advance(control));
  control.body_end.row(2) << 0, 2, 1;
  try {
    solver.advance(control);
    ADD_FAILURE() << "accepted";
  } catch (const DataError& error) {
    EXPECT_NE(std::string(error.what()).find("teleport"), std::string::npos) << error.what();
    EXPECT_NE(error.where.find("vertex 2"), std::string::npos) << error.where;
  }
  EXPECT_EQ(solver.state().frame, 1);
  control.body_end(2, 1) = std::numeric_limits<double>::infinity();
  EXPECT_THROW(solver.advance(control), DataError);
  Control windy;
  windy.wind.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(solver.advance(windy), LogicError);
  windy = {};
  windy.wind_field = Points::Zero(3, 3);
  EXPECT_THROW(solver.advance(windy), LogicError);
}

ATELIER_ON_EVERY_DEVICE(Air);
ATELIER_ON_EVERY_DEVICE(Pins);
ATELIER_ON_EVERY_DEVICE(Sewing);
ATELIER_ON_EVERY_DEVICE(Tethers);
ATELIER_ON_EVERY_DEVICE(NotFinite);

#ifndef ATELIER_HAS_CUDA
TEST(MissingDevice, CudaWithoutGpu_IsReported) {
  EXPECT_THROW(ClothSolver(make_cloth(square()), {}, {}, Device::Cuda), EnvironmentError);
}
#else
TEST(MissingDevice, CudaWithoutGpu_IsReported) {
  if (cuda_available()) {
    GTEST_SKIP() << "there is one";
  }
  EXPECT_THROW(ClothSolver(make_cloth(square()), {}, {}, Device::Cuda), EnvironmentError);
}
#endif

}  // namespace
}  // namespace atelier
