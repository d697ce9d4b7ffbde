#include "capture/camera_conventions.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "capture/radial_fit.h"
#include "capture/sentence.h"
#include "core/error.h"

namespace atelier {
namespace {

constexpr double kHalfPixel = 0.5;

}  // namespace

Camera camera_of(const OpencvCamera& source, const std::string& file) {
  const auto refuse = [&](const std::string& found, const std::string& expected) {
    throw DataError(file, "camera '" + source.id + "'", found, expected);
  };
  const Eigen::Matrix3d& k = source.matrix;
  // Written so that NaN is refused as well.
  constexpr double kSkew = 1e-6;
  const double focal = std::max(std::abs(k(0, 0)), std::abs(k(1, 1)));
  if (!k.allFinite() || !(std::abs(k(0, 1)) <= kSkew * focal) || k(1, 0) != 0 || k(2, 0) != 0 ||
      k(2, 1) != 0 || k(2, 2) != 1) {
    refuse("K is no matrix of focal lengths and principal point",
           "[fx 0 cx; 0 fy cy; 0 0 1] (a transposed K has cx and cy in its last row)");
  }
  Camera camera;
  camera.id = source.id;
  camera.width = source.width;
  camera.height = source.height;
  camera.fx = k(0, 0);
  camera.fy = k(1, 1);
  camera.cx = k(0, 2) + kHalfPixel;
  camera.cy = k(1, 2) + kHalfPixel;
  // OpenCV writes all of its 5, 8, 12 or 14 numbers, also of simpler lenses.
  std::vector<double> d = source.distortion;
  const std::size_t most = source.fisheye ? 4 : 8;
  const bool prism = d.size() == 12 || d.size() == 14;
  if ((source.fisheye && d.size() > most) || prism) {
    if (!std::all_of(d.begin() + static_cast<std::ptrdiff_t>(most), d.end(),
                     [](double value) { return value == 0; })) {
      refuse(std::to_string(d.size()) + " coefficients of distortion, of which number " +
                 std::to_string(most + 1) + " or a later one is not 0",
             source.fisheye ? "4 (fisheye)"
                            : "a lens without thin prism (s1 to s4) and tilted sensor: 8 numbers");
    }
    d.resize(most);
  }
  if (source.fisheye
          ? d.size() != 4
          : (d.size() != 0 && d.size() != 2 && d.size() != 4 && d.size() != 5 && d.size() != 8)) {
    refuse(std::to_string(d.size()) + " coefficients of distortion",
           source.fisheye ? "4 (fisheye)" : "0, 2, 4, 5, 8, 12 or 14, as OpenCV has them");
  }
  if (source.fisheye) {
    camera.distortion_model = Distortion::Fisheye;
  } else if (std::any_of(d.begin(), d.end(), [](double value) { return value != 0; })) {
    camera.distortion_model = Distortion::Brown;
  }
  std::copy(d.begin(), d.end(), camera.distortion.begin());
  camera.camera_from_world_rotation = source.rotation;
  camera.camera_from_world_translation = source.translation;
  check_numbers(camera, file);
  return camera;
}

Finding camera_left_out(const std::string& id, const std::string& why) {
  return {Severity::Warning,
          "camera-left-out",
          id,
          why + "; the camera is left out",
          "calibrate it if it is needed; to be told no more, leave it out",
          "--capture.leave-out " + id};
}

void check_numbers(const Camera& camera, const std::string& file) {
  bool finite = camera.camera_from_world_rotation.allFinite() &&
                camera.camera_from_world_translation.allFinite();
  for (const double value : {camera.fx, camera.fy, camera.cx, camera.cy}) {
    finite = finite && std::isfinite(value);
  }
  for (const double value : camera.distortion) {
    finite = finite && std::isfinite(value);
  }
  if (!finite) {
    throw DataError(file, "camera '" + camera.id + "'", "a number that is not finite",
                    "finite numbers, rotations of a few turns");
  }
}

OpencvCamera opencv_of(const Camera& camera) {
  OpencvCamera result;
  result.id = camera.id;
  result.width = camera.width;
  result.height = camera.height;
  result.matrix << camera.fx, 0, camera.cx - kHalfPixel, 0, camera.fy, camera.cy - kHalfPixel, 0, 0,
      1;
  const auto& d = camera.distortion;
  result.fisheye = camera.distortion_model == Distortion::Fisheye;
  if (result.fisheye) {
    result.distortion.assign(d.begin(), d.begin() + 4);
  } else if (camera.distortion_model == Distortion::Brown) {
    const bool rational = d[5] != 0 || d[6] != 0 || d[7] != 0;
    result.distortion.assign(d.begin(), d.begin() + (rational ? 8 : 5));
  }
  result.rotation = camera.camera_from_world_rotation;
  result.translation = camera.camera_from_world_translation;
  return result;
}

std::string lens_left_out(const Camera& camera) {
  Camera alone = camera;
  alone.camera_from_world_rotation.setIdentity();
  alone.camera_from_world_translation.setZero();
  constexpr int kSteps = 32;  // of a grid over the image, its edges included
  double most = 0;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      const Eigen::Vector2d pixel(static_cast<double>(camera.width) * i / kSteps,
                                  static_cast<double>(camera.height) * j / kSteps);
      const std::optional<Eigen::Vector3d> ray = ray_direction(alone, pixel);
      if (!ray || !(ray->z() > 0)) {
        continue;  // no pinhole sees it
      }
      const Eigen::Vector2d pinhole(camera.fx * ray->x() / ray->z() + camera.cx,
                                    camera.fy * ray->y() / ray->z() + camera.cy);
      most = std::max(most, (pinhole - pixel).norm());
    }
  }
  return sentence(
      "the %s lens of %s is left out, off by up to %.3g px: the layout has none; undistort the "
      "images first, or write colmap, nerfstudio, pose2sim or anipose",
      camera.distortion_model == Distortion::Fisheye ? "fisheye" : "distorted",
      camera.id.substr(0, 40).c_str(), most);
}

