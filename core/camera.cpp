#include "core/camera.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/error.h"

namespace atelier {
namespace {

using Vector2 = Eigen::Vector2d;
using Matrix2 = Eigen::Matrix2d;

struct Bent {
  Vector2 point;
  Matrix2 jacobian;
};

// OpenCV's rational model; https://docs.opencv.org, "Camera Calibration and 3D Reconstruction".
Bent bend_brown(const std::array<double, 8>& d, const Vector2& p) {
  const double k1 = d[0], k2 = d[1], p1 = d[2], p2 = d[3], k3 = d[4], k4 = d[5], k5 = d[6],
               k6 = d[7];
  const double x = p.x(), y = p.y();
  const double r2 = x * x + y * y;
  const double numerator = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double denominator = 1 + r2 * (k4 + r2 * (k5 + r2 * k6));
  const double radial = numerator / denominator;
  // d(radial)/d(r2)
  const double radial_r2 =
      ((k1 + r2 * (2 * k2 + 3 * r2 * k3)) - radial * (k4 + r2 * (2 * k5 + 3 * r2 * k6))) /
      denominator;
  Bent bent;
  bent.point = {x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
                y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y};
  bent.jacobian(0, 0) = radial + 2 * x * x * radial_r2 + 2 * p1 * y + 6 * p2 * x;
  bent.jacobian(0, 1) = 2 * x * y * radial_r2 + 2 * p1 * x + 2 * p2 * y;
  bent.jacobian(1, 0) = bent.jacobian(0, 1);
  bent.jacobian(1, 1) = radial + 2 * y * y * radial_r2 + 6 * p1 * y + 2 * p2 * x;
  return bent;
}

// Kannala and Brandt 2006, as OpenCV's fisheye module states it.
Bent bend_fisheye(const std::array<double, 8>& d, const Vector2& p) {
  const double r = p.norm();
  if (r < 1e-8) {
    return {p, Matrix2::Identity()};
  }
  const double theta = std::atan(r);
  const double t2 = theta * theta;
  const double bent_theta = theta * (1 + t2 * (d[0] + t2 * (d[1] + t2 * (d[2] + t2 * d[3]))));
  const double slope = 1 + t2 * (3 * d[0] + t2 * (5 * d[1] + t2 * (7 * d[2] + t2 * 9 * d[3])));
  const double scale = bent_theta / r;
  const double scale_r = (slope / (1 + r * r) - scale) / r;
  return {scale * p, scale * Matrix2::Identity() + (scale_r / r) * p * p.transpose()};
}

Bent bend(const Camera& camera, const Vector2& p) {
  switch (camera.distortion_model) {
    case Distortion::None:
      break;
    case Distortion::Brown:
      return bend_brown(camera.distortion, p);
    case Distortion::Fisheye:
      return bend_fisheye(camera.distortion, p);
  }
  return {p, Matrix2::Identity()};
}

// Whether the distortion is too weak to fold anything up to here: its jacobian differs from 1 by
// less than 1, there and further in, where this bound is smaller.
bool cannot_fold(const Camera& camera, double radius) {
  const std::array<double, 8>& d = camera.distortion;
  if (camera.distortion_model == Distortion::Fisheye) {
    const double t2 = std::atan(radius) * std::atan(radius);
    return t2 * (3 * std::abs(d[0]) +
                 t2 * (5 * std::abs(d[1]) + t2 * (7 * std::abs(d[2]) + t2 * 9 * std::abs(d[3])))) <
           0.99;
  }
  if (d[5] != 0 || d[6] != 0 || d[7] != 0) {
    return false;
  }
  const double r2 = radius * radius;
  const double radial =
      r2 * (3 * std::abs(d[0]) + r2 * (5 * std::abs(d[1]) + r2 * 7 * std::abs(d[4])));
  return radial + 8 * radius * (std::abs(d[2]) + std::abs(d[3])) < 0.99;
}

// Whether the bent radius still grows at this radius, or angle of a fisheye, squared; tangential
// terms apart. Beyond a pole of the rational model it does not.
bool grows(const Camera& camera, double s) {
  const std::array<double, 8>& d = camera.distortion;
  if (camera.distortion_model == Distortion::Fisheye) {
    return 1 + s * (3 * d[0] + s * (5 * d[1] + s * (7 * d[2] + s * 9 * d[3]))) > 0;
  }
  const double over = 1 + s * (d[0] + s * (d[1] + s * d[4]));
  const double over_slope = d[0] + s * (2 * d[1] + s * 3 * d[4]);
  const double under = 1 + s * (d[5] + s * (d[6] + s * d[7]));
  const double under_slope = d[5] + s * (2 * d[6] + s * 3 * d[7]);
  return under > 0 && (over + 2 * s * over_slope) * under - 2 * s * over * under_slope > 0;
}

// Whether the radius has turned back and forth on the way from the centre to here.
bool folded_on_the_way(const Camera& camera, double radius) {
  const std::array<double, 8>& d = camera.distortion;
  const bool fisheye = camera.distortion_model == Distortion::Fisheye;
  if (!fisheye && d[5] == 0 && d[6] == 0 && d[7] == 0) {
    // Least where the slope 1 + 3 k1 s + 5 k2 s^2 + 7 k3 s^3 is level.
    const double a = 3 * d[0];
    const double b = 10 * d[1];
    const double c = 21 * d[4];
    const double root = std::sqrt(std::max(0.0, b * b - 4 * a * c));
    // The stable form of the quadratic formula, and of the linear one where c is 0.
    const double q = -0.5 * (b + std::copysign(root, b));
    const double levels[] = {c != 0 ? q / c : 0, q != 0 ? a / q : 0};
    for (const double s : levels) {
      if (s > 0 && s < radius * radius && !grows(camera, s)) {
        return true;
      }
    }
    return false;
  }
  const double end = fisheye ? std::atan(radius) : radius;
  constexpr int kSteps = 32;
  for (int step = 1; step < kSteps; ++step) {
    const double at = end * step / kSteps;
    if (!grows(camera, at * at)) {
      return true;
    }
  }
  return false;
}

// Beyond the first fold of the distortion one pixel has two rays; only the inner one is a camera's.
bool folded(const Camera& camera, const Vector2& p, const Bent& bent) {
  if (bent.jacobian.determinant() <= 0 || bent.jacobian.trace() <= 0) {
    return true;
  }
  const double radius = p.norm();
  return camera.distortion_model != Distortion::None && !cannot_fold(camera, radius) &&
         folded_on_the_way(camera, radius);
}

}  // namespace

Eigen::Vector3d camera_center(const Camera& camera) {
  return -camera.camera_from_world_rotation.transpose() * camera.camera_from_world_translation;
}

Eigen::Vector3d camera_from_world(const Camera& camera, const Eigen::Vector3d& point_in_world) {
  return camera.camera_from_world_rotation * point_in_world + camera.camera_from_world_translation;
}

std::optional<Eigen::Vector2d> project(const Camera& camera,
                                       const Eigen::Vector3d& point_in_world) {
  const Eigen::Vector3d p = camera_from_world(camera, point_in_world);
  if (!(p.z() > 0)) {
    return std::nullopt;
  }
  const Vector2 flat = p.head<2>() / p.z();
  const Bent bent = bend(camera, flat);
  if (!bent.point.allFinite() || folded(camera, flat, bent)) {
    return std::nullopt;
  }
  return Vector2(camera.fx * bent.point.x() + camera.cx, camera.fy * bent.point.y() + camera.cy);
}

std::optional<Eigen::Matrix<double, 2, 3>> project_jacobian(const Camera& camera,
                                                            const Eigen::Vector3d& point_in_world) {
  const Eigen::Vector3d p = camera_from_world(camera, point_in_world);
  if (!(p.z() > 0)) {
    return std::nullopt;
  }
  const Vector2 flat = p.head<2>() / p.z();
  const Bent bent = bend(camera, flat);
  if (!bent.jacobian.allFinite() || folded(camera, flat, bent)) {
    return std::nullopt;
  }
  Eigen::Matrix<double, 2, 3> flat_from_camera;
  flat_from_camera << 1 / p.z(), 0, -flat.x() / p.z(),  //
      0, 1 / p.z(), -flat.y() / p.z();
  const Vector2 focal(camera.fx, camera.fy);
  return Eigen::Matrix<double, 2, 3>(focal.asDiagonal() * bent.jacobian * flat_from_camera *
                                     camera.camera_from_world_rotation);
}

std::optional<Eigen::Vector3d> ray_direction(const Camera& camera, const Eigen::Vector2d& pixel) {
  const Vector2 target((pixel.x() - camera.cx) / camera.fx, (pixel.y() - camera.cy) / camera.fy);
  if (!target.allFinite()) {
    return std::nullopt;
  }
  Vector2 flat = target;
  if (camera.distortion_model != Distortion::None) {
    // Newton with step halving: the start may lie beyond the fold.
    constexpr int kIterations = 50;
    constexpr double kTolerance = 1e-12;  // of the bent direction
    const double size = std::max(1.0, target.norm());
    Bent bent = bend(camera, flat);
    while (folded(camera, flat, bent) && flat.norm() > 1e-9) {
      flat *= 0.5;
      bent = bend(camera, flat);
    }
    double error = (bent.point - target).norm();
    for (int iteration = 0; iteration < kIterations && error > kTolerance * size; ++iteration) {
      const Vector2 step = bent.jacobian.inverse() * (bent.point - target);
      double scale = 1;
      Vector2 next = flat - step;
      Bent at_next = bend(camera, next);
      while (scale > 1e-6 &&
             (!at_next.point.allFinite() || (at_next.point - target).norm() > error ||
              folded(camera, next, at_next))) {
        scale *= 0.5;
        next = flat - scale * step;
        at_next = bend(camera, next);
      }
      const double next_error = (at_next.point - target).norm();
      if (!(next_error < error)) {
        break;
      }
      flat = next;
      bent = at_next;
      error = next_error;
    }
    if (!(error < 1e-9 * size)) {
      return std::nullopt;
    }
  }
  const Eigen::Vector3d in_camera(flat.x(), flat.y(), 1);
  return (camera.camera_from_world_rotation.transpose() * in_camera).normalized();
}

void check_camera(const Camera& camera, const std::string& file) {
  const std::string place = "camera '" + camera.id + "'";
  if (camera.width <= 0 || camera.height <= 0) {
    throw DataError(
        file, place,
        std::to_string(camera.width) + " x " + std::to_string(camera.height) + " pixels",
        "a positive size");
  }
  constexpr double kMostPixels = 1e8;  // of a lens of 100 m on pixels of 1 um
  const auto two = [](double x, double y) {
    char text[64];
    std::snprintf(text, sizeof text, "%.6g, %.6g", x, y);
    return std::string(text);
  };
  const auto is_focal = [](double focal) { return focal > 0 && focal <= kMostPixels; };
  if (!is_focal(camera.fx) || !is_focal(camera.fy)) {
    throw DataError(file, place, "focal lengths " + two(camera.fx, camera.fy),
                    "numbers of pixels above 0, up to 1e+08");
  }
  if (!(std::abs(camera.cx) <= kMostPixels) || !(std::abs(camera.cy) <= kMostPixels)) {
    throw DataError(file, place, "a principal point at " + two(camera.cx, camera.cy),
                    "pixels from -1e+08 to 1e+08");
  }
  for (const double coefficient : camera.distortion) {
    if (!std::isfinite(coefficient)) {
      throw DataError(file, place, "a distortion coefficient that is not finite", "finite numbers");
    }
  }
  const Eigen::Matrix3d& r = camera.camera_from_world_rotation;
  if (!r.allFinite() || !camera.camera_from_world_translation.allFinite()) {
    throw DataError(file, place, "a pose that is not finite", "finite numbers");
  }
  if ((r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > 1e-6 ||
      r.determinant() < 0) {
    throw DataError(file, place,
                    r.determinant() < 0 ? "a rotation that mirrors (determinant -1)"
                                        : "a rotation that is not orthonormal",
                    "an orthonormal matrix with determinant 1");
  }
  if (!(camera.gain.allFinite()) || camera.gain.minCoeff() <= 0) {
    throw DataError(file, place, "a gain that is not positive", "positive factors");
  }
}

}  // namespace atelier
