#include "bodymodel/rotation.h"

#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/random.h"
#include "tests/support/finite_differences.h"

namespace atelier {
namespace {

Eigen::Vector3d random_vector(Random& random, double scale) {
  return {scale * normal(random), scale * normal(random), scale * normal(random)};
}

TEST(Rotation, Matrix_IsRightHandedAboutItsAxis) {
  const Eigen::Matrix3d quarter = rotation_matrix({0, 0, std::numbers::pi / 2});
  EXPECT_NEAR((quarter * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 0, 1e-15);
}

TEST(Rotation, Matrix_IsOrthonormalAtAnyAngle) {
  Random random{1};
  for (const double scale : {1e-12, 1e-6, 1e-3, 1e-2, 1.0, 10.0}) {
    const Eigen::Matrix3d r = rotation_matrix(random_vector(random, scale));
    EXPECT_LT((r * r.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-14) << scale;
    EXPECT_NEAR(r.determinant(), 1, 1e-14) << scale;
  }
}

TEST(Rotation, SmallAngleSeries_MeetsTheFormula) {
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, -3).normalized();
  const Eigen::Matrix3d below = rotation_matrix(0.999999e-3 * axis);
  const Eigen::Matrix3d above = rotation_matrix(1.000001e-3 * axis);
  EXPECT_LT((rotation_matrix(2e-9 * axis) * below - above).norm(), 1e-15);
  EXPECT_LT((left_jacobian(0.999999e-3 * axis) - left_jacobian(1.000001e-3 * axis)).norm(), 1e-8);
}

TEST(Rotation, Derivatives_MatchFiniteDifferences) {
  Random random{2};
  for (const double scale : {0.0, 1e-5, 1e-2, 0.5, 2.0}) {
    const Eigen::Vector3d r = random_vector(random, scale);
    const Eigen::MatrixXd numeric = fixtures::finite_difference_jacobian(
        [](const Eigen::VectorXd& x) {
          const Eigen::Matrix3d m = rotation_matrix(x);
          return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(m.data(), 9));
        },
        r);
    const std::array<Eigen::Matrix3d, 3> analytic = rotation_matrix_jacobian(r);
    for (int i = 0; i < 3; ++i) {
      EXPECT_LT((Eigen::Map<const Eigen::VectorXd>(analytic[i].data(), 9) - numeric.col(i))
                    .cwiseAbs()
                    .maxCoeff(),
                1e-9);
    }
    const Eigen::MatrixXd numeric_quaternion = fixtures::finite_difference_jacobian(
        [](const Eigen::VectorXd& x) { return Eigen::VectorXd(quaternion_of(x)); }, r);
    EXPECT_LT(fixtures::jacobian_error(quaternion_jacobian(r), numeric_quaternion), 1e-9);
  }
}

TEST(Rotation, Logarithm_InvertsTheExponential) {
  Random random{3};
  for (const double angle :
       {0.0, 1e-9, 1e-4, 1.0, 3.0, std::numbers::pi - 1e-6, std::numbers::pi - 1e-12}) {
    const Eigen::Vector3d r = angle * random_vector(random, 1).normalized();
    EXPECT_LT((rotation_matrix(rotation_vector(rotation_matrix(r))) - rotation_matrix(r)).norm(),
              1e-12);
    EXPECT_NEAR(rotation_vector(rotation_matrix(r)).norm(), angle, 1e-9);
  }
}

TEST(Rotation, QuaternionAndMatrix_Agree) {
  Random random{4};
  const Eigen::Vector3d r = random_vector(random, 0.8);
  EXPECT_LT((matrix_of_quaternion(quaternion_of(r)) - rotation_matrix(r)).norm(), 1e-14);
  EXPECT_LT((quaternion_of_matrix(rotation_matrix(r)) - quaternion_of(r)).norm(), 1e-14);
}

TEST(Rotation, RotationBetween_MapsOneDirectionToTheOther) {
  Random random{5};
  const Eigen::Vector3d a = random_vector(random, 2);
  const Eigen::Vector3d b = random_vector(random, 3);
  EXPECT_LT((rotation_between(a, b) * a.normalized() - b.normalized()).norm(), 1e-14);
  EXPECT_LT((rotation_between(a, a) - Eigen::Matrix3d::Identity()).norm(), 1e-14);
  EXPECT_LT((rotation_between(a, -a) * a + a).norm(), 1e-12);
}

TEST(Rotation, NearestEquivalent_KeepsTheRotationAndStaysNear) {
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 1, 0).normalized();
  const Eigen::Vector3d r = (std::numbers::pi - 0.1) * -axis;
  const Eigen::Vector3d moved = nearest_equivalent(r, (std::numbers::pi - 0.1) * axis);
  EXPECT_NEAR((moved - (std::numbers::pi + 0.1) * axis).norm(), 0, 1e-12);
  EXPECT_LT((rotation_matrix(moved) - rotation_matrix(r)).norm(), 1e-13);
  EXPECT_NEAR(
      (nearest_equivalent(Eigen::Vector3d::Zero(), 6.2 * axis) - 2 * std::numbers::pi * axis)
          .norm(),
      0, 1e-12);
}

}  // namespace
}  // namespace atelier
