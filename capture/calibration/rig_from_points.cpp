#include "capture/calibration/rig_from_points.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <opencv2/calib3d.hpp>
#include <optional>
#include <utility>

#include <ceres/ceres.h>

#include "capture/calibration/lens.h"
#include "core/error.h"
#include "core/median.h"

namespace atelier {
namespace {

using Vector2 = Eigen::Vector2d;
using Vector3 = Eigen::Vector3d;

constexpr double kMinAngle = 0.052;  // rad: rays less apart than that place no point

/// What is found step by step.
struct Growing {
  std::vector<Camera> cameras;
  std::vector<PointSight> sights;
  std::vector<std::optional<Vector2>> flat;        ///< of each sight, on the plane z = 1
  std::vector<std::vector<std::size_t>> of_point;  ///< sights of each point
  std::vector<bool> in_rig;
  std::vector<RigidNumbers> poses;  ///< camera_from_world
  std::vector<Vector3> points;
  std::vector<bool> placed;  ///< of each point
  std::vector<bool> used;    ///< of each sight
  double tolerance = 0;      ///< px of an image 1000 rows high

  double pixels(std::size_t camera) const { return tolerance * cameras[camera].height / 1000.0; }
  std::size_t camera_of(std::size_t sight) const {
    return static_cast<std::size_t>(sights[sight].camera_idx);
  }
};

Growing start_of(const std::vector<Camera>& cameras, const std::vector<PointSight>& sights,
                 const PointRigOptions& options) {
  Growing state;
  state.cameras = cameras;
  state.sights = sights;
  state.tolerance = options.tolerance;
  state.in_rig.assign(cameras.size(), false);
  state.poses.assign(cameras.size(), RigidNumbers::Zero());
  for (Camera& camera : state.cameras) {
    camera.camera_from_world_rotation.setIdentity();
    camera.camera_from_world_translation.setZero();
  }
  int most = -1;
  for (const PointSight& sight : sights) {
    ATELIER_CHECK(sight.camera_idx >= 0 && sight.camera_idx < static_cast<int>(cameras.size()) &&
                      sight.point >= 0,
                  "a sight of what is not there");
    most = std::max(most, sight.point);
  }
  state.of_point.resize(static_cast<std::size_t>(most + 1));
  state.points.assign(state.of_point.size(), Vector3::Zero());
  state.placed.assign(state.of_point.size(), false);
  state.used.assign(sights.size(), false);
  for (std::size_t i = 0; i < sights.size(); ++i) {
    const auto ray = ray_direction(state.cameras[state.camera_of(i)], sights[i].pixel);
    state.flat.push_back(ray && ray->z() > 0.05 ? std::optional<Vector2>(ray->head<2>() / ray->z())
                                                : std::nullopt);
    if (state.flat.back()) {
      state.of_point[static_cast<std::size_t>(sights[i].point)].push_back(i);
    }
  }
  return state;
}

cv::Point2d point_of(const Vector2& v) {
  return {v.x(), v.y()};
}

Eigen::Matrix3d matrix_of(const cv::Mat& m) {
  Eigen::Matrix3d result;
  for (int i = 0; i < 9; ++i) {
    result(i / 3, i % 3) = m.at<double>(i / 3, i % 3);
  }
  return result;
}

/// The pose of camera b as a sees it, one apart.
struct Pair {
  RigidNumbers b_from_a = RigidNumbers::Zero();
  double score = 0;  ///< points that agree, less where their rays are nearly parallel
};

Pair pair_of(const Growing& state, std::size_t a, std::size_t b, int min_shared) {
  std::vector<cv::Point2d> in_a;
  std::vector<cv::Point2d> in_b;
  for (const auto& sights : state.of_point) {
    const auto of = [&](std::size_t c) {
      return std::find_if(sights.begin(), sights.end(),
                          [&](std::size_t i) { return state.camera_of(i) == c; });
    };
    if (of(a) != sights.end() && of(b) != sights.end()) {
      in_a.push_back(point_of(*state.flat[*of(a)]));
      in_b.push_back(point_of(*state.flat[*of(b)]));
    }
  }
  Pair pair;
  if (static_cast<int>(in_a.size()) < min_shared) {
    return pair;
  }
  const double flat =
      0.5 * (state.pixels(a) / state.cameras[a].fx + state.pixels(b) / state.cameras[b].fx);
  cv::Mat inside;
  const cv::Mat essential = cv::findEssentialMat(in_a, in_b, cv::Mat::eye(3, 3, CV_64F), cv::RANSAC,
                                                 0.9999, flat, inside);
  if (essential.rows != 3 || essential.cols != 3) {
    return pair;
  }
  cv::Mat rotation;
  cv::Mat translation;
  const int agreeing = cv::recoverPose(essential, in_a, in_b, cv::Mat::eye(3, 3, CV_64F), rotation,
                                       translation, inside);
  if (agreeing < min_shared) {
    return pair;
  }
  const Eigen::Matrix3d turn = matrix_of(rotation);
  pair.b_from_a = rigid_of(turn, Vector3(translation.at<double>(0), translation.at<double>(1),
                                         translation.at<double>(2)));
  std::vector<double> angles;
  for (std::size_t i = 0; i < in_a.size(); ++i) {
    if (inside.at<std::uint8_t>(static_cast<int>(i)) != 0) {
      const Vector3 from_a = turn * Vector3(in_a[i].x, in_a[i].y, 1);
      const Vector3 from_b(in_b[i].x, in_b[i].y, 1);
      angles.push_back(std::atan2(from_a.cross(from_b).norm(), from_a.dot(from_b)));
    }
  }
  const double angle = median(angles);
  constexpr double kWide = 0.35;  // rad: wider apart is no better
  pair.score = angle < kMinAngle ? 0 : agreeing * std::min(1.0, angle / kWide);
  return pair;
}

std::optional<double> error_of(const Growing& state, std::size_t sight, const Vector3& point) {
  const std::size_t c = state.camera_of(sight);
  const auto pixel = lens_pixel(state.cameras[c].distortion_model, lens_of(state.cameras[c]),
                                moved(state.poses[c], point));
  return pixel ? std::optional<double>((*pixel - state.sights[sight].pixel).norm()) : std::nullopt;
}

/// Where two rays of the rig pass most closely, in front of both; nothing where they are nearly
/// parallel.
std::optional<Vector3> meeting(const Growing& state, std::size_t i, std::size_t j) {
  const auto ray = [&](std::size_t sight) {
    const RigidNumbers& pose = state.poses[state.camera_of(sight)];
    const Eigen::Matrix3d back = rotation_of(pose).transpose();
    const Vector3 direction =
        back * Vector3(state.flat[sight]->x(), state.flat[sight]->y(), 1).normalized();
    return std::pair<Vector3, Vector3>(-back * pose.tail<3>(), direction);
  };
  const auto [a, u] = ray(i);
  const auto [b, v] = ray(j);
  const double cosine = u.dot(v);
  const double sine2 = 1 - cosine * cosine;
  if (sine2 < kMinAngle * kMinAngle) {
    return std::nullopt;
  }
  const Vector3 offset = b - a;
  const double s = (offset.dot(u) - offset.dot(v) * cosine) / sine2;
  const double t = (offset.dot(u) * cosine - offset.dot(v)) / sine2;
  return s > 0 && t > 0 ? std::optional<Vector3>(0.5 * (a + s * u + b + t * v)) : std::nullopt;
}

/// Places every point anew by the pair of rays that most cameras of the rig agree with.
void place_points(Growing& state) {
  for (std::size_t p = 0; p < state.points.size(); ++p) {
    std::vector<std::size_t> inside;
    for (const std::size_t i : state.of_point[p]) {
      state.used[i] = false;
      if (state.in_rig[state.camera_of(i)]) {
        inside.push_back(i);
      }
    }
    const auto agree = [&](const Vector3& point) {
      double sum = 0;
      for (const std::size_t i : inside) {
        const double share =
            error_of(state, i, point).value_or(1e9) / state.pixels(state.camera_of(i));
        sum += std::max(0.0, 1 - share * share);
      }
      return sum;
    };
    double best = state.placed[p] ? agree(state.points[p]) : 0;
    for (std::size_t i = 0; i < inside.size(); ++i) {
      for (std::size_t j = i + 1; j < inside.size(); ++j) {
        const auto point = meeting(state, inside[i], inside[j]);
        const double sum = point ? agree(*point) : 0;
        if (sum > best) {
          best = sum;
          state.points[p] = *point;
        }
      }
    }
    int views = 0;
    for (const std::size_t i : inside) {
      state.used[i] =
          error_of(state, i, state.points[p]).value_or(1e9) < state.pixels(state.camera_of(i));
      views += state.used[i] ? 1 : 0;
    }
    state.placed[p] = best > 0 && views >= 2;
    for (const std::size_t i : inside) {
      state.used[i] = state.used[i] && state.placed[p];
    }
  }
}

/// A sight of a point by a camera whose lens is known.
class PointCost final : public ceres::SizedCostFunction<2, 6, 3> {
 public:
  PointCost(Distortion model, LensNumbers lens, Vector2 pixel)
      : model_(model), lens_(std::move(lens)), pixel_(std::move(pixel)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const RigidNumbers pose(parameters[0]);
    const Vector3 point(parameters[1]);
    const Vector3 in_camera = moved(pose, point);
    const auto pixel = lens_pixel(model_, lens_, in_camera);
    if (in_camera.z() < 1e-6 || !pixel) {
      return false;  // the solver takes a shorter step
    }
    Eigen::Map<Vector2> error(residuals);
    error = *pixel - pixel_;
    if (jacobians != nullptr) {
      const auto by_point = lens_jacobian(model_, lens_, in_camera).by_point;
      if (jacobians[0] != nullptr) {
        Eigen::Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> by_pose(jacobians[0]);
        by_pose = by_point * moved_jacobian(pose, point);
      }
      if (jacobians[1] != nullptr) {
        Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> by_place(jacobians[1]);
        by_place = by_point * rotation_of(pose);
      }
    }
    return true;
  }

