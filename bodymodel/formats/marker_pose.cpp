#include "bodymodel/formats/marker_pose.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "bodymodel/rotation.h"
#include "core/error.h"

namespace atelier {
namespace {

constexpr double kStill = 1e-5;     // rad and m of a step that ends the search
constexpr double kTrunkPull = 0.3;  // of the limbs' freedom: spine, neck, collars

bool of_trunk(const std::string& name) {
  return name.starts_with("spine") || name == "neck" || name == "head" || name.ends_with("collar");
}

// The least-squares problem of one frame. Parameters are the pose vector.
class Problem {
 public:
  Problem(const Skeleton& skeleton, const RidingMarkers& markers, const Points& targets,
          const std::vector<bool>& seen, const Pose& start, const MarkerPoseOptions& options)
      : skeleton_(skeleton),
        markers_(markers),
        targets_(targets),
        seen_(seen),
        options_(options),
        start_(pose_vector(start)),
        pull_(Eigen::VectorXd::Zero(start_.size())) {
    for (std::size_t j = 1; j < skeleton.names.size(); ++j) {
      const double share = of_trunk(skeleton.names[j]) ? kTrunkPull : 1.0;
      pull_.segment<3>(3 + 3 * static_cast<Index>(j)).setConstant(1 / (share * share));
    }
  }

  double cost(const Eigen::VectorXd& x) const {
    const Points at = marker_positions(markers_, forward_kinematics(skeleton_, pose_of_vector(x)));
    double sum = 0;
    for (Index m = 0; m < at.rows(); ++m) {
      if (seen_[static_cast<std::size_t>(m)]) {
        const double gap = (at.row(m) - targets_.row(m)).norm();
        sum +=
            gap <= options_.outlier ? gap * gap : options_.outlier * (2 * gap - options_.outlier);
      }
    }
    return sum / (options_.noise * options_.noise) +
           pull_.dot(x.cwiseAbs2()) / (options_.rest_pull * options_.rest_pull) +
           (x - start_).tail(x.size() - 3).squaredNorm() /
               (options_.hold_pull * options_.hold_pull);
  }

  // Half the gradient and Gauss-Newton's half Hessian.
  void linearise(const Eigen::VectorXd& x, Eigen::VectorXd& gradient,
                 Eigen::MatrixXd& hessian) const {
    const Pose pose = pose_of_vector(x);
    const Points at = marker_positions(markers_, forward_kinematics(skeleton_, pose));
    Eigen::MatrixXd jacobian = marker_positions_jacobian(skeleton_, pose, markers_);
    Eigen::VectorXd residual(jacobian.rows());
    for (Index m = 0; m < at.rows(); ++m) {
      const Eigen::Vector3d gap = (at.row(m) - targets_.row(m)).transpose();
      const double distance = gap.norm();
      const double weight = !seen_[static_cast<std::size_t>(m)] ? 0
                            : distance > options_.outlier ? std::sqrt(options_.outlier / distance)
                                                          : 1;
      residual.segment<3>(3 * m) = weight / options_.noise * gap;
      jacobian.middleRows(3 * m, 3) *= weight / options_.noise;
    }
    const double rest = 1 / (options_.rest_pull * options_.rest_pull);
    const double hold = 1 / (options_.hold_pull * options_.hold_pull);
    hessian = jacobian.transpose() * jacobian;
    hessian.diagonal() += rest * pull_;
    hessian.diagonal().tail(x.size() - 3).array() += hold;
    gradient = jacobian.transpose() * residual + rest * pull_.cwiseProduct(x);
    gradient.tail(x.size() - 3) += hold * (x - start_).tail(x.size() - 3);
  }

  double low(Index i) const { return limited(i) ? skeleton_.limits_min(i / 3 - 1, i % 3) : -1e9; }
  double high(Index i) const { return limited(i) ? skeleton_.limits_max(i / 3 - 1, i % 3) : 1e9; }

  double rms(const Eigen::VectorXd& x) const {
    const Points at = marker_positions(markers_, forward_kinematics(skeleton_, pose_of_vector(x)));
    double sum = 0;
    int count = 0;
    for (Index m = 0; m < at.rows(); ++m) {
      if (seen_[static_cast<std::size_t>(m)]) {
        sum += (at.row(m) - targets_.row(m)).squaredNorm();
        ++count;
      }
    }
    return count > 0 ? std::sqrt(sum / count) : 0;
  }

