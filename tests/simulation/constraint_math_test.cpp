#include "simulation/xpbd/constraint_math.h"

#include <gtest/gtest.h>

#include "tests/simulation/cloth_fixtures.h"
#include "tests/support/finite_differences.h"

namespace atelier {
namespace {

Vec3d at(const Eigen::VectorXd& x, int i) {
  return {x[3 * i], x[3 * i + 1], x[3 * i + 2]};
}

/// Two triangles at the edge along x, folded by `angle`, with heights `h` and shifted feet.
Eigen::VectorXd folded(double angle, double h, double size) {
  Eigen::VectorXd x(12);
  x << 0, 0, 0, 1, 0, 0, 0.3, h, 0, 0.6, -h * std::cos(angle), -h * std::sin(angle);
  return size * x;
}

TEST(Spring, Gradient_MatchesCentralDifferences) {
  for (double length : {1e-3, 0.01, 1.0}) {
    Eigen::VectorXd x(6);
    x << 0, 0, 0, 0.48 * length, 0.6 * length, 0.64 * length;
    const auto f = [&](const Eigen::VectorXd& y) {
      return Eigen::VectorXd::Constant(1, spring_value(at(y, 0), at(y, 1), 0.9 * length).c);
    };
    const SpringValue<double> s = spring_value(at(x, 0), at(x, 1), 0.9 * length);
    Eigen::MatrixXd gradient(1, 6);
    gradient << s.gradient.x, s.gradient.y, s.gradient.z, -s.gradient.x, -s.gradient.y,
        -s.gradient.z;
    const Eigen::MatrixXd numeric = fixtures::finite_difference_jacobian(f, x, 1e-6 * length);
    EXPECT_LT(fixtures::jacobian_error(gradient, numeric), 1e-6);
    const auto g = [&](int i) {
      return Vec3f{float(x[3 * i]), float(x[3 * i + 1]), float(x[3 * i + 2])};
    };
    const SpringValue<float> single = spring_value(g(0), g(1), float(0.9 * length));
    Eigen::MatrixXd gradient_float(1, 6);
    gradient_float << single.gradient.x, single.gradient.y, single.gradient.z, -single.gradient.x,
        -single.gradient.y, -single.gradient.z;
    EXPECT_LT((gradient_float - numeric).norm() / numeric.norm(), 1e-3) << "float";
    EXPECT_NEAR(single.c / s.c, 1, 1e-5) << "float";
  }
}

// Relative to the gradient itself: it grows as 1 / size, and a missing 1/|n| would show up here.
TEST(Hinge, Gradient_MatchesCentralDifferencesAtEveryAngle) {
  double worst = 0;
  double worst_float = 0;
  for (double size : {0.002, 0.01, 0.3}) {
    for (double h : {0.02, 0.5, 2.0}) {
      for (double angle : {0.0, 1e-4, 0.3, 1.5, 3.0, 3.141, -1e-4, -0.7, -3.0, -3.141}) {
        const Eigen::VectorXd x = folded(angle, h, size);
        const auto f = [&](const Eigen::VectorXd& y) {
          const double a = hinge_value(at(y, 0), at(y, 1), at(y, 2), at(y, 3)).angle;
          return Eigen::VectorXd::Constant(1, angle_difference(a, angle));
        };
        const HingeValue<double> hinge = hinge_value(at(x, 0), at(x, 1), at(x, 2), at(x, 3));
        ASSERT_TRUE(hinge.valid);
        EXPECT_NEAR(angle_difference(hinge.angle, angle), 0, 1e-9);
        Eigen::RowVectorXd gradient(12);
        for (int i = 0; i < 4; ++i) {
          gradient.segment<3>(3 * i) << hinge.gradient[i].x, hinge.gradient[i].y,
              hinge.gradient[i].z;
        }
        Eigen::RowVectorXd numeric(12);
        for (int i = 0; i < 12; ++i) {
          const double step = 1e-5 * size * std::min(1.0, h);
          Eigen::VectorXd plus = x;
          Eigen::VectorXd minus = x;
          plus[i] += step;
          minus[i] -= step;
          numeric[i] = (f(plus)[0] - f(minus)[0]) / (2 * step);
        }
        worst = std::max(worst, (gradient - numeric).norm() / numeric.norm());
        const auto g = [&](int i) {
          return Vec3f{float(x[3 * i]), float(x[3 * i + 1]), float(x[3 * i + 2])};
        };
        const HingeValue<float> single = hinge_value(g(0), g(1), g(2), g(3));
        Eigen::RowVectorXd gradient_float(12);
        for (int i = 0; i < 4; ++i) {
          gradient_float.segment<3>(3 * i) << single.gradient[i].x, single.gradient[i].y,
              single.gradient[i].z;
        }
        worst_float = std::max(worst_float, (gradient_float - numeric).norm() / numeric.norm());
      }
    }
  }
  EXPECT_LT(worst, 1e-6);
  EXPECT_LT(worst_float, 1e-3);
  RecordProperty("worst_double", std::to_string(worst));
  RecordProperty("worst_float", std::to_string(worst_float));
}

// T1 on every device: of a cloth that is one hinge, a solver's first iteration moves the vertices,
// which weigh alike, along the gradient.
TEST(Hinge, Solver_MovesVerticesAlongTheGradient) {
  for (const Device device : fixtures::devices()) {
    for (const char* precision : {"float", "double"}) {
      for (const double h : {0.1, 0.5, 2.0}) {
        for (const double angle : {0.3, 1.5, 3.0, -0.7, -3.0}) {
          const Eigen::VectorXd x = folded(angle, h, 0.1);
          Mesh mesh;
          mesh.vertices.resize(4, 3);
          for (int i = 0; i < 4; ++i) {
            mesh.vertices.row(i) = x.segment<3>(3 * i).transpose();
          }
          mesh.faces.resize(2, 3);
          mesh.faces << 0, 1, 2, 1, 0, 3;
          Cloth cloth = make_cloth(fixtures::garment_of(mesh, 0.2, 100, 1e-4));
          ASSERT_EQ(cloth.hinges.size(), 1U);
          cloth.springs.clear();
          cloth.fibre_count = cloth.sewing_begin = 0;
          cloth.mass.assign(4, 1e-3);
          rebuild_schedule(cloth);
          XpbdOptions options;
          options.substeps = options.iterations = 1;
          options.precision = precision;
          ClothSolver solver(cloth, {}, options, device);
          Control control;
          control.gravity.setZero();
          solver.advance(control);
          Eigen::VectorXd moved(12);
          Eigen::VectorXd numeric(12);
          for (int i = 0; i < 12; ++i) {
            moved[i] = solver.state().positions(i / 3, i % 3) - x[i];
            const double step = 1e-6 * std::min(1.0, h);
            Eigen::VectorXd plus = x;
            Eigen::VectorXd minus = x;
            plus[i] += step;
            minus[i] -= step;
            const auto at_angle = [](const Eigen::VectorXd& y) {
              return hinge_value(at(y, 0), at(y, 1), at(y, 2), at(y, 3)).angle;
            };
            numeric[i] = angle_difference(at_angle(plus), at_angle(minus)) / (2 * step);
          }
          ASSERT_GT(moved.norm(), 1e-5) << angle << " " << h;
          EXPECT_LT((moved.normalized() + std::copysign(1, angle) * numeric.normalized()).norm(),
                    precision == std::string("double") ? 1e-6 : 1e-3)
              << precision << " on " << device_name(device) << ", " << angle << ", height " << h;
        }
      }
    }
  }
}

TEST(Hinge, ZeroAreaTriangle_HasNoNormal) {
  EXPECT_FALSE(hinge_value<double>({0, 0, 0}, {1, 0, 0}, {0.5, 0, 0}, {0, 1, 0}).valid);
  EXPECT_FALSE(hinge_value<float>({0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}).valid);
  EXPECT_TRUE(hinge_value<float>({0, 0, 0}, {1e-4f, 0, 0}, {0, 1e-4f, 0}, {0, -1e-4f, 0}).valid);
}

TEST(Hinge, FoldingAwayFromTheNormals_IsPositive) {
  // Normals +z; the far corner bends down.
  const HingeValue<double> hinge =
      hinge_value<double>({0, 0, 0}, {1, 0, 0}, {0.5, 1, 0}, {0.5, -1, -0.5});
  EXPECT_GT(hinge.angle, 0);
}

TEST(AngleOf, FloatPolynomial_IsAccurateToFewUlp) {
  for (int i = -3141; i <= 3141; ++i) {
    const double angle = i * 1e-3;
    EXPECT_NEAR(angle_of(float(std::sin(angle)), float(std::cos(angle))), angle, 5e-7);
  }
  // Relative near zero, where flat cloth lives.
  EXPECT_NEAR(angle_of(1e-6f, 1.0f) / 1e-6, 1.0, 1e-5);
  EXPECT_EQ(angle_of(0.0f, 0.0f), 0.0f);
}

TEST(Strain, WarpStretch_IsProjectedAlongTheWarpOnly) {
  StrainRest<double> rest{0, 1, 1, 0, 1e-9, 1e30, 1e30};  // u = e2 (y), v = e1 (x)
  Vec4<double> v[3] = {{0, 0, 0, 1}, {1.5, 0, 0, 1}, {0, 1.5, 0, 1}};
  const Vec3<double> start[3] = {};
  double lambda[3] = {0, 0, 0};
  project_strain(v, start, rest, 1.0, 0.0, lambda);
  EXPECT_NEAR(v[2].y - v[0].y, 1.0, 1e-6);
  EXPECT_NEAR(v[1].x - v[0].x, 1.5, 1e-6);
}

}  // namespace
}  // namespace atelier
