#include "bodymodel/tracking/solve_window.h"

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <vector>

#include <ceres/ceres.h>

#include "bodymodel/humanoid.h"
#include "core/error.h"

namespace atelier {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Variables of a frame that stand one after the other.
struct Part {
  Index first = 0;
  Index count = 0;
};

/// The variables cut where the fingers of each hand begin: no joint outside of a hand depends on
/// them, and Ceres multiplies whole blocks. One part where no fingers are sought, or where other
/// joints stand between them.
std::vector<Part> parts_of(const FittedPerson& person) {
  const Index size = 3 + 3 * static_cast<Index>(person.joints.size());
  std::vector<int> hand(person.joints.size(), 0);  // by slot; 0: none
  const Humanoid who = recognised_humanoid(person.model->skeleton);
  for (std::size_t side = 0; side < 2; ++side) {
    for (const auto& finger : who.arms[side].fingers) {
      for (const int joint : finger) {
        const int slot = joint >= 0 ? person.slots[static_cast<std::size_t>(joint)] : -1;
        if (slot >= 0) {
          hand[static_cast<std::size_t>(slot)] = static_cast<int>(side) + 1;
        }
      }
    }
  }
  std::vector<Part> parts = {{0, 3}};
  std::array<bool, 3> begun = {true, false, false};
  for (std::size_t slot = 0; slot < hand.size(); ++slot) {
    const int now = hand[slot];
    if (now != (slot > 0 ? hand[slot - 1] : 0)) {
      if (begun[static_cast<std::size_t>(now)]) {
        return {{0, size}};
      }
      begun[static_cast<std::size_t>(now)] = true;
      parts.push_back({3 + 3 * static_cast<Index>(slot), 0});
    }
    parts.back().count += 3;
  }
  return parts;
}

/// One frame as Ceres sees it: n residuals e with Jacobian R, R'R the normal matrix and R'e the
/// gradient, and one constant that makes the cost whole.
class FrameCost : public ceres::CostFunction {
 public:
  FrameCost(const FittedPerson& person, const FrameTargets& targets, const FrameWeights& weights,
            const std::vector<Part>& parts)
      : person_(person),
        targets_(targets),
        weights_(weights),
        parts_(parts),
        size_(parts.back().first + parts.back().count) {
    for (const Part& part : parts) {
      mutable_parameter_block_sizes()->push_back(static_cast<int>(part.count));
    }
    set_num_residuals(static_cast<int>(size_) + 1);
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Eigen::VectorXd x(size_);
    for (std::size_t p = 0; p < parts_.size(); ++p) {
      x.segment(parts_[p].first, parts_[p].count) =
          Eigen::Map<const Eigen::VectorXd>(parameters[p], parts_[p].count);
    }
    Eigen::Map<Eigen::VectorXd> out(residuals, size_ + 1);
    out.setZero();
    if (!x.allFinite()) {
      return false;
    }
    if (jacobians == nullptr) {
      out[size_] = std::sqrt(2 * frame_energy(person_, targets_, x, weights_, false).cost);
      return true;
    }
    FrameEnergy energy = frame_energy(person_, targets_, x, weights_);
    // Directions that nothing in the frame holds get next to nothing.
    energy.hessian.diagonal().array() += 1e-6;
    const Eigen::LLT<Eigen::MatrixXd> factor(energy.hessian);
    if (factor.info() != Eigen::Success) {
      return false;
    }
    const Eigen::VectorXd e = factor.matrixL().solve(energy.gradient);
    out.head(size_) = e;
    out[size_] = std::sqrt(std::max(0.0, 2 * energy.cost - e.squaredNorm()));
    const Eigen::MatrixXd upper = factor.matrixU();
    for (std::size_t p = 0; p < parts_.size(); ++p) {
      if (jacobians[p] != nullptr) {
        Eigen::Map<RowMajor> jacobian(jacobians[p], size_ + 1, parts_[p].count);
        jacobian.topRows(size_) = upper.middleCols(parts_[p].first, parts_[p].count);
        jacobian.row(size_).setZero();
      }
    }
    return true;
  }

