#include "capture/calibration/bundle.h"

#include <cmath>
#include <limits>
#include <memory>

#include <ceres/ceres.h>
#include <glog/logging.h>

#include "core/error.h"

namespace atelier {
namespace {

using Vector2 = Eigen::Vector2d;
using Vector3 = Eigen::Vector3d;

Vector3 board_point(const Bundle& bundle, int point) {
  return {bundle.points(point, 0), bundle.points(point, 1), 0};
}

/// One corner: projection less measurement.
class ReprojectionCost final : public ceres::SizedCostFunction<2, 12, 6, 6> {
 public:
  ReprojectionCost(Distortion model, Vector3 point, Vector2 pixel)
      : model_(model), point_(std::move(point)), pixel_(std::move(pixel)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const LensNumbers lens(parameters[0]);
    const RigidNumbers camera_from_world(parameters[1]);
    const RigidNumbers world_from_board(parameters[2]);
    const Vector3 in_world = moved(world_from_board, point_);
    const Vector3 in_camera = moved(camera_from_world, in_world);
    if (in_camera.z() < 1e-6) {
      return false;  // the solver takes a shorter step
    }
    const auto pixel = lens_pixel(model_, lens, in_camera);
    if (!pixel) {
      return false;
    }
    Eigen::Map<Vector2> error(residuals);
    error = *pixel - pixel_;
    if (jacobians == nullptr) {
      return true;
    }
    const LensJacobian projection = lens_jacobian(model_, lens, in_camera);
    if (jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 12, Eigen::RowMajor>> by_lens(jacobians[0]);
      by_lens = projection.by_lens;
    }
    if (jacobians[1] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> by_camera(jacobians[1]);
      by_camera = projection.by_point * moved_jacobian(camera_from_world, in_world);
    }
    if (jacobians[2] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> by_board(jacobians[2]);
      by_board = projection.by_point * rotation_of(camera_from_world) *
                 moved_jacobian(world_from_board, point_);
    }
    return true;
  }

 private:
  Distortion model_;
  Vector3 point_;
  Vector2 pixel_;
};

/// Keeps the principal point near a place with a given deviation.
class CentrePrior final : public ceres::SizedCostFunction<2, 12> {
 public:
  CentrePrior(Vector2 centre, double deviation)
      : centre_(std::move(centre)), weight_(1 / deviation) {}
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    residuals[0] = weight_ * (parameters[0][2] - centre_.x());
    residuals[1] = weight_ * (parameters[0][3] - centre_.y());
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      std::fill_n(jacobians[0], 24, 0.0);
      jacobians[0][2] = weight_;
      jacobians[0][12 + 3] = weight_;
    }
    return true;
  }

 private:
  Vector2 centre_;
  double weight_;
};

/// The problem over the numbers of `bundle`, which stay where they are.
struct Posed {
  ceres::Problem problem;
  std::vector<bool> seen_eye;
  std::vector<bool> seen_board;
};

void check(const Bundle& bundle) {
  bool fixed = bundle.fixed_boards;
  for (const Bundle::Eye& eye : bundle.eyes) {
    fixed = fixed || eye.fixed_pose;
  }
  ATELIER_CHECK(fixed, "a bundle in which no pose is fixed");
  for (const Bundle::Sight& sight : bundle.sights) {
    ATELIER_CHECK(sight.eye >= 0 && sight.eye < static_cast<int>(bundle.eyes.size()) &&
                      sight.board >= 0 &&
                      sight.board < static_cast<int>(bundle.world_from_board.size()) &&
                      sight.point >= 0 && sight.point < bundle.points.rows(),
                  "a sight of what is not there");
  }
}

std::unique_ptr<Posed> pose(Bundle& bundle, const BundleOptions& options) {
  check(bundle);
  auto posed = std::make_unique<Posed>();
  posed->seen_eye.assign(bundle.eyes.size(), false);
  posed->seen_board.assign(bundle.world_from_board.size(), false);
  for (const Bundle::Sight& sight : bundle.sights) {
    const auto e = static_cast<std::size_t>(sight.eye);
    const auto b = static_cast<std::size_t>(sight.board);
    posed->seen_eye[e] = true;
    posed->seen_board[b] = true;
    Bundle::Eye& eye = bundle.eyes[e];
    // The problem owns cost and loss; a loss of its own for each keeps ownership simple.
    posed->problem.AddResidualBlock(
        new ReprojectionCost(eye.model, board_point(bundle, sight.point), sight.pixel),
        options.loss > 0 ? new ceres::CauchyLoss(options.loss) : nullptr, eye.lens.data(),
        eye.camera_from_world.data(), bundle.world_from_board[b].data());
  }
  for (std::size_t b = 0; b < bundle.world_from_board.size() && bundle.fixed_boards; ++b) {
    if (posed->seen_board[b]) {
      posed->problem.SetParameterBlockConstant(bundle.world_from_board[b].data());
    }
  }
  for (std::size_t e = 0; e < bundle.eyes.size(); ++e) {
    Bundle::Eye& eye = bundle.eyes[e];
    if (!posed->seen_eye[e]) {
      continue;
    }
    if (eye.centre_prior > 0 && (eye.free[2] || eye.free[3])) {
      posed->problem.AddResidualBlock(new CentrePrior(eye.centre, eye.centre_prior), nullptr,
                                      eye.lens.data());
    }
    std::vector<int> constant;
    for (int i = 0; i < 12; ++i) {
      if (!eye.free[static_cast<std::size_t>(i)]) {
        constant.push_back(i);
      }
    }
    if (constant.size() == 12) {
      posed->problem.SetParameterBlockConstant(eye.lens.data());
    } else if (!constant.empty()) {
      posed->problem.SetManifold(eye.lens.data(), new ceres::SubsetManifold(12, constant));
    }
    if (eye.fixed_pose) {
      posed->problem.SetParameterBlockConstant(eye.camera_from_world.data());
    }
  }
  return posed;
}

}  // namespace

