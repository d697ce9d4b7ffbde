#include "registration/principal_stretches.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <random>

#include <gtest/gtest.h>

namespace atelier {
namespace {

using Deformation = Eigen::Matrix<double, 3, 2>;

TEST(PrincipalStretches, RandomDeformations_AreTheSingularValues) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 1000; ++trial) {
    Deformation deformation;
    for (double& value : deformation.reshaped()) {
      value = normal(random);
    }
    Eigen::Matrix3d square = Eigen::Matrix3d::Zero();
    square.leftCols<2>() = deformation;
    const Eigen::Vector3d expected = Eigen::JacobiSVD<Eigen::Matrix3d>(square).singularValues();
    const Eigen::Vector2d found = principal_stretches(deformation);
    EXPECT_NEAR(found[0], expected[0], 1e-14 * expected[0]);
    EXPECT_NEAR(found[1], expected[1], 1e-14 * expected[0]);
  }
}

TEST(PrincipalStretches, ThinTriangle_KeepsTheDigitsOfTheSmallerOne) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  Deformation thin = Deformation::Zero();
  thin(0, 0) = 3;
  thin(1, 1) = 1e-9;
  const Eigen::Vector2d found = principal_stretches(turn * thin);
  EXPECT_NEAR(found[0], 3, 1e-14);
  EXPECT_NEAR(found[1], 1e-9, 1e-15);  // the turn itself rounds to 1e-16
  EXPECT_EQ(principal_stretches(Deformation::Zero()), Eigen::Vector2d(0, 0));
}

}  // namespace
}  // namespace atelier
