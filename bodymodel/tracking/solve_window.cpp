#include "bodymodel/tracking/solve_window.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include <ceres/ceres.h>

#include "core/error.h"
#include "core/parallel.h"

namespace atelier {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Sought joints one below the other without a branch between them: the trunk up to where it forks,
/// a leg, an arm, a finger. Ceres multiplies whole blocks, and one block a frame would couple every
/// finger with every other joint, although most pairs of limbs have nothing to do with each other.
struct Part {
  std::vector<Index> slots;        // increasing
  std::vector<std::size_t> chain;  // parts that move its joints: from the root's to itself
  std::vector<Index> variables;    // of a frame, in the order of its block
};

/// The parts of a body, the root's first, each behind those above it.
std::vector<Part> parts_of(const FittedPerson& person) {
  const std::size_t count = person.joints.size();
  std::vector<int> above(count, -1);  // the nearest sought joint
  std::vector<int> below(count, 0);
  for (std::size_t a = 1; a < count; ++a) {
    int joint = person.joints[a];
    do {
      joint = person.shaped.skeleton.parents[static_cast<std::size_t>(joint)];
    } while (person.slots[static_cast<std::size_t>(joint)] < 0);
    above[a] = person.slots[static_cast<std::size_t>(joint)];
    ++below[static_cast<std::size_t>(above[a])];
  }
  std::vector<Part> parts;
  std::vector<std::size_t> part_of(count, 0);
  for (std::size_t a = 0; a < count; ++a) {
    if (a > 0 && below[static_cast<std::size_t>(above[a])] == 1) {
      part_of[a] = part_of[static_cast<std::size_t>(above[a])];
    } else {
      part_of[a] = parts.size();
      Part part;
      if (a == 0) {
        part.variables = {0, 1, 2};  // the root's translation
      } else {
        part.chain = parts[part_of[static_cast<std::size_t>(above[a])]].chain;
      }
      part.chain.push_back(parts.size());
      parts.push_back(std::move(part));
    }
    Part& part = parts[part_of[a]];
    const auto slot = static_cast<Index>(a);
    part.slots.push_back(slot);
    part.variables.insert(part.variables.end(), {3 + 3 * slot, 4 + 3 * slot, 5 + 3 * slot});
  }
  return parts;
}

/// Which parts' blocks of a frame's triangular factor are not zero when parts are eliminated from
/// the last to the first, [P][P] for p >= q: those that some vertex or keypoint hangs on together,
/// and what elimination adds.
std::vector<std::vector<char>> factor_blocks(const FittedPerson& person,
                                             const std::vector<Part>& parts) {
  std::vector<std::size_t> part_of(person.joints.size(), 0);
  std::vector<std::vector<char>> joined(parts.size(), std::vector<char>(parts.size(), 0));
  for (std::size_t p = 0; p < parts.size(); ++p) {
    for (const Index slot : parts[p].slots) {
      part_of[static_cast<std::size_t>(slot)] = p;
    }
    for (const std::size_t q : parts[p].chain) {
      joined[p][q] = 1;
    }
  }
  std::vector<std::size_t> met;
  const SkinChains& chains = person.chains;
  const auto joins = [&](int begin, int end) {
    for (int e = begin; e < end; ++e) {
      const int slot =
          person.slots[static_cast<std::size_t>(chains.joints[static_cast<std::size_t>(e)])];
      if (slot >= 0) {
        met.push_back(part_of[static_cast<std::size_t>(slot)]);
      }
    }
  };
  // Points of the surface hang on the chains of all three corners of their face.
  const auto& faces = person.model->mesh.faces;
  for (Index f = 0; f < faces.rows(); ++f) {
    met.clear();
    for (int c = 0; c < 3; ++c) {
      const auto v = static_cast<std::size_t>(faces(f, c));
      joins(chains.begin[v], chains.begin[v + 1]);
    }
    std::sort(met.begin(), met.end());
    met.erase(std::unique(met.begin(), met.end()), met.end());
    for (const std::size_t p : met) {
      for (const std::size_t q : met) {
        joined[p][q] = 1;
      }
    }
  }
  for (std::size_t p = parts.size(); p-- > 0;) {
    for (std::size_t q = 0; q < p; ++q) {
      for (std::size_t r = 0; r <= q; ++r) {
        if (joined[p][q] != 0 && joined[p][r] != 0) {
          joined[q][r] = 1;
        }
      }
    }
  }
  return joined;
}

/// Weights of three frames in their second difference, 1/s2.
std::array<double, 3> difference_shares(const std::array<double, 3>& times) {
  const double first = times[1] - times[0];
  const double second = times[2] - times[1];
  const double span = times[2] - times[0];
  return {2 / (first * span), -2 / (first * second), 2 / (second * span)};
}

/// Variables of all frames as Ceres has them, in blocks by part, and what its residuals share at
/// one point: every frame is evaluated once.
class SharedWindow : public ceres::EvaluationCallback {
 public:
  struct Frame {
    SkinPoints matched;
    std::vector<Eigen::VectorXd> blocks;  // [P] variables
    Eigen::VectorXd x;
    bool usable = false;
    double rest = 0;            // the residual that makes the cost whole
    Eigen::VectorXd residuals;  // [n] in order of elimination, with derivatives alone
    Eigen::MatrixXd factor;     // [n,n] lower, its transpose the residuals' Jacobian
    Eigen::VectorXd places;     // [3A]
    Eigen::MatrixXd places_jacobian;
  };