BundleSolution solve_bundle(const Bundle& bundle, const BundleOptions& options) {
  BundleSolution solution;
  solution.bundle = bundle;
  const std::unique_ptr<Posed> posed = pose(solution.bundle, options);
  FLAGS_minloglevel = google::GLOG_ERROR;  // steps that fail and are taken shorter are no news
  ceres::Solver::Options solver;
  solver.num_threads = 1;  // the same bits everywhere
  solver.max_num_iterations = options.iterations;
  solver.linear_solver_type = ceres::DENSE_SCHUR;
  solver.function_tolerance = 1e-10;
  solver.parameter_tolerance = 1e-10;
  solver.gradient_tolerance = 1e-12;
  solver.logging_type = ceres::SILENT;
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (std::size_t b = 0; b < solution.bundle.world_from_board.size(); ++b) {
    if (posed->seen_board[b]) {
      ordering->AddElementToGroup(solution.bundle.world_from_board[b].data(), 0);
    }
  }
  for (std::size_t e = 0; e < solution.bundle.eyes.size(); ++e) {
    if (posed->seen_eye[e]) {
      ordering->AddElementToGroup(solution.bundle.eyes[e].lens.data(), 1);
      ordering->AddElementToGroup(solution.bundle.eyes[e].camera_from_world.data(), 1);
    }
  }
  solver.linear_solver_ordering = ordering;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &posed->problem, &summary);
  solution.converged = summary.termination_type == ceres::CONVERGENCE;
  solution.iterations = static_cast<int>(summary.iterations.size());
  return solution;
}

Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor> reprojection_errors(
    const Bundle& bundle) {
  Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor> errors(
      static_cast<Index>(bundle.sights.size()), 2);
  for (std::size_t i = 0; i < bundle.sights.size(); ++i) {
    const Bundle::Sight& sight = bundle.sights[i];
    const Bundle::Eye& eye = bundle.eyes[static_cast<std::size_t>(sight.eye)];
    const Vector3 in_world = moved(bundle.world_from_board[static_cast<std::size_t>(sight.board)],
                                   board_point(bundle, sight.point));
    const auto pixel = lens_pixel(eye.model, eye.lens, moved(eye.camera_from_world, in_world));
    errors.row(static_cast<Index>(i)) =
        pixel ? Vector2(*pixel - sight.pixel)
              : Vector2::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  return errors;
}

BundleDeviations bundle_deviations(const Bundle& bundle, double sigma,
                                   const BundleOptions& options) {
  Bundle copy = bundle;
  const std::unique_ptr<Posed> posed = pose(copy, options);
  BundleDeviations deviations;
  deviations.lens.assign(copy.eyes.size(), LensNumbers::Zero());
  deviations.pose_covariance.assign(copy.eyes.size(), Eigen::Matrix<double, 6, 6>::Zero());
  ceres::Covariance::Options covariance_options;
  covariance_options.algorithm_type = ceres::SPARSE_QR;
  covariance_options.num_threads = 1;
  ceres::Covariance covariance(covariance_options);
  std::vector<std::pair<const double*, const double*>> blocks;
  for (std::size_t e = 0; e < copy.eyes.size(); ++e) {
    if (posed->seen_eye[e]) {
      blocks.emplace_back(copy.eyes[e].lens.data(), copy.eyes[e].lens.data());
      blocks.emplace_back(copy.eyes[e].camera_from_world.data(),
                          copy.eyes[e].camera_from_world.data());
    }
  }
  deviations.full_rank = covariance.Compute(blocks, &posed->problem);
  if (!deviations.full_rank) {
    return deviations;
  }
  for (std::size_t e = 0; e < copy.eyes.size(); ++e) {
    if (!posed->seen_eye[e]) {
      continue;
    }
    Eigen::Matrix<double, 12, 12, Eigen::RowMajor> lens;
    Eigen::Matrix<double, 6, 6, Eigen::RowMajor> rigid;
    covariance.GetCovarianceBlock(copy.eyes[e].lens.data(), copy.eyes[e].lens.data(), lens.data());
    covariance.GetCovarianceBlock(copy.eyes[e].camera_from_world.data(),
                                  copy.eyes[e].camera_from_world.data(), rigid.data());
    deviations.lens[e] = sigma * lens.diagonal().cwiseMax(0).cwiseSqrt();
    deviations.pose_covariance[e] = sigma * sigma * rigid;
  }
  return deviations;
}

SightJacobian sight_jacobian(const Bundle& bundle, const Bundle::Sight& sight) {
  const Bundle::Eye& eye = bundle.eyes[static_cast<std::size_t>(sight.eye)];
  const RigidNumbers& board = bundle.world_from_board[static_cast<std::size_t>(sight.board)];
  const ReprojectionCost cost(eye.model, board_point(bundle, sight.point), sight.pixel);
  SightJacobian result;
  Eigen::Matrix<double, 2, 12, Eigen::RowMajor> by_lens;
  Eigen::Matrix<double, 2, 6, Eigen::RowMajor> by_camera;
  Eigen::Matrix<double, 2, 6, Eigen::RowMajor> by_board;
  const double* parameters[] = {eye.lens.data(), eye.camera_from_world.data(), board.data()};
  double* jacobians[] = {by_lens.data(), by_camera.data(), by_board.data()};
  ATELIER_CHECK(cost.Evaluate(parameters, result.error.data(), jacobians),
                "a sight behind its camera");
  result.by_lens = by_lens;
  result.by_camera = by_camera;
  result.by_board = by_board;
  return result;
}

}  // namespace atelier
