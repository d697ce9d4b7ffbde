#include "capture/keep_distances.h"

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "core/median.h"
#include "core/parallel.h"

namespace atelier {
namespace {

constexpr std::size_t kMinFrames = 6;
constexpr double kMinScatter = 0.002;      // m, of a distance that bodies keep
constexpr double kSigmaOfMedian = 1.4826;  // standard deviation by the median deviation
constexpr double kMinDeviation = 0.0005;   // m, of a point in space
constexpr int kRefinements = 4;

struct KeptDistance {
  std::size_t a, b;  // points of the schema
  double length;     // m
  double scatter;    // m
};

using PointPair = std::pair<std::size_t, std::size_t>;

/// Pairs of points between which bodies keep their distance, as far as the schema has them.
std::vector<PointPair> kept_pairs(const KeypointSchema& schema) {
  std::vector<PointPair> pairs;
  const auto join = [&](const std::string& a, const std::string& b) {
    const int i = find_keypoint(schema, a);
    const int j = find_keypoint(schema, b);
    if (i >= 0 && j >= 0) {
      pairs.emplace_back(i, j);
    }
  };
  const auto join_all = [&](const std::vector<std::string>& names) {
    for (std::size_t i = 0; i < names.size(); ++i) {
      for (std::size_t j = i + 1; j < names.size(); ++j) {
        join(names[i], names[j]);
      }
    }
  };
  for (const std::string side : {"left_", "right_"}) {
    join(side + "shoulder", side + "elbow");
    join(side + "elbow", side + "wrist");
    join(side + "hip", side + "knee");
    join(side + "knee", side + "ankle");
    join("neck", side + "shoulder");
    join_all(
        {side + "ankle", side + "heel", side + "big_toe", side + "small_toe", side + "foot_index"});
  }
  join_all({"left_hip", "mid_hip", "right_hip"});
  join_all({"nose", "left_eye", "right_eye", "left_ear", "right_ear"});
  return pairs;
}

bool is_found(const SpacePoint& point) {
  return point.confidence > 0 && !point.bridged;
}

Eigen::Matrix3d covariance_of(const SpacePoint& point) {
  return point.covariance + kMinDeviation * kMinDeviation * Eigen::Matrix3d::Identity();
}

std::vector<KeptDistance> kept_distances(const std::vector<SpacePose>& frames,
                                         const std::vector<PointPair>& pairs) {
  std::vector<KeptDistance> kept;
  for (const auto& [a, b] : pairs) {
    std::vector<double> lengths;
    std::vector<double> variances;  // of each, by those of its ends
    double sum = 0;
    double weights = 0;
    for (const SpacePose& pose : frames) {
      const SpacePoint& from = pose.points[a];
      const SpacePoint& to = pose.points[b];
      const Eigen::Vector3d along = to.place - from.place;
      const double length = along.norm();
      if (!is_found(from) || !is_found(to) || !(length > 0)) {
        continue;
      }
      const double variance =
          along.dot((covariance_of(from) + covariance_of(to)) * along) / (length * length);
      lengths.push_back(length);
      variances.push_back(variance);
      sum += length / variance;
      weights += 1 / variance;
    }
    if (lengths.size() < kMinFrames) {
      continue;
    }
    const double mean = sum / weights;
    std::vector<double> deviations;
    deviations.reserve(lengths.size());
    for (const double length : lengths) {
      deviations.push_back(std::abs(length - mean));
    }
    const double scatter = kSigmaOfMedian * median(deviations);
    const double own = scatter * scatter - median(variances);
    kept.push_back({a, b, mean, std::sqrt(std::max(own, 0.0) + kMinScatter * kMinScatter)});
  }
  return kept;
}

void settle(SpacePose& pose, const std::vector<KeptDistance>& distances) {
  std::vector<Index> column(pose.points.size(), -1);
  std::vector<std::size_t> found;
  for (std::size_t k = 0; k < pose.points.size(); ++k) {
    if (is_found(pose.points[k])) {
      column[k] = static_cast<Index>(3 * found.size());
      found.push_back(k);
    }
  }
  const auto size = static_cast<Index>(3 * found.size());
  std::vector<Eigen::Vector3d> places;
  Eigen::MatrixXd certain = Eigen::MatrixXd::Zero(size, size);
  for (const std::size_t k : found) {
    certain.block<3, 3>(column[k], column[k]) = covariance_of(pose.points[k]).inverse();
  }
  Eigen::VectorXd moved = Eigen::VectorXd::Zero(size);
  const auto place = [&](std::size_t k) {
    return Eigen::Vector3d(pose.points[k].place + moved.segment<3>(column[k]));
  };
  Eigen::MatrixXd normal;
  for (int step = 0; step < kRefinements; ++step) {
    normal = certain;
    Eigen::VectorXd right = -certain * moved;
    for (const KeptDistance& distance : distances) {
      if (column[distance.a] < 0 || column[distance.b] < 0) {
        continue;
      }
      const Eigen::Vector3d along = place(distance.b) - place(distance.a);
      const double length = along.norm();
      if (!(length > 0)) {
        continue;
      }
      const Eigen::Vector3d direction = along / length;
      const double weight = 1 / (distance.scatter * distance.scatter);
      const Eigen::Matrix3d block = weight * direction * direction.transpose();
      const Eigen::Vector3d pull = weight * (distance.length - length) * direction;
      const Index i = column[distance.a];
      const Index j = column[distance.b];
      normal.block<3, 3>(i, i) += block;
      normal.block<3, 3>(j, j) += block;
      normal.block<3, 3>(i, j) -= block;
      normal.block<3, 3>(j, i) -= block;
      right.segment<3>(i) -= pull;
      right.segment<3>(j) += pull;
    }
    moved += normal.ldlt().solve(right);
  }
  const Eigen::MatrixXd covariance = normal.inverse();
  if (!moved.allFinite() || !covariance.allFinite()) {
    return;
  }
  for (const std::size_t k : found) {
    pose.points[k].place += moved.segment<3>(column[k]);
    pose.points[k].covariance = covariance.block<3, 3>(column[k], column[k]);
  }
}

}  // namespace

void keep_distances(std::vector<SpacePose>& frames, const KeypointSchema& schema) {
  const std::vector<KeptDistance> distances = kept_distances(frames, kept_pairs(schema));
  if (distances.empty()) {
    return;
  }
  parallel_for(static_cast<Index>(frames.size()), 1, [&](Index begin, Index end) {
    for (Index f = begin; f < end; ++f) {
      settle(frames[static_cast<std::size_t>(f)], distances);
    }
  });
}

}  // namespace atelier