  /// @param steps  that the solver takes at most
  SharedWindow(const FittedPerson& person, const TrackWindow& window, const FrameWeights& weights,
               int steps)
      : parts(parts_of(person)),
        joined(factor_blocks(person, parts)),
        frames(window.targets.size()),
        person_(person),
        window_(window),
        weights_(weights),
        steps_left_(steps) {
    begins.resize(parts.size());
    for (std::size_t p = parts.size(); p-- > 0;) {
      begins[p] = static_cast<Index>(order_.size());
      order_.insert(order_.end(), parts[p].variables.begin(), parts[p].variables.end());
    }
    for (std::size_t f = 0; f < frames.size(); ++f) {
      frames[f].matched = matched_points(person, *window.targets[f]);
      frames[f].x = window.start[f];
      for (const Part& part : parts) {
        frames[f].blocks.emplace_back(window.start[f](part.variables));
      }
    }
  }

  /// Ceres asks for the cost where a step leads, and when it takes the step, as it nearly always
  /// does, for the derivatives there, which have most of their work in common: both are made at
  /// once. Behind the last step it asks for derivatives too, for its report alone: there they stay
  /// as they were.
  void PrepareForEvaluation(bool derivatives, bool new_point) override {
    if (new_point && !derivatives) {
      --steps_left_;
    }
    const bool wanted = derivatives || steps_left_ > 0;
    if (!new_point && (!derivatives || derivatives_ || steps_left_ <= 0)) {
      return;
    }
    derivatives_ = wanted;
    parallel_for(static_cast<Index>(frames.size()), 1, [&](Index begin, Index end) {
      for (Index f = begin; f < end; ++f) {
        prepare(static_cast<std::size_t>(f), wanted);
      }
    });
  }

  Eigen::VectorXd variables(std::size_t f) const {
    Eigen::VectorXd x(frames[f].x.size());
    for (std::size_t p = 0; p < parts.size(); ++p) {
      x(parts[p].variables) = frames[f].blocks[p];
    }
    return x;
  }

  const std::vector<Part> parts;
  const std::vector<std::vector<char>> joined;
  std::vector<Index> begins;  // [P] of a part's variables in order of elimination
  std::vector<Frame> frames;

