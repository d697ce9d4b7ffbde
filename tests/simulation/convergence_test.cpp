#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/simulation/cloth_fixtures.h"
#include "tests/simulation/implicit_euler.h"
#include "tests/support/devices.h"

namespace atelier {
namespace {

class Convergence : public fixtures::DeviceTest {};

constexpr double kSize = 0.3;

Cloth small_cloth() {
  const Garment garment =
      fixtures::garment_of(fixtures::sheet(5, 5, kSize / 5, 'a'), 0.2, 50, 1e-4);
  return make_cloth(garment, {0, 5});
}

XpbdOptions one_step(double h, int iterations) {
  XpbdOptions options;
  options.time_step = h;
  options.substeps = 1;
  options.iterations = iterations;
  options.precision = "double";
  return options;
}

// T16: solved to the end, a step of XPBD is a step of implicit Euler.
TEST_P(Convergence, ManyIterations_GiveImplicitEuler) {
  const Cloth cloth = small_cloth();
  const double h = 1.0 / 240;
  ClothSolver solver(cloth, {}, one_step(h, 10000), device());
  ClothState exact = rest_state(cloth);
  for (int i = 0; i < 12; ++i) {
    solver.advance({});
    exact = fixtures::newton_step(cloth, exact, h);
  }
  const double fallen = cloth.rest_positions.col(1).mean() - exact.positions.col(1).mean();
  EXPECT_GT(fallen, 0.003);
  const double error =
      (solver.state().positions - exact.positions).rowwise().norm().maxCoeff() / kSize;
  EXPECT_LT(error, 1e-4);
  RecordProperty("error_over_length", std::to_string(error));
}

// T16: what is left of C + a' lambda falls with every iteration of Gauss-Seidel.
TEST_P(Convergence, Residual_FallsWithIterations) {
  const Cloth cloth = small_cloth();
  const double h = 1.0 / 60;
  ClothSolver start(cloth, {}, one_step(h, 100), device());
  for (int i = 0; i < 10; ++i) {
    start.advance({});
  }
  double last = 1e30;
  double last_hinge = 1e30;
  double first = 0;
  double first_hinge = 0;
  for (int iterations = 1; iterations <= 256; ++iterations) {
    ClothSolver solver(cloth, {}, one_step(h, iterations), device());
    solver.set_state(start.state());
    const FrameReport report = solver.advance({});
    EXPECT_LT(report.spring_residual, last) << iterations;
    EXPECT_LT(report.hinge_residual, last_hinge) << iterations;
    last = report.spring_residual;
    last_hinge = report.hinge_residual;
    first = first == 0 ? last : first;
    first_hinge = first_hinge == 0 ? last_hinge : first_hinge;
  }
  EXPECT_LT(last, 1e-3 * first);
  EXPECT_LT(last_hinge, 1e-3 * first_hinge);
  RecordProperty("last_over_first", std::to_string(last / first));
  RecordProperty("last_over_first_hinge", std::to_string(last_hinge / first_hinge));
}

// T16, for warp, weft and shear of triangles: their residual is not that of springs.
TEST_P(Convergence, ResidualOfStrain_FallsWithIterations) {
  Garment garment = fixtures::garment_of(fixtures::sheet(5, 5, kSize / 5, 'a'), 0.2, 50, 1e-4);
  fixtures::use_flat_rest(garment);
  ClothOptions membrane;
  membrane.membrane = "strain";
  const Cloth cloth = make_cloth(garment, {0, 5}, membrane);
  const double h = 1.0 / 60;
  ClothSolver start(cloth, {}, one_step(h, 100), device());
  for (int i = 0; i < 10; ++i) {
    EXPECT_GT(start.advance({}).strain_residual, 0);
  }
  double last = 1e30;
  double first = 0;
  for (int iterations = 1; iterations <= 256; ++iterations) {
    ClothSolver solver(cloth, {}, one_step(h, iterations), device());
    solver.set_state(start.state());
    const FrameReport report = solver.advance({});
    EXPECT_LT(report.strain_residual, last) << iterations;
    EXPECT_EQ(report.spring_residual, 0) << "there are no springs";
    last = report.strain_residual;
    first = first == 0 ? last : first;
  }
  RecordProperty("first", std::to_string(first));
  RecordProperty("last_over_first", std::to_string(last / first));
  EXPECT_LT(last, 1e-3 * first);
}

// One triangle of which one corner is free, one projection of each constraint, by hand. The corner
// begins sheared; in units of the deformation F_v = (p2 - p0) / size it is `l` long, at `angle` to
// the warp. The projection of the weft changes l alone and ends with residual 0; that of the shear
// then moves it across by d, which lengthens it again, and is linear in the cosine, which is not.
TEST_P(Convergence, ResidualOfATriangle_MatchesHandComputedValue) {
  const double size = 0.1;
  Mesh triangle;
  triangle.vertices.resize(3, 3);
  triangle.vertices << 0, 0, 0, size, 0, 0, 0, 0, size;
  triangle.faces.resize(1, 3);
  triangle.faces << 0, 1, 2;
  Garment garment = fixtures::garment_of(triangle, 0.3, 80, 0);
  garment.material.shear = 20;
  fixtures::use_flat_rest(garment);
  ClothOptions membrane;
  membrane.membrane = "strain";
  const Cloth cloth = make_cloth(garment, {0, 1}, membrane);
  ASSERT_EQ(cloth.strains.size(), 1u);
  const double h = 0.004;
  const double start_length = 1.2;
  const double angle = 1.1;
  ClothState state = rest_state(cloth);
  state.positions.row(2) << size * start_length * std::cos(angle), 0,
      size * start_length * std::sin(angle);

  const double area = size * size / 2;
  const double weight = 1 / (cloth.mass[2] * size * size);  // of the corner, in units of F_v
  const double weft = 1 / (80 * area * h * h);              // compliances over h^2
  const double shear = 1 / (20 * area * h * h);
  const double weft_lambda = -(start_length - 1) / (weight + weft);
  const double l = start_length + weight * weft_lambda;
  const double slope = std::sin(angle) / l;  // of the cosine, across
  const double shear_lambda = -std::cos(angle) / (weight * slope * slope + shear);
  const double d = weight * slope * shear_lambda;
  const double end = std::hypot(l, d);
  const double cosine = (l * std::cos(angle) + d * std::sin(angle)) / end;
  const double in_weft = end - 1 + weft * weft_lambda;
  const double in_shear = cosine + shear * shear_lambda;
  const double expected = std::sqrt((in_weft * in_weft + in_shear * in_shear) / 3);
  ASSERT_GT(expected, 1e-3);

  Control control;
  control.gravity.setZero();
  for (const char* precision : {"double", "float"}) {
    XpbdOptions options = one_step(h, 1);
    options.precision = precision;
    ClothSolver solver(cloth, {}, options, device());
    solver.set_state(state);
    EXPECT_NEAR(solver.advance(control).strain_residual / expected, 1,
                precision[0] == 'd' ? 1e-12 : 1e-4);
  }
  RecordProperty("expected", std::to_string(expected));
}

TEST_P(Convergence, ClothWithoutStrainConstraints_HasNoStrainResidual) {
  ClothSolver solver(small_cloth(), {}, one_step(1.0 / 60, 2), device());
  const FrameReport report = solver.advance({});
  EXPECT_EQ(report.strain_residual, -1);
  EXPECT_GT(report.spring_residual, 0);
}

// T16: the order of the colours is not part of the answer.
TEST_P(Convergence, ConstraintOrder_DoesNotChangeTheAnswer) {
  Cloth cloth = small_cloth();
  Cloth other = cloth;
  std::reverse(other.springs.begin(), other.springs.end());
  std::reverse(other.hinges.begin(), other.hinges.end());
  rebuild_schedule(other, {.patches = 3});
  ASSERT_NE(cloth.schedule.order, other.schedule.order);
  Points x[2];
  for (int k = 0; k < 2; ++k) {
    ClothSolver solver(k == 0 ? cloth : other, {}, one_step(1.0 / 240, 5000), device());
    for (int i = 0; i < 8; ++i) {
      solver.advance({});
    }
    x[k] = solver.state().positions;
  }
  EXPECT_LT((x[0] - x[1]).rowwise().norm().maxCoeff() / kSize, 1e-4);
}

ATELIER_ON_EVERY_DEVICE(Convergence);

}  // namespace
}  // namespace atelier
