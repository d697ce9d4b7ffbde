#include <Eigen/Geometry>
#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/simulation/cloth_fixtures.h"
#include "tests/simulation/test_bodies.h"

namespace atelier {
namespace {

using fixtures::still;

TEST(Sphere, DroppedCloth_RestsOutside) {
  const Mesh ball = fixtures::sphere(0.2, 24, 48);
  Garment garment = fixtures::garment_of(fixtures::sheet(30, 30, 0.02), 0.2, 300, 1e-5);
  garment.mesh.vertices.col(0).array() -= 0.3;
  garment.mesh.vertices.col(2).array() -= 0.3;
  garment.mesh.vertices.col(1).array() += 0.22;
  const Cloth cloth = make_cloth(garment);
  for (Device device : fixtures::devices()) {
    XpbdOptions options;
    options.intersection_interval = 10;
    ClothSolver solver(cloth, ball.faces, options, device);
    FrameReport report;
    double deepest = 0;
    for (int i = 0; i < 90; ++i) {
      report = solver.advance(still(ball.vertices));
      deepest = std::max(deepest, report.penetration_depth);
      EXPECT_LE(report.inside, 0) << i;
    }
    EXPECT_LT(deepest, 1e-4);
    EXPECT_GT(report.body_contacts, 50);
    EXPECT_LT(report.strain_max, 0.2);
    const ClothState end = solver.state();
    EXPECT_GT(end.positions.col(1).maxCoeff(), 0.199) << "it stays on top";
  }
}

// T14: the square follows a turning sphere the more, the higher the friction.
TEST(Sphere, TurningSphere_DragsTheClothByFriction) {
  const Mesh ball = fixtures::sphere(0.2, 24, 48);
  // Angular momentum about y over the moment of inertia, of vertices that weigh alike [rad/s].
  const auto spin_of = [](const ClothState& state) {
    double spin = 0;
    double inertia = 0;
    for (Index v = 0; v < state.positions.rows(); ++v) {
      const Eigen::RowVector3d p = state.positions.row(v);
      const Eigen::RowVector3d u = state.velocities.row(v);
      spin += p.z() * u.x() - p.x() * u.z();
      inertia += p.x() * p.x() + p.z() * p.z();
    }
    return spin / inertia;
  };
  for (Device device : fixtures::devices()) {
    double last = -1;
    double last_slip = 1e30;
    for (double mu : {0.0, 0.05, 0.1, 0.3, 1.0}) {
      Garment garment = fixtures::garment_of(fixtures::sheet(20, 20, 0.02), 0.2, 300, 1e-5);
      garment.mesh.vertices.col(0).array() -= 0.2;
      garment.mesh.vertices.col(2).array() -= 0.2;
      garment.mesh.vertices.col(1).array() += 0.205;
      garment.material.friction = mu;
      const Cloth cloth = make_cloth(garment);
      ClothSolver solver(cloth, ball.faces, {}, device);
      double deepest = 0;
      const auto turned = [&](double angle) -> Points {
        return (ball.vertices *
                Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitY()).toRotationMatrix());
      };
      double angle = 0;
      double slip = 0;   // rad that the sphere turned further than the cloth
      double early = 0;  // rad/s of the cloth, a tenth of a second after the start
      for (int i = 0; i < 90; ++i) {
        Control control;
        control.body_start = turned(angle);
        angle += i < 30 ? 0 : 0.02;
        control.body_end = turned(angle);
        deepest = std::max(deepest, solver.advance(control).penetration_depth);
        slip += (i < 30 ? 0 : (1.2 - spin_of(solver.state())) / 60);
        early = i == 35 ? spin_of(solver.state()) : early;
      }
      const double end = spin_of(solver.state());
      EXPECT_GT(end, last - 0.01) << mu;
      last = end;
      EXPECT_LT(slip, last_slip) << "the higher the friction, the less it slips";
      last_slip = slip;
      // A tenth of a second after the sphere began to turn, 0.3 goes with it and 0.1 still slips.
      if (mu == 0.1) {
        EXPECT_LT(early, 0.6 * 1.2);
        EXPECT_GT(slip, 0.08);
      }
      if (mu == 0.3) {
        EXPECT_GT(early, 0.95 * 1.2);
        EXPECT_LT(slip, 0.04);
      }
      EXPECT_LT(deepest, 1e-4) << mu;
      // The sphere turns by 1.2 rad/s: the least friction slips on it, the most goes with it.
      if (mu == 0.0) {
        EXPECT_LT(std::abs(last), 0.1);
      }
      if (mu == 0.3) {
        EXPECT_GT(last, 0.9 * 1.2);
      }
    }
    EXPECT_GT(last, 0.9);  // 1.2 rad/s is the sphere's
  }
}

// T17: body speed x h of more than five thicknesses.
TEST(Sphere, SphereThrownAtAHangingSheet_DoesNotPass) {
  const Mesh ball = fixtures::sphere(0.05, 16, 32);
  Garment garment = fixtures::garment_of(fixtures::sheet(24, 24, 0.02), 0.2, 1000, 1e-5);
  garment.material.thickness = 1e-3;
  const std::vector<int> top = fixtures::vertices_where(
      garment.mesh.vertices, [](double, double, double z) { return z < 1e-9; });
  const Cloth cloth = make_cloth(garment, top);
  for (Device device : fixtures::devices()) {
    XpbdOptions options;
    ClothSolver solver(cloth, ball.faces, options, device);
    // The sheet lies flat in y = 0; the ball comes from below at 10 m/s: 17 mm a substep.
    double y = -0.5;
    double deepest = 0;
    for (int i = 0; i < 8; ++i) {
      Control control;
      control.gravity.setZero();
      control.body_start = ball.vertices.rowwise() + Eigen::RowVector3d(0.24, y, 0.24);
      y += 10.0 / 60;
      control.body_end = ball.vertices.rowwise() + Eigen::RowVector3d(0.24, y, 0.24);
      deepest = std::max(deepest, solver.advance(control).penetration_depth);
    }
    EXPECT_LT(deepest, 1e-4);
    const ClothState end = solver.state();
    EXPECT_GT(end.positions.col(1).maxCoeff(), y + 0.05 - 1e-3) << "the sheet is carried along";
  }
}

TEST(Sphere, StartOneCentimetreInside_IsResolvedGently) {
  const Mesh ball = fixtures::sphere(0.2, 24, 48);
  Garment garment = fixtures::garment_of(fixtures::sheet(20, 20, 0.01), 0.2, 300, 1e-5);
  garment.mesh.vertices.col(0).array() -= 0.1;
  garment.mesh.vertices.col(2).array() -= 0.1;
  for (Index v = 0; v < garment.mesh.vertices.rows(); ++v) {
    const Eigen::RowVector3d p(garment.mesh.vertices(v, 0), 0.3, garment.mesh.vertices(v, 2));
    garment.mesh.vertices.row(v) = p.normalized() * 0.19;
  }
  const Cloth cloth = make_cloth(garment);
  for (Device device : fixtures::devices()) {
    ClothSolver solver(cloth, ball.faces, {}, device);
    Control control = still(ball.vertices);
    FrameReport report;
    for (int i = 0; i < 30; ++i) {
      report = solver.advance(control);
      // Never faster than falling and being let go.
      EXPECT_LT(solver.state().velocities.rowwise().norm().maxCoeff(), 2.0);
    }
    EXPECT_LT(report.penetration_depth, 1e-4);
  }
}

// T15: what pushes cloth out of an overlap gives it no more energy than depenetration at its full
// speed has, 1/2 m v_max^2 (Small Steps, eq. 10). Without gravity all of it comes from there, as
// cloth rests in the shape in which it starts: flat hinges would give their own energy to motion,
// 4.9e-6 J out of a sphere at 0.05 m/s, where the bound is 3.6e-6 J.
TEST(Depenetration, ResolvedOverlap_GainsNoMoreEnergyThanItsSpeed) {
  for (const char* shape : {"cube", "sphere"}) {
    const bool is_cube = shape == std::string("cube");
    const Mesh body = is_cube ? fixtures::cube(0.2) : fixtures::sphere(0.2, 24, 48);
    Garment garment = fixtures::garment_of(fixtures::sheet(20, 20, 0.01), 0.2, 300, 1e-5);
    garment.mesh.vertices.col(0).array() -= 0.1;
    garment.mesh.vertices.col(2).array() -= 0.1;
    for (Index v = 0; v < garment.mesh.vertices.rows(); ++v) {
      const Eigen::RowVector3d p(garment.mesh.vertices(v, 0), is_cube ? 0.19 : 0.3,
                                 garment.mesh.vertices(v, 2));
      garment.mesh.vertices.row(v) = is_cube ? p : (p.normalized() * 0.19).eval();
    }
    ClothOptions as_it_starts;
    as_it_starts.rest_angles = "template";
    const Cloth cloth = make_cloth(garment, {}, as_it_starts);
    const double mass = std::accumulate(cloth.mass.begin(), cloth.mass.end(), 0.0);
    Control control = still(body.vertices);
    control.gravity.setZero();
    for (Device device : fixtures::devices()) {
      for (const double speed : {0.05, 0.2, 1.0, 5.0}) {
        XpbdOptions options;
        options.depenetration_speed = speed;
        ClothSolver solver(cloth, body.faces, options, device);
        double most = 0;
        FrameReport report;
        for (int i = 0; i < 30; ++i) {
          report = solver.advance(control);
          most = std::max(most, report.kinetic_energy);
        }
        EXPECT_LT(report.penetration_depth, 1e-4) << shape << " " << speed;
        EXPECT_LE(most, 0.5 * mass * speed * speed) << shape << " " << speed;
        RecordProperty(std::string(shape) + "_at_" + std::to_string(speed).substr(0, 4) + "_" +
                           device_name(device),
                       std::to_string(most / (0.5 * mass * speed * speed)));
      }
    }
  }
}

// As many triangles as a body may have.
TEST(Sphere, HundredThousandTriangles_KeepClothOutside) {
  const Mesh ball = fixtures::sphere(0.2, 160, 320);
  ASSERT_GT(ball.faces.rows(), 100000);
  Garment garment = fixtures::garment_of(fixtures::sheet(20, 20, 0.02), 0.2, 300, 1e-5);
  garment.mesh.vertices.col(0).array() -= 0.2;
  garment.mesh.vertices.col(2).array() -= 0.2;
  garment.mesh.vertices.col(1).array() += 0.205;
  const Cloth cloth = make_cloth(garment);
  for (Device device : fixtures::devices()) {
    XpbdOptions options;
    options.intersection_interval = 10;
    ClothSolver solver(cloth, ball.faces, options, device);
    FrameReport report;
    for (int i = 0; i < 30; ++i) {
      Control control;
      control.body_start = ball.vertices.rowwise() + Eigen::RowVector3d(0.002 * i, 0, 0);
      control.body_end = ball.vertices.rowwise() + Eigen::RowVector3d(0.002 * (i + 1), 0, 0);
      report = solver.advance(control);
      EXPECT_LT(report.penetration_depth, 1e-4) << i;
    }
    EXPECT_GT(report.body_contacts, 50);
    EXPECT_EQ(report.inside, 0);
    EXPECT_EQ(report.body_crossings, 0);
    // Vertices keep the thickness; between them edges sink towards the round by l^2 / 8 r.
    EXPECT_GT(report.body_gap, 0.3);
    EXPECT_EQ(report.self_gap, -1) << "no contact of the cloth with itself";
    EXPECT_GT(solver.state().positions.col(1).maxCoeff(), 0.199) << "it stays on top";
  }
}

// Deeper than the contact reach nothing is looked for in a frame: only the exact count knows.
TEST(Report, EveryVertexInsideTheBody_IsCountedHoweverDeep) {
  const Mesh ball = fixtures::sphere(0.2, 24, 48);
  Garment garment = fixtures::garment_of(fixtures::sheet(4, 4, 0.02), 0.2, 300, 1e-5);
  garment.mesh.vertices.col(0).array() -= 0.04;
  garment.mesh.vertices.col(2).array() -= 0.04;
  const Cloth cloth = make_cloth(garment);
  for (Device device : fixtures::devices()) {
    XpbdOptions options;
    options.intersection_interval = 2;
    ClothSolver solver(cloth, ball.faces, options, device);
    for (const double height : {0.0, 0.5}) {
      ClothState state = rest_state(cloth);
      state.positions.col(1).array() += height;
      solver.set_state(state);
      FrameReport report = solver.advance(still(ball.vertices));
      EXPECT_EQ(report.inside, -1) << "not in this frame";
      EXPECT_EQ(report.inside_depth, -1);
      EXPECT_EQ(report.body_crossings, -1);
      EXPECT_EQ(report.body_gap, -1);
      report = solver.advance(still(ball.vertices));
      EXPECT_EQ(report.penetrating, 0);
      EXPECT_EQ(report.inside, height > 0 ? 0 : 25);
      EXPECT_NEAR(report.inside_depth, height > 0 ? 0 : 0.193, 0.005);
      EXPECT_EQ(report.body_crossings, 0) << "nothing reaches the surface";
      EXPECT_EQ(report.body_gap, height > 0 ? 1 : 0);
    }
    // No body, nothing to be inside of.
    ClothSolver alone(cloth, {}, options, device);
    alone.advance({});
    const FrameReport report = alone.advance({});
    EXPECT_EQ(report.inside, -1);
    EXPECT_EQ(report.crossings, 0);
  }
}

// A large flat face away from the origin: its nearest point is rounded further than its box.
TEST(Cube, FlatTopWithBadRounding_CarriesClothFromBothSides) {
  for (const double top : {1.0, 1.29, 1.4, 1.49999, 1.5, 1.57}) {
    const Mesh cube = fixtures::cube(top);
    for (const double height : {0.05, -0.01}) {
      Garment garment = fixtures::garment_of(fixtures::sheet(10, 10, 0.03), 0.2, 300, 1e-5);
      garment.mesh.vertices.col(0).array() -= 0.15;
      garment.mesh.vertices.col(2).array() -= 0.15;
      garment.mesh.vertices.col(1).array() += top + height;
      const Cloth cloth = make_cloth(garment);
      for (const Device device : fixtures::devices()) {
        for (const char* precision : {"float", "double"}) {
          XpbdOptions options;
          options.precision = precision;
          ClothSolver solver(cloth, cube.faces, options, device);
          FrameReport report;
          for (int i = 0; i < 20; ++i) {
            report = solver.advance(still(cube.vertices));
          }
          EXPECT_LT(report.penetration_depth, 1e-4) << top << " " << height << " " << precision;
          EXPECT_GT(solver.state().positions.col(1).minCoeff(), top - 1e-4);
          EXPECT_LT(solver.state().positions.col(1).maxCoeff(), top + 0.02);
        }
      }
    }
  }
}

TEST(Control, BodyFasterThanAnyPerson_IsRefusedAtAnyFrameRate) {
  const Mesh ball = fixtures::sphere(0.2, 8, 16);
  const Cloth cloth = make_cloth(fixtures::garment_of(fixtures::sheet(4, 4, 0.05), 0.2, 100, 1e-5));
  for (const double fps : {30.0, 60.0, 240.0}) {
    XpbdOptions options;
    options.time_step = 1 / fps;
    ClothSolver solver(cloth, ball.faces, options);
    Control control = still(ball.vertices.rowwise() + Eigen::RowVector3d(0, -1, 0));
    const double most = std::min(1.0, 40 / fps);
    control.body_end.col(0).array() += 0.99 * most;
    solver.advance(control);
    control.body_start = control.body_end;
    control.body_end.col(0).array() += 1.01 * most;
    EXPECT_THROW(solver.advance(control), DataError) << fps;
  }
}

TEST(Control, ConflictingOptions_AreNamed) {
  XpbdOptions options;
  EXPECT_EQ(xpbd_conflict(options, Device::Cpu), "");
  options.vectors = "avx2";
  options.precision = "double";
  EXPECT_NE(xpbd_conflict(options, Device::Cpu), "");
  options = {};
  options.sweep = "jacobi";
  options.self_contact = true;
  EXPECT_EQ(xpbd_conflict(options, Device::Cpu), "");
  EXPECT_NE(xpbd_conflict(options, Device::Cuda), "");
}

TEST(Control, TeleportingBody_IsRefusedAndTheLastFrameKept) {
  const Mesh ball = fixtures::sphere(0.2, 8, 16);
  const Cloth cloth = make_cloth(fixtures::garment_of(fixtures::sheet(4, 4, 0.05), 0.2, 100, 1e-5));
  ClothSolver solver(cloth, ball.faces, {});
  Control control = still(ball.vertices.rowwise() + Eigen::RowVector3d(0, -1, 0));
  solver.advance(control);
  control.body_end.col(0).array() += 3;
  try {
    solver.advance(control);
    FAIL();
  } catch (const DataError& e) {
    EXPECT_NE(std::string(e.what()).find("teleport"), std::string::npos);
  }
  EXPECT_EQ(solver.state().frame, 1);
}

TEST(Control, NonFiniteAndIllSizedInputs_AreRefused) {
  const Mesh ball = fixtures::sphere(0.2, 8, 16);
  const Cloth cloth = make_cloth(fixtures::garment_of(fixtures::sheet(4, 4, 0.05), 0.2, 100, 1e-5));
  ClothSolver solver(cloth, ball.faces, {});
  Control control = still(ball.vertices);
  control.body_end(3, 1) = std::nan("");
  EXPECT_THROW(solver.advance(control), DataError);
  control = still(ball.vertices.topRows(5));
  EXPECT_THROW(solver.advance(control), LogicError);
  control = {};
  control.gravity.x() = INFINITY;
  EXPECT_THROW(solver.advance(control), LogicError);
  control = {};
  control.pin_targets = Points::Zero(3, 3);
  EXPECT_THROW(solver.advance(control), LogicError);
  control = {};
  control.wind_field = Points::Zero(3, 3);
  EXPECT_THROW(solver.advance(control), LogicError);
  ClothState state = rest_state(cloth);
  state.positions(7, 0) = std::nan("");
  try {
    solver.set_state(state);
    FAIL();
  } catch (const DataError& e) {
    EXPECT_NE(std::string(e.what()).find("vertex 7"), std::string::npos);
  }
  for (const double wild : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    state = rest_state(cloth);
    state.velocities(3, 1) = wild;
    EXPECT_THROW(solver.set_state(state), DataError) << wild;
  }
  state = rest_state(cloth);
  state.velocities.resize(2, 3);
  EXPECT_THROW(solver.set_state(state), LogicError);
}

}  // namespace
}  // namespace atelier
