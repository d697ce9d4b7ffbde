#include "bodymodel/euler.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"

namespace atelier {
namespace {

int axis_of(char letter) {
  return letter - 'X';
}

void check_order(const std::string& order) {
  bool valid = order.size() == 3;
  for (const char letter : order) {
    valid = valid && letter >= 'X' && letter <= 'Z';
  }
  valid = valid && order[0] != order[1] && order[1] != order[2] && order[0] != order[2];
  ATELIER_CHECK(valid, "unknown rotation order " + order);
}

}  // namespace

Eigen::Matrix3d axis_rotation(int axis, double angle) {
  const int a = (axis + 1) % 3;
  const int b = (axis + 2) % 3;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  rotation(a, a) = rotation(b, b) = std::cos(angle);
  rotation(a, b) = -std::sin(angle);
  rotation(b, a) = std::sin(angle);
  return rotation;
}

Eigen::Vector3d euler_angles(const std::string& order, const Eigen::Matrix3d& rotation) {
  check_order(order);
  const int i = axis_of(order[0]);
  const int j = axis_of(order[1]);
  const int k = axis_of(order[2]);
  const double sign = (i + 1) % 3 == j ? 1 : -1;  // even or odd order
  const double cosine = std::hypot(rotation(i, i), rotation(i, j));
  const double middle = std::atan2(sign * rotation(i, k), cosine);
  if (cosine < 1e-9) {
    return {std::atan2(sign * rotation(k, j), rotation(j, j)), middle, 0};
  }
  return {std::atan2(-sign * rotation(j, k), rotation(k, k)), middle,
          std::atan2(-sign * rotation(i, j), rotation(i, i))};
}

Eigen::Vector3d euler_angles(const std::string& order, const Eigen::Matrix3d& rotation,
                             const Eigen::Vector3d& near) {
  const Eigen::Vector3d first = euler_angles(order, rotation);
  const Eigen::Vector3d second(first[0] + std::numbers::pi, std::numbers::pi - first[1],
                               first[2] + std::numbers::pi);
  Eigen::Vector3d best = first;
  double least = -1;
  for (Eigen::Vector3d angles : {first, second}) {
    for (int i = 0; i < 3; ++i) {
      angles[i] +=
          2 * std::numbers::pi * std::round((near[i] - angles[i]) / (2 * std::numbers::pi));
    }
    const double off = (angles - near).cwiseAbs().sum();
    if (least < 0 || off < least) {
      least = off;
      best = angles;
    }
  }
  return best;
}

}  // namespace atelier