std::vector<double> polynomial_radial(const Camera& camera, int count,
                                      std::vector<std::string>& lost) {
  const auto& d = camera.distortion;
  ATELIER_CHECK(count >= 3, "a polynomial of three coefficients or more");
  if (d[5] == 0 && d[6] == 0 && d[7] == 0) {
    std::vector<double> radial(static_cast<std::size_t>(count), 0.0);
    radial[0] = d[0];
    radial[1] = d[1];
    radial[2] = d[4];
    return radial;
  }
  RadialFit fit = polynomial_of_rational(camera, count);
  lost.push_back(
      sentence("the rational lens of %s is written as a polynomial, off by up to %.2g px",
               camera.id.c_str(), fit.error * std::max(camera.fx, camera.fy)));
  return std::move(fit.coefficients);
}

std::array<double, 5> five_distortion(const Camera& camera, std::vector<std::string>& lost) {
  const auto& d = camera.distortion;
  if (camera.distortion_model == Distortion::Fisheye) {
    lost.push_back(lens_left_out(camera));
    return {};
  }
  if (camera.distortion_model == Distortion::None) {
    return {};
  }
  const std::vector<double> radial = polynomial_radial(camera, 3, lost);
  return {radial[0], radial[1], d[2], d[3], radial[2]};
}

Eigen::Matrix3d rotation_of_vector(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  return angle == 0 ? Eigen::Matrix3d::Identity()
                    : Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix();
}

Eigen::Vector3d vector_of_rotation(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

Eigen::Matrix3d y_up_from(const std::string& up) {
  static const std::map<std::string, std::array<double, 9>> rows = {
      {"y", {1, 0, 0, 0, 1, 0, 0, 0, 1}},  {"-y", {1, 0, 0, 0, -1, 0, 0, 0, -1}},
      {"z", {1, 0, 0, 0, 0, 1, 0, -1, 0}}, {"-z", {1, 0, 0, 0, 0, -1, 0, 1, 0}},
      {"x", {0, -1, 0, 1, 0, 0, 0, 0, 1}}, {"-x", {0, 1, 0, -1, 0, 0, 0, 0, 1}}};
  const auto found = rows.find(up);
  ATELIER_CHECK(found != rows.end(), "no axis is called '" + up + "'");
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(found->second.data());
}

Camera in_our_world(Camera camera, const WorldConvention& world) {
  // The axes only change places and signs, so that no rounding comes in.
  camera.camera_from_world_rotation =
      (camera.camera_from_world_rotation * y_up_from(world.up).transpose()).eval();
  camera.camera_from_world_translation *= world.metres_per_unit;
  return camera;
}

Camera in_file_world(Camera camera, const WorldConvention& world) {
  camera.camera_from_world_rotation =
      (camera.camera_from_world_rotation * y_up_from(world.up)).eval();
  camera.camera_from_world_translation /= world.metres_per_unit;
  return camera;
}

Camera turned_camera(const Camera& camera, int quarters) {
  Camera turned = camera;
  for (int i = 0; i < ((quarters % 4) + 4) % 4; ++i) {
    const Camera before = turned;
    // Pixel (x, y) goes to (height - y, x), so that right becomes down and down becomes left.
    Eigen::Matrix3d axes;
    axes << 0, -1, 0, 1, 0, 0, 0, 0, 1;
    turned.width = before.height;
    turned.height = before.width;
    turned.fx = before.fy;
    turned.fy = before.fx;
    turned.cx = before.height - before.cy;
    turned.cy = before.cx;
    turned.camera_from_world_rotation = axes * before.camera_from_world_rotation;
    turned.camera_from_world_translation = axes * before.camera_from_world_translation;
    if (camera.distortion_model == Distortion::Brown) {  // p1 and p2 are along y and x
      turned.distortion[2] = before.distortion[3];
      turned.distortion[3] = -before.distortion[2];
    }
  }
  return turned;
}

Camera scaled_camera(Camera camera, int width, int height) {
  ATELIER_CHECK(camera.width > 0 && camera.height > 0, "a camera of no size");
  const double x = static_cast<double>(width) / camera.width;
  const double y = static_cast<double>(height) / camera.height;
  camera.fx *= x;
  camera.cx *= x;
  camera.fy *= y;
  camera.cy *= y;
  camera.width = width;
  camera.height = height;
  return camera;
}

}  // namespace atelier
