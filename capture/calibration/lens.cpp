#include "capture/calibration/lens.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace atelier {
namespace {

using Vector2 = Eigen::Vector2d;
using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;

Matrix3 cross_matrix(const Vector3& v) {
  Matrix3 m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// Right Jacobian of the exponential map.
Matrix3 right_jacobian(const Vector3& r) {
  const double angle = r.norm();
  const Matrix3 k = cross_matrix(r);
  if (angle < 1e-4) {
    return Matrix3::Identity() - 0.5 * k + k * k / 6;
  }
  const double a2 = angle * angle;
  return Matrix3::Identity() - (1 - std::cos(angle)) / a2 * k +
         (angle - std::sin(angle)) / (a2 * angle) * k * k;
}

/// The bent direction, with its derivatives by the direction and by the eight numbers.
struct Bent {
  Vector2 point;
  Eigen::Matrix2d by_point;
  Eigen::Matrix<double, 2, 8> by_lens = Eigen::Matrix<double, 2, 8>::Zero();
};

Bent bend_brown(const LensNumbers& lens, const Vector2& p) {
  const double k1 = lens[4], k2 = lens[5], p1 = lens[6], p2 = lens[7], k3 = lens[8], k4 = lens[9],
               k5 = lens[10], k6 = lens[11];
  const double x = p.x(), y = p.y();
  const double r2 = x * x + y * y;
  const double r4 = r2 * r2;
  const double r6 = r4 * r2;
  const double numerator = 1 + k1 * r2 + k2 * r4 + k3 * r6;
  const double denominator = 1 + k4 * r2 + k5 * r4 + k6 * r6;
  const double radial = numerator / denominator;
  const double radial_r2 =
      ((k1 + 2 * k2 * r2 + 3 * k3 * r4) - radial * (k4 + 2 * k5 * r2 + 3 * k6 * r4)) / denominator;
  Bent bent;
  bent.point = {x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
                y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y};
  bent.by_point << radial + 2 * x * x * radial_r2 + 2 * p1 * y + 6 * p2 * x,
      2 * x * y * radial_r2 + 2 * p1 * x + 2 * p2 * y,
      2 * x * y * radial_r2 + 2 * p1 * x + 2 * p2 * y,
      radial + 2 * y * y * radial_r2 + 6 * p1 * y + 2 * p2 * x;
  const double over = 1 / denominator;
  bent.by_lens.col(0) = p * r2 * over;
  bent.by_lens.col(1) = p * r4 * over;
  bent.by_lens.col(2) << 2 * x * y, r2 + 2 * y * y;
  bent.by_lens.col(3) << r2 + 2 * x * x, 2 * x * y;
  bent.by_lens.col(4) = p * r6 * over;
  bent.by_lens.col(5) = -p * radial * r2 * over;
  bent.by_lens.col(6) = -p * radial * r4 * over;
  bent.by_lens.col(7) = -p * radial * r6 * over;
  return bent;
}

Bent bend_fisheye(const LensNumbers& lens, const Vector2& p) {
  Bent bent;
  const double r = p.norm();
  if (r < 1e-8) {
    bent.point = p;
    bent.by_point.setIdentity();
    return bent;
  }
  const double theta = std::atan(r);
  const double t2 = theta * theta;
  const double bent_theta =
      theta * (1 + t2 * (lens[4] + t2 * (lens[5] + t2 * (lens[6] + t2 * lens[7]))));
  const double slope =
      1 + t2 * (3 * lens[4] + t2 * (5 * lens[5] + t2 * (7 * lens[6] + t2 * 9 * lens[7])));
  const double scale = bent_theta / r;
  const double scale_r = (slope / (1 + r * r) - scale) / r;
  bent.point = scale * p;
  bent.by_point = scale * Eigen::Matrix2d::Identity() + (scale_r / r) * p * p.transpose();
  double power = theta * t2 / r;
  for (int i = 0; i < 4; ++i, power *= t2) {
    bent.by_lens.col(i) = power * p;
  }
  return bent;
}

Bent bend(Distortion model, const LensNumbers& lens, const Vector2& p) {
  switch (model) {
    case Distortion::None:
      break;
    case Distortion::Brown:
      return bend_brown(lens, p);
    case Distortion::Fisheye:
      return bend_fisheye(lens, p);
  }
  Bent bent;
  bent.point = p;
  bent.by_point.setIdentity();
  return bent;
}

}  // namespace

LensNumbers lens_of(const Camera& camera) {
  LensNumbers lens;
  lens << camera.fx, camera.fy, camera.cx, camera.cy,
      Eigen::Map<const Eigen::Matrix<double, 8, 1>>(camera.distortion.data());
  return lens;
}

Camera with_lens(Camera camera, Distortion model, const LensNumbers& lens) {
  camera.distortion_model = model;
  camera.fx = lens[0];
  camera.fy = lens[1];
  camera.cx = lens[2];
  camera.cy = lens[3];
  for (int i = 0; i < 8; ++i) {
    camera.distortion[static_cast<std::size_t>(i)] = lens[4 + i];
  }
  return camera;
}

RigidNumbers rigid_of(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation) {
  const Eigen::AngleAxisd turn(rotation);
  RigidNumbers rigid;
  rigid << turn.angle() * turn.axis(), translation;
  return rigid;
}

Eigen::Matrix3d rotation_of(const RigidNumbers& rigid) {
  const Vector3 r = rigid.head<3>();
  const double angle = r.norm();
  if (angle < 1e-12) {
    return Matrix3::Identity() + cross_matrix(r);
  }
  return Eigen::AngleAxisd(angle, r / angle).toRotationMatrix();
}

RigidNumbers chained(const RigidNumbers& a_from_b, const RigidNumbers& b_from_c) {
  const Matrix3 rotation = rotation_of(a_from_b);
  return rigid_of(rotation * rotation_of(b_from_c),
                  rotation * b_from_c.tail<3>() + a_from_b.tail<3>());
}

RigidNumbers inverse_of(const RigidNumbers& a_from_b) {
  const Matrix3 back = rotation_of(a_from_b).transpose();
  return rigid_of(back, -back * a_from_b.tail<3>());
}

Eigen::Vector3d moved(const RigidNumbers& a_from_b, const Eigen::Vector3d& point_in_b) {
  return rotation_of(a_from_b) * point_in_b + a_from_b.tail<3>();
}

Eigen::Matrix<double, 3, 6> moved_jacobian(const RigidNumbers& a_from_b,
                                           const Eigen::Vector3d& point_in_b) {
  Eigen::Matrix<double, 3, 6> jacobian;
  jacobian.leftCols<3>() =
      -rotation_of(a_from_b) * cross_matrix(point_in_b) * right_jacobian(a_from_b.head<3>());
  jacobian.rightCols<3>().setIdentity();
  return jacobian;
}

std::optional<Eigen::Vector2d> lens_pixel(Distortion model, const LensNumbers& lens,
                                          const Eigen::Vector3d& point_in_camera) {
  if (!(point_in_camera.z() > 0)) {
    return std::nullopt;
  }
  const Bent bent = bend(model, lens, point_in_camera.head<2>() / point_in_camera.z());
  const Vector2 pixel = lens.head<2>().cwiseProduct(bent.point) + lens.segment<2>(2);
  return pixel.allFinite() ? std::optional<Vector2>(pixel) : std::nullopt;
}

LensJacobian lens_jacobian(Distortion model, const LensNumbers& lens,
                           const Eigen::Vector3d& point_in_camera) {
  const double z = point_in_camera.z();
  const Vector2 flat = point_in_camera.head<2>() / z;
  const Bent bent = bend(model, lens, flat);
  Eigen::Matrix<double, 2, 3> by_flat;
  by_flat << 1 / z, 0, -flat.x() / z, 0, 1 / z, -flat.y() / z;
  const auto focal = lens.head<2>().asDiagonal();
  LensJacobian jacobian;
  jacobian.by_point = focal * bent.by_point * by_flat;
  jacobian.by_lens.setZero();
  jacobian.by_lens(0, 0) = bent.point.x();
  jacobian.by_lens(1, 1) = bent.point.y();
  jacobian.by_lens(0, 2) = 1;
  jacobian.by_lens(1, 3) = 1;
  jacobian.by_lens.rightCols<8>() = focal * bent.by_lens;
  return jacobian;
}

Eigen::Vector3d centre_deviation(const RigidNumbers& camera_from_world,
                                 const Eigen::Matrix<double, 6, 6>& covariance) {
  // Centre -R't: its derivative by the six numbers, by central differences.
  Eigen::Matrix<double, 3, 6> by_pose;
  for (int i = 0; i < 6; ++i) {
    constexpr double kStep = 1e-6;
    RigidNumbers plus = camera_from_world;
    RigidNumbers minus = plus;
    plus[i] += kStep;
    minus[i] -= kStep;
    by_pose.col(i) = (inverse_of(plus).tail<3>() - inverse_of(minus).tail<3>()) / (2 * kStep);
  }
  return (by_pose * covariance * by_pose.transpose()).diagonal().cwiseMax(0).cwiseSqrt();
}

bool is_invertible(const Camera& camera) {
  constexpr int kSteps = 8;
  for (int y = 0; y <= kSteps; ++y) {
    for (int x = 0; x <= kSteps; ++x) {
      const Vector2 pixel(camera.width * x / static_cast<double>(kSteps),
                          camera.height * y / static_cast<double>(kSteps));
      const auto ray = ray_direction(camera, pixel);
      if (!ray) {
        return false;
      }
    }
  }
  return true;
}

}  // namespace atelier
