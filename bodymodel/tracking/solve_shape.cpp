#include "bodymodel/tracking/solve_shape.h"

#include <Eigen/Cholesky>
#include <cmath>

#include <ceres/ceres.h>

#include "core/error.h"

namespace atelier {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// One frame by its variables and the shape, as the square root of its normal matrix.
class FrameShapeCost : public ceres::CostFunction {
 public:
  FrameShapeCost(const FittedPerson& person, const FrameTargets& targets,
                 const FrameWeights& weights, Index size, Index shape)
      : person_(person), targets_(targets), weights_(weights), size_(size), shape_(shape) {
    mutable_parameter_block_sizes()->assign({static_cast<int>(size), static_cast<int>(shape)});
    set_num_residuals(static_cast<int>(size + shape) + 1);
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(parameters[0], size_);
    const Eigen::VectorXd shape = Eigen::Map<const Eigen::VectorXd>(parameters[1], shape_);
    if (!x.allFinite() || !shape.allFinite()) {
      return false;
    }
    const FittedPerson person = with_shape(person_, shape);
    const Index all = size_ + shape_;
    Eigen::Map<Eigen::VectorXd> out(residuals, all + 1);
    out.setZero();
    if (jacobians == nullptr) {
      out[all] = std::sqrt(2 * frame_energy(person, targets_, x, weights_, false).cost);
      return true;
    }
    FrameEnergy energy = frame_shape_energy(person, targets_, x, weights_);
    // Shape values have units of their own: what is next to nothing depends on each.
    energy.hessian.diagonal() += 1e-9 * energy.hessian.diagonal();
    energy.hessian.diagonal().array() += 1e-6;
    const Eigen::LLT<Eigen::MatrixXd> factor(energy.hessian);
    if (factor.info() != Eigen::Success) {
      return false;
    }
    const Eigen::VectorXd e = factor.matrixL().solve(energy.gradient);
    out.head(all) = e;
    out[all] = std::sqrt(std::max(0.0, 2 * energy.cost - e.squaredNorm()));
    const Eigen::MatrixXd root = factor.matrixU();
    const std::array<std::pair<Index, Index>, 2> columns = {{{0, size_}, {size_, shape_}}};
    for (std::size_t b = 0; b < 2; ++b) {
      if (jacobians[b] != nullptr) {
        Eigen::Map<RowMajor> jacobian(jacobians[b], all + 1, columns[b].second);
        jacobian.setZero();
        jacobian.topRows(all) = root.middleCols(columns[b].first, columns[b].second);
      }
    }
    return true;
  }

 private:
  const FittedPerson& person_;
  const FrameTargets& targets_;
  const FrameWeights& weights_;
  Index size_;
  Index shape_;
};

/// The pull of all values to neutral: each with its range, and together as they are held.
class NeutralCost : public ceres::CostFunction {
 public:
  NeutralCost(const BodyModel& model, const Eigen::MatrixXd& held)
      : neutral_(neutral_shape(model)) {
    Eigen::MatrixXd all = Eigen::MatrixXd::Zero(neutral_.size(), neutral_.size());
    for (Index s = 0; s < neutral_.size(); ++s) {
      const ShapeParameter& parameter = model.shape[static_cast<std::size_t>(s)];
      const double weight = 2 / std::max(1e-9, parameter.max - parameter.min);
      all(s, s) = weight * weight;
    }
    if (held.size() > 0) {
      all += held;
    }
    const Eigen::LLT<Eigen::MatrixXd> factor(all);
    ATELIER_CHECK(factor.info() == Eigen::Success, "values held by what is no less than 0");
    root_ = factor.matrixU();
    mutable_parameter_block_sizes()->push_back(static_cast<int>(neutral_.size()));
    set_num_residuals(static_cast<int>(neutral_.size()));
  }
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Index size = neutral_.size();
    Eigen::Map<Eigen::VectorXd>(residuals, size) =
        root_ * (Eigen::Map<const Eigen::VectorXd>(parameters[0], size) - neutral_);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<RowMajor>(jacobians[0], size, size) = root_;
    }
    return true;
  }

 private:
  Eigen::VectorXd neutral_;
  Eigen::MatrixXd root_;
};

}  // namespace

ShapeSolution solve_shape(const FittedPerson& person,
                          const std::vector<const FrameTargets*>& frames,
                          const std::vector<Eigen::VectorXd>& start, const FrameWeights& weights,
                          int iterations, const Eigen::MatrixXd& held) {
  ATELIER_CHECK(frames.size() == start.size() && !frames.empty(), "a start for each frame");
  ATELIER_CHECK(
      !person.model->shape.empty() && person.places_by_shape.size() == person.model->shape.size(),
      "a person with a shape that has been through with_shape");
  const auto shapes = static_cast<Index>(person.model->shape.size());
  ATELIER_CHECK(held.size() == 0 || (held.rows() == shapes && held.cols() == shapes),
                "a row and a column for each value");
  ShapeSolution solution{person.shape, start, false};
  ceres::Problem problem;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    problem.AddResidualBlock(
        new FrameShapeCost(person, *frames[f], weights, solution.x[f].size(), shapes), nullptr,
        solution.x[f].data(), solution.shape.data());
  }
  problem.AddResidualBlock(new NeutralCost(*person.model, held), nullptr, solution.shape.data());
  ceres::Solver::Options options;
  options.num_threads = 1;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = iterations;
  options.function_tolerance = 1e-6;
  options.parameter_tolerance = 1e-7;
  options.initial_trust_region_radius = 1e3;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  solution.converged = summary.termination_type == ceres::CONVERGENCE;
  return solution;
}

}  // namespace atelier
