#include "bodymodel/rotation.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace atelier {
namespace {

constexpr double kSeries = 1e-3;  // below this angle the series are exact to double precision

// The scalar functions of t = |r| that every formula here is made of.
struct Coefficients {
  double sinc;  // sin t / t
  double cosc;  // (1 - cos t) / t^2
  double sinm;  // (t - sin t) / t^3
};

Coefficients coefficients(double t) {
  const double q = t * t;
  if (t < kSeries) {
    return {1 - q / 6 * (1 - q / 20), 0.5 - q / 24 * (1 - q / 30),
            1.0 / 6 - q / 120 * (1 - q / 42)};
  }
  const double half = std::sin(t / 2);
  return {std::sin(t) / t, 2 * half * half / q, (t - std::sin(t)) / (q * t)};
}

}  // namespace

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& a) {
  Eigen::Matrix3d m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

Eigen::Matrix3d rotation_matrix(const Eigen::Vector3d& r) {
  const Coefficients c = coefficients(r.norm());
  const Eigen::Matrix3d k = cross_matrix(r);
  return Eigen::Matrix3d::Identity() + c.sinc * k + c.cosc * (k * k);
}

Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& r) {
  const Coefficients c = coefficients(r.norm());
  const Eigen::Matrix3d k = cross_matrix(r);
  return Eigen::Matrix3d::Identity() + c.cosc * k + c.sinm * (k * k);
}

std::array<Eigen::Matrix3d, 3> rotation_matrix_jacobian(const Eigen::Vector3d& r) {
  const Eigen::Matrix3d rotation = rotation_matrix(r);
  const Eigen::Matrix3d left = left_jacobian(r);
  return {cross_matrix(left.col(0)) * rotation, cross_matrix(left.col(1)) * rotation,
          cross_matrix(left.col(2)) * rotation};
}

Eigen::Vector4d quaternion_of(const Eigen::Vector3d& r) {
  const double t = r.norm();
  const double s = 0.5 * coefficients(t / 2).sinc;
  return {s * r.x(), s * r.y(), s * r.z(), std::cos(t / 2)};
}

Eigen::Matrix<double, 4, 3> quaternion_jacobian(const Eigen::Vector3d& r) {
  // With s(t) = sin(t/2)/t: d(s r)/dr = s I + (s'/t) r r^T and dw/dr = -s r / 2.
  const double t = r.norm();
  const double q = t * t;
  const double s = 0.5 * coefficients(t / 2).sinc;
  const double slope = t < kSeries ? -1.0 / 24 + q / 960 : (0.5 * std::cos(t / 2) - s) / q;
  Eigen::Matrix<double, 4, 3> jacobian;
  jacobian.topRows<3>() = s * Eigen::Matrix3d::Identity() + slope * r * r.transpose();
  jacobian.row(3) = -0.5 * s * r.transpose();
  return jacobian;
}

Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation) {
  const Eigen::Vector4d q = quaternion_of_matrix(rotation);
  const double sine = q.head<3>().norm();
  if (sine < 1e-12) {
    return 2 * q.head<3>();
  }
  return 2 * std::atan2(sine, q.w()) / sine * q.head<3>();
}

Eigen::Matrix3d matrix_of_quaternion(const Eigen::Vector4d& quaternion) {
  return Eigen::Quaterniond(quaternion.w(), quaternion.x(), quaternion.y(), quaternion.z())
      .toRotationMatrix();
}

Eigen::Vector4d quaternion_of_matrix(const Eigen::Matrix3d& rotation) {
  Eigen::Quaterniond q(rotation);
  q.normalize();
  const double sign = q.w() < 0 ? -1 : 1;
  return sign * q.coeffs();
}

Eigen::Matrix3d rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d a = from.normalized();
  const Eigen::Vector3d b = to.normalized();
  const double w = 1 + a.dot(b);
  Eigen::Vector4d q;
  if (w < 1e-10) {
    q << a.unitOrthogonal(), 0;
  } else {
    q << a.cross(b), w;
  }
  return matrix_of_quaternion(q.normalized());
}

Eigen::Vector3d nearest_equivalent(const Eigen::Vector3d& r, const Eigen::Vector3d& near) {
  const double t = r.norm();
  Eigen::Vector3d axis;
  if (t < 1e-9) {
    // No rotation: any axis serves, so the one that `near` turns about.
    if (near.norm() < std::numbers::pi) {
      return r;
    }
    axis = near.normalized();
  } else {
    axis = r / t;
  }
  const double turns = std::round((axis.dot(near) - t) / (2 * std::numbers::pi));
  return (t + 2 * std::numbers::pi * turns) * axis;
}

}  // namespace atelier