 private:
  const FittedPerson& person_;
  const FrameTargets& targets_;
  const FrameWeights& weights_;
  const std::vector<Part>& parts_;
  Index size_;
};

/// Accelerations of the joints of one part, over three frames. They hang on the first part, and on
/// their own.
class AccelerationCost : public ceres::CostFunction {
 public:
  AccelerationCost(const FittedPerson& person, const std::array<double, 3>& times,
                   const MotionWeights& motion, const std::vector<Part>& parts, std::size_t part)
      : person_(person),
        times_(times),
        motion_(motion),
        size_(parts.back().first + parts.back().count),
        own_(parts[part]) {
    blocks_ = part == 0 ? std::vector<Part>{own_} : std::vector<Part>{parts[0], own_};
    for (std::size_t i = 0; i < 3; ++i) {
      for (const Part& block : blocks_) {
        mutable_parameter_block_sizes()->push_back(static_cast<int>(block.count));
      }
    }
    // Three variables lead the first part, and its root's rotation shows in its children's places.
    places_ = part == 0 ? Part{0, own_.count - 3} : Part{own_.first - 3, own_.count};
    turns_ =
        part == 0 ? Part{size_ - 3, own_.count - 6} : Part{size_ - 3 + own_.first - 6, own_.count};
    set_num_residuals(static_cast<int>(places_.count + turns_.count));
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    std::array<Eigen::VectorXd, 3> x;
    for (std::size_t i = 0; i < 3; ++i) {
      x[i] = Eigen::VectorXd::Zero(size_);  // what hangs on other parts is not asked for
      for (std::size_t b = 0; b < blocks_.size(); ++b) {
        x[i].segment(blocks_[b].first, blocks_[b].count) =
            Eigen::Map<const Eigen::VectorXd>(parameters[i * blocks_.size() + b], blocks_[b].count);
      }
    }
    const Acceleration found = acceleration(person_, x, times_, motion_, jacobians != nullptr);
    Eigen::Map<Eigen::VectorXd> out(residuals, places_.count + turns_.count);
    out << found.residual.segment(places_.first, places_.count),
        found.residual.segment(turns_.first, turns_.count);
    for (std::size_t i = 0; jacobians != nullptr && i < 3; ++i) {
      for (std::size_t b = 0; b < blocks_.size(); ++b) {
        if (double* to = jacobians[i * blocks_.size() + b]; to != nullptr) {
          const auto columns = found.jacobian[i].middleCols(blocks_[b].first, blocks_[b].count);
          Eigen::Map<RowMajor>(to, out.size(), blocks_[b].count)
              << columns.middleRows(places_.first, places_.count),
              columns.middleRows(turns_.first, turns_.count);
        }
      }
    }
    return true;
  }

 private:
  const FittedPerson& person_;
  std::array<double, 3> times_;
  MotionWeights motion_;
  Index size_;
  Part own_;
  std::vector<Part> blocks_;  // of a frame's variables
  Part places_;               // rows of Acceleration
  Part turns_;
};

void check_window(const TrackWindow& window) {
  ATELIER_CHECK(window.times.size() == window.targets.size() &&
                    window.start.size() == window.targets.size() && !window.targets.empty(),
                "a window's arrays have one size");
  for (std::size_t f = 1; f < window.times.size(); ++f) {
    ATELIER_CHECK(window.times[f] > window.times[f - 1], "times increase");
  }
}

}  // namespace

OptionTable describe(MotionWeights& weights) {
  OptionTable table;
  table.add("acceleration", weights.acceleration, 0.01, 1e6, "m/s2",
            "spread of a joint's acceleration; smaller makes motion smoother");
  table.add("turning", weights.turning, 0.1, 1e7, "rad/s2",
            "spread of the acceleration of a joint's rotation");
  return table;
}

Acceleration acceleration(const FittedPerson& person, const std::array<Eigen::VectorXd, 3>& x,
                          const std::array<double, 3>& times, const MotionWeights& motion,
                          bool derivatives) {
  const double first = times[1] - times[0];
  const double second = times[2] - times[1];
  const double span = times[2] - times[0];
  const std::array<double, 3> share = {2 / (first * span), -2 / (first * second),
                                       2 / (second * span)};
  const Index size = x[0].size();
  const Index joints = size - 3;  // three for each joint
  const Index turns = size - 6;   // the root's rotation shows in its children's places
  Acceleration result;
  result.residual = Eigen::VectorXd::Zero(joints + turns);
  for (std::size_t i = 0; i < 3; ++i) {
    const double place = share[i] / motion.acceleration;
    const double turn = share[i] / motion.turning;
    result.residual.head(joints) += place * sought_joints(person, x[i]);
    result.residual.tail(turns) += turn * x[i].tail(turns);
    if (derivatives) {
      result.jacobian[i] = Eigen::MatrixXd::Zero(joints + turns, size);
      result.jacobian[i].topRows(joints) = place * sought_joints_jacobian(person, x[i]);
      result.jacobian[i].bottomRightCorner(turns, turns).diagonal().setConstant(turn);
    }
  }
  return result;
}

WindowSolution solve_window(const FittedPerson& person, const TrackWindow& window,
                            const FrameWeights& weights, const MotionWeights& motion,
                            int iterations) {
  check_window(window);
  WindowSolution solution;
  solution.x = window.start;
  const std::size_t frames = window.targets.size();
  const std::vector<Part> parts = parts_of(person);
  const auto block = [&](std::size_t f, std::size_t p) {
    return solution.x[f].data() + parts[p].first;
  };
  ceres::Problem problem;
  for (std::size_t f = 0; f < frames; ++f) {
    std::vector<double*> blocks;
    for (std::size_t p = 0; p < parts.size(); ++p) {
      blocks.push_back(block(f, p));
    }
    problem.AddResidualBlock(new FrameCost(person, *window.targets[f], weights, parts), nullptr,
                             blocks);
  }
  for (std::size_t f = 2; f < frames; ++f) {
    for (std::size_t p = 0; p < parts.size(); ++p) {
      std::vector<double*> blocks;
      for (std::size_t g = f - 2; g <= f; ++g) {
        blocks.push_back(block(g, 0));
        if (p > 0) {
          blocks.push_back(block(g, p));
        }
      }
      problem.AddResidualBlock(
          new AccelerationCost(person, {window.times[f - 2], window.times[f - 1], window.times[f]},
                               motion, parts, p),
          nullptr, blocks);
    }
  }
  ceres::Solver::Options options;
  options.num_threads = 1;
  options.linear_solver_type =
      frames == 1 ? ceres::DENSE_NORMAL_CHOLESKY : ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = iterations;
  options.function_tolerance = 1e-5;
  options.parameter_tolerance = 1e-6;
  options.gradient_tolerance = 1e-10;
  options.initial_trust_region_radius = 1e3;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  solution.converged = summary.termination_type == ceres::CONVERGENCE;
  solution.iterations = static_cast<int>(summary.iterations.size());
  return solution;
}

