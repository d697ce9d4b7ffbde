#include "simulation/relax_gravity.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "simulation/contact/contact_distance.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

/// A square of 0.4 m of soft cloth, in the plane z = 0, hanging from its upper edge.
Garment hanging_cloth(std::vector<int>& pins) {
  Garment garment;
  garment.mesh = fixtures::grid(8, 8);
  for (Index v = 0; v < garment.mesh.vertices.rows(); ++v) {
    const Eigen::RowVector3d p = garment.mesh.vertices.row(v);
    garment.mesh.vertices.row(v) << 0.4 * p.x(), 1 - 0.4 * p.z(), 0;
    if (p.z() == 0) {
      pins.push_back(static_cast<int>(v));
    }
  }
  garment.material.density = 0.3;
  garment.material.stretch_warp = garment.material.stretch_weft = 60;
  garment.material.bending = 1e-4;
  return garment;
}

Points hang(const Garment& garment, const std::vector<int>& pins, const Points& from) {
  ClothOptions how;
  how.rest_angles = "template";
  const Cloth cloth = make_cloth(garment, pins, how);
  SolverOptions options;
  options.velocity_damping = 4;
  const std::unique_ptr<Solver> solver = create_solver({cloth, {}}, options);
  ClothState state = rest_state(cloth);
  state.positions = from;
  solver->set_state(state);
  Control control;
  control.pin_targets = from;
  for (int frame = 0; frame < 120; ++frame) {
    solver->step(control);
  }
  return solver->state().positions;
}

TEST(RelaxGravity, HangingCapture_HangsTheSame) {
  std::vector<int> pins;
  Garment garment = hanging_cloth(pins);
  // What a capture sees: stretched by its own weight.
  const Points seen = hang(garment, pins, garment.mesh.vertices);
  Garment captured = garment;
  captured.mesh.vertices = seen;
  const double sagged = (seen - garment.mesh.vertices).rowwise().norm().maxCoeff();
  ASSERT_GT(sagged, 0.004);
  // Simulated as it is, it sags once more.
  const double again = (hang(captured, pins, seen) - seen).rowwise().norm().mean();
  ASSERT_GT(again, 0.002);
  const RelaxedGarment relaxed = relax_gravity({captured, pins, Points(0, 3), Triangles(0, 3)});
  EXPECT_TRUE(relaxed.converged);
  EXPECT_LT(relaxed.mean_error, 0.0005);
  const double mean = (hang(relaxed.garment, pins, seen) - seen).rowwise().norm().mean();
  EXPECT_LT(mean, 0.002);
  // Nearly what it was cut as.
  EXPECT_LT((relaxed.garment.mesh.vertices - garment.mesh.vertices).rowwise().norm().mean(),
            0.5 * sagged);
}

/// A coarse sheet of soft cloth that came to rest over a ball, as clothes lie on shoulders.
Garment draped_cloth(const Mesh& ball) {
  Garment garment;
  garment.mesh = fixtures::grid(9, 9);
  for (Index v = 0; v < garment.mesh.vertices.rows(); ++v) {
    const Eigen::RowVector3d p = garment.mesh.vertices.row(v);
    garment.mesh.vertices.row(v) << 0.7 * (p.x() - 0.5), 0.28, 0.7 * (p.z() - 0.5);
  }
  garment.material.density = 0.3;
  garment.material.stretch_warp = garment.material.stretch_weft = 200;
  garment.material.bending = 1e-4;
  SolverOptions options = relaxing_solver();
  options.thickness = contact_distance(garment);
  options.velocity_damping = 4;
  const std::unique_ptr<Solver> solver = create_solver({make_cloth(garment), ball.faces}, options);
  Control control;
  control.body_start = control.body_end = ball.vertices;
  for (int frame = 0; frame < 180; ++frame) {
    solver->step(control);
  }
  garment.mesh.vertices = solver->state().positions;
  return garment;
}

TEST(RelaxGravity, DrapedCapture_LiesTheSame) {
  Mesh ball = fixtures::sphere(2);
  ball.vertices *= 0.25;
  const Garment captured = draped_cloth(ball);
  const double lowest = captured.mesh.vertices.col(1).minCoeff();
  ASSERT_LT(lowest, 0.1);  // its corners hang down
  RelaxGravityOptions few;
  few.rounds = 4;
  const RelaxedGarment relaxed =
      relax_gravity({captured, {}, ball.vertices, ball.faces}, {}, relaxing_solver(), few);
  EXPECT_LT(relaxed.mean_error, 0.002);
  // Kept from the body by its material's thickness alone, it begins in the air.
  SolverOptions thin = relaxing_solver();
  thin.thickness = captured.material.thickness;
  RelaxGravityOptions once;
  once.rounds = 1;
  EXPECT_GT(
      relax_gravity({captured, {}, ball.vertices, ball.faces}, {}, thin, once).mean_error,
      1.5 * relax_gravity({captured, {}, ball.vertices, ball.faces}, {}, relaxing_solver(), once)
                .mean_error);
}

TEST(RelaxGravity, Progress_IsReportedEveryRoundAndCanStop) {
  Garment garment;
  garment.mesh = fixtures::grid(4, 4);
  std::vector<int> told;
  double last = 0;
  RelaxGravityOptions options;
  options.seconds = 0.1;
  const RelaxedGarment relaxed =
      relax_gravity({garment, {0, 1, 2, 3}, Points(0, 3), Triangles(0, 3)}, {}, relaxing_solver(),
                    options, Device::Cpu, [&](int rounds, double error) {
                      told.push_back(rounds);
                      last = error;
                      return rounds < 3;
                    });
  EXPECT_EQ(told, (std::vector<int>{1, 2, 3}));
  EXPECT_EQ(relaxed.rounds, 3);
  EXPECT_EQ(relaxed.mean_error, last);
}

TEST(RelaxGravity, OptionsOutOfRange_AreRefused) {
  std::vector<int> pins;
  const Garment garment = hanging_cloth(pins);
  RelaxGravityOptions none;
  none.rounds = 0;
  EXPECT_THROW(relax_gravity({garment, pins, Points(0, 3), Triangles(0, 3)}, {}, {}, none),
               LogicError);
  RelaxGravityOptions far;
  far.step = 1.5;
  EXPECT_THROW(relax_gravity({garment, pins, Points(0, 3), Triangles(0, 3)}, {}, {}, far),
               LogicError);
}

}  // namespace
}  // namespace atelier
