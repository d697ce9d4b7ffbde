// What a frame says of a pose: derivatives of every residual against finite differences.
#include "bodymodel/tracking/frame_energy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/tracking/solve_window.h"
#include "core/error.h"
#include "tests/bodymodel_tracking/posed_person.h"
#include "tests/support/finite_differences.h"

namespace atelier::fixtures {
namespace {

/// Variables at which limits are broken and nothing is at a kink.
Eigen::VectorXd crooked(const FittedPerson& person) {
  Eigen::VectorXd x = walking(person, 0.4);
  Random random{5};
  for (Index i = 0; i < x.size(); ++i) {
    x[i] += 0.11 * normal(random);
  }
  x[3 +
    3 * person.slots[static_cast<std::size_t>(find_joint(person.shaped.skeleton, "left_knee"))]] =
      -0.4;
  return x;
}

/// Gradient of the cost by finite differences, relative to the largest entry.
double gradient_error(const FittedPerson& person, const FrameTargets& targets,
                      const Eigen::VectorXd& x) {
  const FrameWeights weights;
  const Eigen::MatrixXd numeric = finite_difference_jacobian(
      [&](const Eigen::VectorXd& at) {
        return Eigen::VectorXd::Constant(1, frame_energy(person, targets, at, weights, false).cost);
      },
      x, 1e-6);
  const Eigen::VectorXd analytic = frame_energy(person, targets, x, weights).gradient;
  return (numeric.row(0).transpose() - analytic).cwiseAbs().maxCoeff() /
         numeric.cwiseAbs().maxCoeff();
}

TEST(FrameEnergy, KeypointLimitAndRestGradient_MatchesFiniteDifferences) {
  const FittedPerson& person = fitted_human();
  Random random{1};
  FrameTargets targets = keypoints_of(person, walking(person, 0.3), 0.02, random);
  targets.deviations[3] = 0;  // not seen
  EXPECT_LT(gradient_error(person, targets, crooked(person)), 1e-6);
  FrameTargets none;
  EXPECT_LT(gradient_error(person, none, crooked(person)), 1e-6);
}

TEST(FrameEnergy, SkinAndClothingGradient_MatchesFiniteDifferences) {
  const FittedPerson& person = fitted_human();
  const Eigen::VectorXd x = crooked(person);
  const Points vertices = skin_vertices(plain_human(), pose_of_variables(person, x));
  for (const bool cloth : {false, true}) {
    for (const double gap : {-0.02, 0.02}) {
      FrameTargets targets;
      for (int f = 0; f < plain_human().mesh.faces.rows(); f += 601) {
        SurfaceMatch match;
        match.barycentric = {0.2, 0.3, 0.5};
        Eigen::Vector3d at = Eigen::Vector3d::Zero();
        for (int c = 0; c < 3; ++c) {
          match.vertices[static_cast<std::size_t>(c)] = plain_human().mesh.faces(f, c);
          at += match.barycentric[c] * vertices.row(plain_human().mesh.faces(f, c)).transpose();
        }
        match.normal = Eigen::Vector3d(0.3, 0.5, -0.2 + 0.01 * (f % 50)).normalized();
        match.target = at + gap * match.normal;
        match.weight = 0.05;
        match.cloth = cloth;
        targets.matches.push_back(match);
      }
      EXPECT_LT(gradient_error(person, targets, x), 1e-5) << cloth << " " << gap;
    }
  }
}

TEST(FrameEnergy, Hessian_IsGaussNewton) {
  // Near a solution without outliers residuals vanish, and with them what Gauss-Newton leaves out.
  const FittedPerson& person = fitted_human();
  const Eigen::VectorXd x = walking(person, 0.3);
  Random random{1};
  FrameTargets targets = keypoints_of(person, x, 0, random);
  targets.prior = 0;
  const FrameWeights weights;
  const Eigen::MatrixXd numeric = finite_difference_jacobian(
      [&](const Eigen::VectorXd& at) {
        return frame_energy(person, targets, at, weights).gradient;
      },
      x, 1e-5);
  const Eigen::MatrixXd analytic = frame_energy(person, targets, x, weights).hessian;
  EXPECT_LT((numeric - analytic).cwiseAbs().maxCoeff() / numeric.cwiseAbs().maxCoeff(), 1e-5);
}

TEST(FrameEnergy, JointAndAccelerationJacobians_MatchFiniteDifferences) {
  const FittedPerson& person = fitted_human();
  const Eigen::VectorXd x = crooked(person);
  EXPECT_LT(
      jacobian_error(sought_joints_jacobian(person, x),
                     finite_difference_jacobian(
                         [&](const Eigen::VectorXd& at) { return sought_joints(person, at); }, x)),
      1e-6);
  std::array<Eigen::VectorXd, 3> three = {x, walking(person, 0.5), walking(person, 0.65)};
  const std::array<double, 3> times = {0.4, 0.5, 0.65};
  const Acceleration found = acceleration(person, three, times, {}, true);
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::MatrixXd numeric = finite_difference_jacobian(
        [&](const Eigen::VectorXd& at) {
          std::array<Eigen::VectorXd, 3> moved = three;
          moved[i] = at;
          return acceleration(person, moved, times, {}, false).residual;
        },
        three[i]);
    EXPECT_LT(jacobian_error(found.jacobian[i], numeric), 1e-5);
  }
}

TEST(FrameEnergy, UniformMotion_HasNoAcceleration) {
  const FittedPerson& person = fitted_human();
  std::array<Eigen::VectorXd, 3> three;
  for (std::size_t i = 0; i < 3; ++i) {
    three[i] = walking(person, 0);
    three[i].head<3>() += std::array<double, 3>{0.1, 0.2, 0.5}[i] * Eigen::Vector3d(1, 2, 3);
  }
  EXPECT_LT(acceleration(person, three, {0.1, 0.2, 0.5}, {}, false).residual.cwiseAbs().maxCoeff(),
            1e-9);
}

/// Of a whole window, by the variables of all its frames.
Eigen::VectorXd window_gradient(const FittedPerson& person, const TrackWindow& window,
                                const std::vector<Eigen::VectorXd>& x) {
  const Index size = x[0].size();
  Eigen::VectorXd gradient(size * static_cast<Index>(x.size()));
  for (std::size_t f = 0; f < x.size(); ++f) {
    gradient.segment(size * static_cast<Index>(f), size) =
        frame_energy(person, *window.targets[f], x[f], {}).gradient;
  }
  for (std::size_t f = 2; f < x.size(); ++f) {
    const Acceleration three =
        acceleration(person, {x[f - 2], x[f - 1], x[f]},
                     {window.times[f - 2], window.times[f - 1], window.times[f]}, {}, true);
    for (std::size_t i = 0; i < 3; ++i) {
      gradient.segment(size * static_cast<Index>(f - 2 + i), size) +=
          three.jacobian[i].transpose() * three.residual;
    }
  }
  return gradient;
}

// The solver has a window in blocks by limb, of which most pairs are left out: what it takes for
// the gradient must be the whole one. Points of skin lie between limbs too, and fingers are sought.
TEST(FrameEnergy, SolvedWindow_HasAVanishingGradient) {
  const FittedPerson person = fitted_person(plain_human(), body_25_names(), true);
  Random random{3};
  std::vector<FrameTargets> targets;
  TrackWindow window;
  for (int f = 0; f < 4; ++f) {
    const double time = 0.1 * f;
    const Eigen::VectorXd x = walking(person, time);
    FrameTargets one = keypoints_of(person, x, 0.01, random);
    const Points vertices = skin_vertices(plain_human(), pose_of_variables(person, x));
    const auto& faces = plain_human().mesh.faces;
    for (Index face = f; face < faces.rows(); face += 53) {
      SurfaceMatch match;
      match.vertices = {faces(face, 0), faces(face, 1), faces(face, 2)};
      match.barycentric = {0.2, 0.3, 0.5};
      match.normal = Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
      for (Index c = 0; c < 3; ++c) {
        match.target += match.barycentric[c] * vertices.row(faces(face, c)).transpose();
      }
      match.target += 0.003 * normal(random) * match.normal;
      match.weight = 53.0 / static_cast<double>(faces.rows());
      one.matches.push_back(match);
    }
    targets.push_back(std::move(one));
    window.times.push_back(time);
    window.start.push_back(walking(person, time + 0.05));
  }
  for (const FrameTargets& one : targets) {
    window.targets.push_back(&one);
  }
  const WindowSolution found = solve_window(person, window, {}, {}, 40);
  EXPECT_TRUE(found.converged);
  EXPECT_LT(window_gradient(person, window, found.x).norm(),
            2e-3 * window_gradient(person, window, window.start).norm());
}

TEST(FrameEnergy, WrongSizes_AreRefused) {
  const FittedPerson& person = fitted_human();
  FrameTargets targets;
  targets.keypoints = Points::Zero(3, 3);
  EXPECT_THROW(frame_energy(person, targets, walking(person, 0), {}), LogicError);
  EXPECT_THROW(pose_of_variables(person, Eigen::VectorXd::Zero(5)), LogicError);
  targets.keypoints = Points::Zero(300, 3);
  targets.deviations = Eigen::VectorXd::Ones(300);
  EXPECT_THROW(frame_energy(person, targets, walking(person, 0), {}), LogicError);
  FrameTargets none;
  EXPECT_THROW(solve_window(person, {{&none}, {0, 1}, {walking(person, 0)}}, {}, {}, 1),
               LogicError);
  EXPECT_THROW(
      solve_window(person, {{&none, &none}, {1, 1}, {walking(person, 0), walking(person, 0)}}, {},
                   {}, 1),
      LogicError);
}

}  // namespace
}  // namespace atelier::fixtures