RowMatrix joint_deviations(const FittedPerson& person, const TrackWindow& window,
                           const std::vector<Eigen::VectorXd>& x, const FrameWeights& weights,
                           const MotionWeights& motion) {
  check_window(window);
  ATELIER_CHECK(x.size() == window.targets.size(), "variables of every frame");
  const std::size_t frames = x.size();
  const Index size = x[0].size();
  // Pairs of frames are the blocks of a block-tridiagonal matrix: accelerations join three frames.
  const std::size_t blocks = (frames + 1) / 2;
  const auto rows_of = [&](std::size_t b) {
    return size * static_cast<Index>(std::min<std::size_t>(2, frames - 2 * b));
  };
  std::vector<Eigen::MatrixXd> diagonal(blocks);
  std::vector<Eigen::MatrixXd> above(blocks);  // [b] couples b with b + 1
  for (std::size_t b = 0; b < blocks; ++b) {
    diagonal[b] = Eigen::MatrixXd::Zero(rows_of(b), rows_of(b));
    if (b + 1 < blocks) {
      above[b] = Eigen::MatrixXd::Zero(rows_of(b), rows_of(b + 1));
    }
  }
  const auto add = [&](std::size_t f, std::size_t g, const Eigen::MatrixXd& part) {  // f <= g
    const Index row = size * static_cast<Index>(f % 2);
    const Index column = size * static_cast<Index>(g % 2);
    if (f / 2 == g / 2) {
      diagonal[f / 2].block(row, column, size, size) += part;
      if (f != g) {
        diagonal[f / 2].block(column, row, size, size) += part.transpose();
      }
    } else {
      above[f / 2].block(row, column, size, size) += part;
    }
  };
  for (std::size_t f = 0; f < frames; ++f) {
    Eigen::MatrixXd hessian = frame_energy(person, *window.targets[f], x[f], weights).hessian;
    hessian.diagonal().array() += 1e-6;
    add(f, f, hessian);
  }
  for (std::size_t f = 2; f < frames; ++f) {
    const Acceleration three =
        acceleration(person, {x[f - 2], x[f - 1], x[f]},
                     {window.times[f - 2], window.times[f - 1], window.times[f]}, motion, true);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = i; j < 3; ++j) {
        add(f - 2 + i, f - 2 + j, three.jacobian[i].transpose() * three.jacobian[j]);
      }
    }
  }
  // What the blocks before and after tell of a block: Schur complements from both ends.
  std::vector<Eigen::MatrixXd> before(blocks);
  std::vector<Eigen::MatrixXd> after(blocks);
  before[0] = diagonal[0];
  for (std::size_t b = 1; b < blocks; ++b) {
    before[b] = diagonal[b] - above[b - 1].transpose() * before[b - 1].llt().solve(above[b - 1]);
  }
  after[blocks - 1] = diagonal[blocks - 1];
  for (std::size_t b = blocks - 1; b-- > 0;) {
    after[b] =
        diagonal[b] - above[b] * after[b + 1].llt().solve(Eigen::MatrixXd(above[b].transpose()));
  }
  const auto joints = static_cast<Index>(person.joints.size());
  RowMatrix deviations(static_cast<Index>(frames), joints);
  for (std::size_t b = 0; b < blocks; ++b) {
    const Eigen::MatrixXd information = before[b] + after[b] - diagonal[b];
    const Eigen::MatrixXd covariance =
        information.llt().solve(Eigen::MatrixXd::Identity(rows_of(b), rows_of(b)));
    for (std::size_t f = 2 * b; f < std::min(frames, 2 * b + 2); ++f) {
      const Index at = size * static_cast<Index>(f % 2);
      const Eigen::MatrixXd jacobian = sought_joints_jacobian(person, x[f]);
      const Eigen::MatrixXd spread = jacobian * covariance.block(at, at, size, size);
      for (Index a = 0; a < joints; ++a) {
        const double trace =
            (spread.middleRows(3 * a, 3).array() * jacobian.middleRows(3 * a, 3).array()).sum();
        deviations(static_cast<Index>(f), a) = std::sqrt(std::max(0.0, trace) / 3);
      }
    }
  }
  return deviations;
}

}  // namespace atelier