 private:
  Distortion model_;
  LensNumbers lens_;
  Vector2 pixel_;
};

/// Poses and points together; the root stays where it is. True if it came to an end.
bool adjust_points(Growing& state, std::size_t root) {
  ceres::Problem problem;
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (std::size_t i = 0; i < state.sights.size(); ++i) {
    if (!state.used[i]) {
      continue;
    }
    const std::size_t c = state.camera_of(i);
    double* pose = state.poses[c].data();
    double* point = state.points[static_cast<std::size_t>(state.sights[i].point)].data();
    problem.AddResidualBlock(new PointCost(state.cameras[c].distortion_model,
                                           lens_of(state.cameras[c]), state.sights[i].pixel),
                             new ceres::CauchyLoss(0.5 * state.pixels(c)), pose, point);
    ordering->AddElementToGroup(point, 0);
    ordering->AddElementToGroup(pose, 1);
  }
  if (!problem.HasParameterBlock(state.poses[root].data())) {
    return false;
  }
  problem.SetParameterBlockConstant(state.poses[root].data());
  ceres::Solver::Options solver;
  solver.num_threads = 1;  // the same bits everywhere
  solver.max_num_iterations = 100;
  solver.linear_solver_type = ceres::DENSE_SCHUR;
  solver.linear_solver_ordering = ordering;
  solver.function_tolerance = 1e-9;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  return summary.termination_type == ceres::CONVERGENCE;
}

/// The camera outside the rig that sees most of its points, and its pose by them; nothing where no
/// camera sees enough.
std::optional<std::size_t> add_camera(Growing& state, int min_shared) {
  std::vector<std::pair<int, std::size_t>> by_count;
  for (std::size_t c = 0; c < state.cameras.size(); ++c) {
    int count = 0;
    for (std::size_t i = 0; i < state.sights.size() && !state.in_rig[c]; ++i) {
      count += state.camera_of(i) == c && state.flat[i] &&
                       state.placed[static_cast<std::size_t>(state.sights[i].point)]
                   ? 1
                   : 0;
    }
    by_count.emplace_back(-count, c);
  }
  std::sort(by_count.begin(), by_count.end());
  for (const auto& [count, c] : by_count) {
    if (-count < min_shared) {
      break;
    }
    std::vector<cv::Point3d> places;
    std::vector<cv::Point2d> flat;
    for (std::size_t i = 0; i < state.sights.size(); ++i) {
      const auto p = static_cast<std::size_t>(state.sights[i].point);
      if (state.camera_of(i) == c && state.flat[i] && state.placed[p]) {
        places.emplace_back(state.points[p].x(), state.points[p].y(), state.points[p].z());
        flat.push_back(point_of(*state.flat[i]));
      }
    }
    cv::Mat rotation;
    cv::Mat translation;
    std::vector<int> inside;
    const auto tolerance = static_cast<float>(state.pixels(c) / state.cameras[c].fx);
    if (cv::solvePnPRansac(places, flat, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), rotation,
                           translation, false, 500, tolerance, 0.9999, inside,
                           cv::SOLVEPNP_SQPNP) &&
        static_cast<int>(inside.size()) >= min_shared) {
      for (int k = 0; k < 3; ++k) {
        state.poses[c][k] = rotation.at<double>(k);
        state.poses[c][3 + k] = translation.at<double>(k);
      }
      return c;
    }
  }
  return std::nullopt;
}

/// The normal matrix of the poses, points eliminated; weights by sigma alone.
Eigen::MatrixXd reduced_normal(const Growing& state) {
  const auto size = static_cast<Eigen::Index>(6 * state.cameras.size());
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(size, size);
  for (std::size_t p = 0; p < state.points.size(); ++p) {
    if (!state.placed[p]) {
      continue;
    }
    Eigen::Matrix3d own = Eigen::Matrix3d::Zero();
    std::map<Eigen::Index, Eigen::Matrix<double, 6, 3>> mixed;
    for (const std::size_t i : state.of_point[p]) {
      if (!state.used[i]) {
        continue;
      }
      const std::size_t c = state.camera_of(i);
      const Eigen::Matrix<double, 2, 3> by_point =
          lens_jacobian(state.cameras[c].distortion_model, lens_of(state.cameras[c]),
                        moved(state.poses[c], state.points[p]))
              .by_point;
      const Eigen::Matrix<double, 2, 6> by_pose =
          by_point * moved_jacobian(state.poses[c], state.points[p]);
      const Eigen::Matrix<double, 2, 3> by_place = by_point * rotation_of(state.poses[c]);
      const auto at = static_cast<Eigen::Index>(6 * c);
      own += by_place.transpose() * by_place;
      normal.block<6, 6>(at, at) += by_pose.transpose() * by_pose;
      mixed[at] = by_pose.transpose() * by_place;
    }
    const Eigen::Matrix3d inverse = own.inverse();
    for (const auto& [a, from_a] : mixed) {
      for (const auto& [b, from_b] : mixed) {
        normal.block<6, 6>(a, b) -= from_a * inverse * from_b.transpose();
      }
    }
  }
  return normal;
}

/// Covariances of the poses where the root is the world and `second` is one apart from it.
std::vector<Eigen::Matrix<double, 6, 6>> covariances(const Growing& state, std::size_t root,
                                                     std::size_t second, double sigma) {
  Eigen::MatrixXd normal = reduced_normal(state);
  // What is fixed, and cameras outside the rig, by weights that leave nothing open.
  const double fixed = 1e6 * std::max(1.0, normal.diagonal().maxCoeff());
  for (std::size_t c = 0; c < state.cameras.size(); ++c) {
    if (c == root || !state.in_rig[c]) {
      const auto at = static_cast<Eigen::Index>(6 * c);
      normal.block<6, 6>(at, at) += fixed * Eigen::Matrix<double, 6, 6>::Identity();
    }
  }
  const auto at = static_cast<Eigen::Index>(6 * second + 3);
  const Vector3 baseline = state.poses[second].tail<3>().normalized();
  normal.block<3, 3>(at, at) += fixed * baseline * baseline.transpose();
  const Eigen::MatrixXd covariance =
      normal.ldlt().solve(Eigen::MatrixXd::Identity(normal.rows(), normal.cols()));
  std::vector<Eigen::Matrix<double, 6, 6>> result;
  for (std::size_t c = 0; c < state.cameras.size(); ++c) {
    const auto own = static_cast<Eigen::Index>(6 * c);
    result.emplace_back(
        state.in_rig[c] && c != root
            ? Eigen::Matrix<double, 6, 6>(sigma * sigma * covariance.block<6, 6>(own, own))
            : Eigen::Matrix<double, 6, 6>(Eigen::Matrix<double, 6, 6>::Zero()));
  }
  return result;
}

/// What was found, in the unit of length that the two cameras give.
PointRig result_of(Growing& state, std::size_t root, std::size_t second) {
  const double unit = state.poses[second].tail<3>().norm();
  for (RigidNumbers& pose : state.poses) {
    pose.tail<3>() /= unit;
  }
  for (Vector3& point : state.points) {
    point /= unit;
  }
  PointRig rig;
  rig.in_rig = state.in_rig;
  rig.cameras = state.cameras;
  rig.shared.assign(state.cameras.size(), 0);
  double sum = 0;
  double freedom = 0;  // numbers measured less numbers found
  for (std::size_t i = 0; i < state.sights.size(); ++i) {
    rig.errors.push_back(std::numeric_limits<double>::quiet_NaN());
    if (state.used[i]) {
      const auto p = static_cast<std::size_t>(state.sights[i].point);
      rig.errors.back() = error_of(state, i, state.points[p]).value_or(1e6);
      sum += rig.errors.back() * rig.errors.back();
      freedom += 2;
      ++rig.shared[state.camera_of(i)];
    }
  }
  for (std::size_t p = 0; p < state.points.size(); ++p) {
    rig.points.push_back(state.placed[p]
                             ? state.points[p]
                             : Vector3::Constant(std::numeric_limits<double>::quiet_NaN()));
    freedom -= state.placed[p] ? 3 : 0;
  }
  for (std::size_t c = 0; c < state.cameras.size(); ++c) {
    if (state.in_rig[c]) {
      freedom -= c == root ? 0 : 6;
      rig.cameras[c].camera_from_world_rotation = rotation_of(state.poses[c]);
      rig.cameras[c].camera_from_world_translation = state.poses[c].tail<3>();
    }
  }
  rig.sigma = std::sqrt(sum / std::max(freedom, 1.0));
  rig.pose_covariance = covariances(state, root, second, rig.sigma);
  return rig;
}

}  // namespace