 private:
  void prepare(std::size_t f, bool derivatives) {
    Frame& frame = frames[f];
    frame.x = variables(f);
    frame.usable = frame.x.allFinite();
    if (!frame.usable) {
      return;
    }
    frame.places = sought_joints(person_, frame.x);
    FrameEnergy energy =
        frame_energy(person_, *window_.targets[f], frame.matched, frame.x, weights_, derivatives);
    if (!derivatives) {
      frame.residuals.setZero(frame.x.size());
      frame.rest = std::sqrt(2 * energy.cost);
      return;
    }
    frame.places_jacobian = sought_joints_jacobian(person_, frame.x);
    // Directions that nothing in the frame holds get next to nothing.
    energy.hessian.diagonal().array() += 1e-6;
    const Eigen::LLT<Eigen::MatrixXd> factor(energy.hessian(order_, order_));
    frame.usable = factor.info() == Eigen::Success;
    if (!frame.usable) {
      return;
    }
    frame.residuals = factor.matrixL().solve(Eigen::VectorXd(energy.gradient(order_)));
    frame.rest = std::sqrt(std::max(0.0, 2 * energy.cost - frame.residuals.squaredNorm()));
    frame.factor = factor.matrixLLT();
  }

  const FittedPerson& person_;
  const TrackWindow& window_;
  const FrameWeights& weights_;
  std::vector<Index> order_;  // of elimination: leaves first, so that limbs do not fill each other
  int steps_left_;            // until derivatives are no longer of use
  bool derivatives_ = false;  // whether frames have those of their point
};

/// One part's share of a frame as Ceres sees it: residuals e with Jacobian R over all parts, R'R
/// the normal matrix and R'e the gradient; and for the root's part one constant that makes the cost
/// whole.
class FrameCost : public ceres::CostFunction {
 public:
  FrameCost(const SharedWindow& window, std::size_t frame, std::size_t part)
      : frame_(window.frames[frame]), begin_(window.begins[part]), last_(part == 0) {
    rows_ = static_cast<Index>(window.parts[part].variables.size());
    for (std::size_t q = part + 1; q-- > 0;) {
      if (window.joined[part][q] != 0) {
        parts_.push_back(q);
        begins_.push_back(window.begins[q]);
        const std::size_t count = window.parts[q].variables.size();
        mutable_parameter_block_sizes()->push_back(static_cast<int>(count));
      }
    }
    set_num_residuals(static_cast<int>(rows_) + (last_ ? 1 : 0));
  }
  const std::vector<std::size_t>& parts() const { return parts_; }

  bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
    if (!frame_.usable) {
      return false;
    }
    Eigen::Map<Eigen::VectorXd>(residuals, rows_) = frame_.residuals.segment(begin_, rows_);
    if (last_) {
      residuals[rows_] = frame_.rest;
    }
    for (std::size_t b = 0; jacobians != nullptr && b < parts_.size(); ++b) {
      if (jacobians[b] == nullptr) {
        continue;
      }
      const Index columns = parameter_block_sizes()[b];
      Eigen::Map<RowMajor> jacobian(jacobians[b], num_residuals(), columns);
      jacobian.topRows(rows_) = frame_.factor.block(begins_[b], begin_, columns, rows_).transpose();
      if (b == 0) {  // its own: above the diagonal of the factor lies nothing
        jacobian.topRows(rows_).triangularView<Eigen::StrictlyLower>().setZero();
      }
      if (last_) {
        jacobian.row(rows_).setZero();
      }
    }
    return true;
  }

 private:
  const SharedWindow::Frame& frame_;
  Index begin_;
  Index rows_;
  bool last_;
  std::vector<std::size_t> parts_;  // that its blocks are of, itself first
  std::vector<Index> begins_;
};

/// Accelerations of the joints of one part over three frames, by the parts of its chain.
class AccelerationCost : public ceres::CostFunction {
 public:
  AccelerationCost(const SharedWindow& window, std::size_t first, std::size_t part,
                   const std::array<double, 3>& shares)
      : window_(window), first_(first), part_(window.parts[part]), shares_(shares) {
    for (std::size_t i = 0; i < 3; ++i) {
      for (const std::size_t q : part_.chain) {
        const std::size_t count = window.parts[q].variables.size();
        mutable_parameter_block_sizes()->push_back(static_cast<int>(count));
      }
    }
    set_num_residuals(3 * static_cast<int>(part_.slots.size()));
  }

  bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
    Eigen::Map<Eigen::VectorXd> out(residuals, num_residuals());
    out.setZero();
    for (std::size_t i = 0; i < 3; ++i) {
      const SharedWindow::Frame& frame = window_.frames[first_ + i];
      if (!frame.usable) {
        return false;
      }
      for (std::size_t a = 0; a < part_.slots.size(); ++a) {
        out.segment<3>(3 * static_cast<Index>(a)) +=
            shares_[i] * frame.places.segment<3>(3 * part_.slots[a]);
      }
      for (std::size_t b = 0; jacobians != nullptr && b < part_.chain.size(); ++b) {
        double* to = jacobians[i * part_.chain.size() + b];
        if (to == nullptr) {
          continue;
        }
        const std::vector<Index>& columns = window_.parts[part_.chain[b]].variables;
        Eigen::Map<RowMajor> jacobian(to, num_residuals(), static_cast<Index>(columns.size()));
        for (std::size_t a = 0; a < part_.slots.size(); ++a) {
          for (std::size_t c = 0; c < columns.size(); ++c) {
            jacobian.block<3, 1>(3 * static_cast<Index>(a), static_cast<Index>(c)) =
                shares_[i] * frame.places_jacobian.block<3, 1>(3 * part_.slots[a], columns[c]);
          }
        }
      }
    }
    return true;
  }

 private:
  const SharedWindow& window_;
  std::size_t first_;
  const Part& part_;
  std::array<double, 3> shares_;
};

/// Accelerations of the rotations of one part over three frames; the root's shows in its
/// children's places.
class TurningCost : public ceres::CostFunction {
 public:
  TurningCost(const Part& part, bool root, const std::array<double, 3>& shares)
      : skipped_(root ? 6 : 0), shares_(shares) {
    const auto count = static_cast<int>(part.variables.size());
    *mutable_parameter_block_sizes() = {count, count, count};
    set_num_residuals(count - skipped_);
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    for (int r = 0; r < num_residuals(); ++r) {
      residuals[r] = 0;
      for (std::size_t i = 0; i < 3; ++i) {
        residuals[r] += shares_[i] * parameters[i][skipped_ + r];
      }
    }
    for (std::size_t i = 0; jacobians != nullptr && i < 3; ++i) {
      if (jacobians[i] != nullptr) {
        Eigen::Map<RowMajor> jacobian(jacobians[i], num_residuals(), skipped_ + num_residuals());
        jacobian.setZero();
        jacobian.rightCols(num_residuals()).diagonal().setConstant(shares_[i]);
      }
    }
    return true;
  }

 private:
  int skipped_;
  std::array<double, 3> shares_;
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
            "Standard deviation of a joint's acceleration; smaller makes motion smoother");
  table.add("turning", weights.turning, 0.1, 1e7, "rad/s2",
            "Standard deviation of a joint's angular acceleration; smaller makes motion smoother");
  return table;
}