 private:
  bool limited(Index i) const {
    return options_.limits && i >= 6 && skeleton_.limits_min.rows() > 0;
  }

  const Skeleton& skeleton_;
  const RidingMarkers& markers_;
  const Points& targets_;
  const std::vector<bool>& seen_;
  const MarkerPoseOptions& options_;
  Eigen::VectorXd start_;
  Eigen::VectorXd pull_;
};

}  // namespace

Points marker_positions(const RidingMarkers& markers, const JointFrames& frames) {
  Points at(markers.offsets.rows(), 3);
  for (Index m = 0; m < at.rows(); ++m) {
    const int joint = markers.joints[static_cast<std::size_t>(m)];
    const Eigen::Vector3d offset = markers.offsets.row(m);
    at.row(m) = frames.positions.row(joint) +
                (frames.rotations[static_cast<std::size_t>(joint)] * offset).transpose();
  }
  return at;
}

Eigen::MatrixXd marker_positions_jacobian(const Skeleton& skeleton, const Pose& pose,
                                          const RidingMarkers& markers) {
  const JointFrames frames = forward_kinematics(skeleton, pose);
  const std::vector<Eigen::Matrix3d> bases = joint_velocity_bases(skeleton, pose, frames);
  const Points at = marker_positions(markers, frames);
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(3 * at.rows(), pose_parameter_count(skeleton));
  for (Index m = 0; m < at.rows(); ++m) {
    jacobian.block<3, 3>(3 * m, 0).setIdentity();
    for (int joint = markers.joints[static_cast<std::size_t>(m)]; joint >= 0;
         joint = skeleton.parents[static_cast<std::size_t>(joint)]) {
      const Eigen::Vector3d arm = (at.row(m) - frames.positions.row(joint)).transpose();
      jacobian.block<3, 3>(3 * m, 3 + 3 * joint) =
          -cross_matrix(arm) * bases[static_cast<std::size_t>(joint)];
    }
  }
  return jacobian;
}

MarkerPose fit_pose(const Skeleton& skeleton, const RidingMarkers& markers, const Points& targets,
                    const std::vector<bool>& seen, const Pose& start,
                    const MarkerPoseOptions& options) {
  ATELIER_CHECK(markers.offsets.rows() == static_cast<Index>(markers.joints.size()) &&
                    targets.rows() == markers.offsets.rows() &&
                    seen.size() == markers.joints.size(),
                "markers, their targets and what was seen have one size");
  Pose begin = start;
  // A rotation vector beyond half a turn runs into its singularity at a full one.
  begin.rotations.row(0) = rotation_vector(rotation_matrix(start.rotations.row(0)));
  const Problem problem(skeleton, markers, targets, seen, begin, options);
  Eigen::VectorXd x = pose_vector(begin);
  for (Index i = 0; i < x.size(); ++i) {
    x[i] = std::clamp(x[i], problem.low(i), problem.high(i));
  }
  double cost = problem.cost(x);
  double damping = 1e-3;
  MarkerPose result;
  Eigen::VectorXd gradient;
  Eigen::MatrixXd hessian;
  bool fresh = true;
  while (result.iterations < options.iterations && !result.converged) {
    ++result.iterations;
    if (fresh) {
      problem.linearise(x, gradient, hessian);
      // Angles at a limit that push against it stay there.
      for (Index i = 0; i < x.size(); ++i) {
        if ((x[i] <= problem.low(i) && gradient[i] > 0) ||
            (x[i] >= problem.high(i) && gradient[i] < 0)) {
          gradient[i] = 0;
          hessian.row(i).setZero();
          hessian.col(i).setZero();
          hessian(i, i) = 1;
        }
      }
    }
    Eigen::MatrixXd damped = hessian;
    damped.diagonal() *= 1 + damping;
    damped.diagonal().array() += 1e-9;
    Eigen::VectorXd next = x - damped.ldlt().solve(gradient);
    for (Index i = 0; i < x.size(); ++i) {
      next[i] = std::clamp(next[i], problem.low(i), problem.high(i));
    }
    const double step = (next - x).cwiseAbs().maxCoeff();
    const double tried = problem.cost(next);
    fresh = tried < cost;
    if (fresh) {
      x = next;
      cost = tried;
      damping = std::max(damping / 5, 1e-9);
    } else {
      damping *= 4;
    }
    result.converged = step < kStill || damping > 1e10;
  }
  result.pose = pose_of_vector(x);
  result.rms = problem.rms(x);
  return result;
}

}  // namespace atelier