PointRig rig_from_points(const std::vector<Camera>& cameras, const std::vector<PointSight>& sights,
                         const PointRigOptions& options) {
  Growing state = start_of(cameras, sights, options);
  Pair best;
  std::size_t root = 0;
  std::size_t second = 0;
  for (std::size_t a = 0; a < cameras.size(); ++a) {
    for (std::size_t b = a + 1; b < cameras.size(); ++b) {
      const Pair pair = pair_of(state, a, b, options.min_shared);
      if (pair.score > best.score) {
        best = pair;
        root = a;
        second = b;
      }
    }
  }
  if (best.score <= 0) {
    PointRig none;
    none.cameras = cameras;
    none.in_rig.assign(cameras.size(), false);
    none.shared.assign(cameras.size(), 0);
    none.pose_covariance.assign(cameras.size(), Eigen::Matrix<double, 6, 6>::Zero());
    none.points.assign(state.points.size(),
                       Vector3::Constant(std::numeric_limits<double>::quiet_NaN()));
    none.errors.assign(sights.size(), std::numeric_limits<double>::quiet_NaN());
    return none;
  }
  state.in_rig[root] = state.in_rig[second] = true;
  state.poses[second] = best.b_from_a;
  place_points(state);
  bool converged = adjust_points(state, root);
  place_points(state);
  while (const auto added = add_camera(state, options.min_shared)) {
    state.in_rig[*added] = true;
    place_points(state);
    converged = adjust_points(state, root);
    place_points(state);
  }
  // Which sights are used and where everything is depend on each other.
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    converged = adjust_points(state, root);
    place_points(state);
  }
  PointRig rig = result_of(state, root, second);
  rig.converged = converged;
  return rig;
}

}  // namespace atelier