Acceleration acceleration(const FittedPerson& person, const std::array<Eigen::VectorXd, 3>& x,
                          const std::array<double, 3>& times, const MotionWeights& motion,
                          bool derivatives) {
  const std::array<double, 3> share = difference_shares(times);
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
  const std::size_t frames = window.targets.size();
  SharedWindow shared(person, window, weights, iterations);
  const std::size_t parts = shared.parts.size();
  const auto block = [&](std::size_t f, std::size_t p) {
    return shared.frames[f].blocks[p].data();
  };
  ceres::Problem::Options sharing;
  sharing.evaluation_callback = &shared;
  ceres::Problem problem(sharing);
  std::vector<double*> blocks;
  for (std::size_t f = 0; f < frames; ++f) {
    for (std::size_t p = 0; p < parts; ++p) {
      auto cost = std::make_unique<FrameCost>(shared, f, p);
      blocks.clear();
      for (const std::size_t q : cost->parts()) {
        blocks.push_back(block(f, q));
      }
      problem.AddResidualBlock(cost.release(), nullptr, blocks);
    }
  }
  for (std::size_t f = 2; f < frames; ++f) {
    const std::array<double, 3> shares =
        difference_shares({window.times[f - 2], window.times[f - 1], window.times[f]});
    const auto over = [&](double spread) {
      return std::array<double, 3>{shares[0] / spread, shares[1] / spread, shares[2] / spread};
    };
    for (std::size_t p = 0; p < parts; ++p) {
      blocks.clear();
      for (std::size_t g = f - 2; g <= f; ++g) {
        for (const std::size_t q : shared.parts[p].chain) {
          blocks.push_back(block(g, q));
        }
      }
      problem.AddResidualBlock(new AccelerationCost(shared, f - 2, p, over(motion.acceleration)),
                               nullptr, blocks);
      if (p > 0 || shared.parts[0].slots.size() > 1) {
        problem.AddResidualBlock(new TurningCost(shared.parts[p], p == 0, over(motion.turning)),
                                 nullptr, {block(f - 2, p), block(f - 1, p), block(f, p)});
      }
    }
  }
  ceres::Solver::Options options;
  options.num_threads = 1;
  options.linear_solver_type =
      frames == 1 ? ceres::DENSE_NORMAL_CHOLESKY : ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = iterations;
  // Of a window's size it is quicker than SuiteSparse, whose dense kernels wake threads of their
  // own.
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  options.function_tolerance = 1e-5;
  options.parameter_tolerance = 1e-6;
  options.gradient_tolerance = 1e-10;
  options.initial_trust_region_radius = 1e3;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  WindowSolution solution;
  for (std::size_t f = 0; f < frames; ++f) {
    solution.x.push_back(shared.variables(f));
  }
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
  const Index places = size - 3;  // rows of `acceleration`
  const Index turns = size - 6;
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
        // Rows of places, then the rotations' own, which are diagonal.
        Eigen::MatrixXd part =
            three.jacobian[i].topRows(places).transpose() * three.jacobian[j].topRows(places);
        part.diagonal().tail(turns) +=
            three.jacobian[i]
                .bottomRightCorner(turns, turns)
                .diagonal()
                .cwiseProduct(three.jacobian[j].bottomRightCorner(turns, turns).diagonal());
        add(f - 2 + i, f - 2 + j, part);
      }
    }
  }
  // Information on a block from those before and after: Schur complements from both ends.
  std::vector<Eigen::MatrixXd> before(blocks);
  std::vector<Eigen::MatrixXd> after(blocks);
  // Lower halves alone.
  const auto less = [](const Eigen::MatrixXd& whole, const Eigen::MatrixXd& next,
                       const Eigen::MatrixXd& coupling) {
    Eigen::MatrixXd left = whole;
    const Eigen::MatrixXd root = next.llt().matrixL().solve(coupling);
    left.selfadjointView<Eigen::Lower>().rankUpdate(root.transpose(), -1);
    return left;
  };
  before[0] = diagonal[0];
  for (std::size_t b = 1; b < blocks; ++b) {
    before[b] = less(diagonal[b], before[b - 1], above[b - 1]);
  }
  after[blocks - 1] = diagonal[blocks - 1];
  for (std::size_t b = blocks - 1; b-- > 0;) {
    after[b] = less(diagonal[b], after[b + 1], above[b].transpose());
  }
  const auto joints = static_cast<Index>(person.joints.size());
  RowMatrix deviations(static_cast<Index>(frames), joints);
  for (std::size_t b = 0; b < blocks; ++b) {
    const Eigen::MatrixXd information = before[b] + after[b] - diagonal[b];
    const Eigen::LLT<Eigen::MatrixXd> factor(information);
    for (std::size_t f = 2 * b; f < std::min(frames, 2 * b + 2); ++f) {
      // Places have the covariance J (L L')^-1 J' = S' S, S = L^-1 J'.
      Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(rows_of(b), 3 * joints);
      spread.middleRows(size * static_cast<Index>(f % 2), size) =
          sought_joints_jacobian(person, x[f]).transpose();
      factor.matrixL().solveInPlace(spread);
      for (Index a = 0; a < joints; ++a) {
        deviations(static_cast<Index>(f), a) =
            std::sqrt(spread.middleCols(3 * a, 3).squaredNorm() / 3);
      }
    }
  }
  return deviations;
}

}  // namespace atelier
