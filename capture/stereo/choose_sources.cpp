#include "capture/stereo/choose_sources.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace atelier {
namespace {

constexpr double kDegrees = 3.14159265358979323846 / 180;
constexpr double kBestAngle = 15 * kDegrees;
constexpr double kLargestAngle = 80 * kDegrees;

/// 1 at the best angle, falling fast below it and slowly above.
double usefulness(double angle) {
  const double width = angle < kBestAngle ? 6 * kDegrees : 25 * kDegrees;
  const double x = (angle - kBestAngle) / width;
  return std::exp(-0.5 * x * x);
}

}  // namespace

std::vector<std::vector<int>> choose_sources(const std::vector<Camera>& cameras,
                                             const Eigen::Vector3d& centre, int count) {
  std::vector<std::vector<int>> chosen(cameras.size());
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Eigen::Vector3d here = (camera_center(cameras[i]) - centre).normalized();
    std::vector<std::pair<double, int>> others;
    for (std::size_t j = 0; j < cameras.size(); ++j) {
      const Eigen::Vector3d there = (camera_center(cameras[j]) - centre).normalized();
      const double angle = std::atan2(here.cross(there).norm(), here.dot(there));
      if (j != i && angle < kLargestAngle) {
        others.emplace_back(-usefulness(angle), static_cast<int>(j));
      }
    }
    std::sort(others.begin(), others.end());
    for (const auto& [rank, j] : others) {
      if (static_cast<int>(chosen[i].size()) < count) {
        chosen[i].push_back(j);
      }
    }
  }
  return chosen;
}

Eigen::Vector3d looked_at(const std::vector<Camera>& cameras) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Camera& camera : cameras) {
    const Eigen::Vector3d axis = camera.camera_from_world_rotation.row(2).transpose();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - axis * axis.transpose();
    sum += across;
    right += across * camera_center(camera);
    mean += camera_center(camera) + axis;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(sum);
  if (cameras.size() < 2 || solver.eigenvalues()(0) < 1e-3 * static_cast<double>(cameras.size())) {
    return mean / static_cast<double>(std::max<std::size_t>(cameras.size(), 1));
  }
  return sum.ldlt().solve(right);
}

}  // namespace atelier
