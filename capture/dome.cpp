#include "capture/dome.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "core/error.h"

namespace atelier {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

Eigen::Matrix3d looking(const Eigen::Vector3d& from, const Eigen::Vector3d& at) {
  const Eigen::Vector3d forward = (at - from).normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitY()).normalized();
  Eigen::Matrix3d rotation;
  rotation.row(0) = right;
  rotation.row(1) = forward.cross(right);
  rotation.row(2) = forward;
  return rotation;
}

Eigen::Matrix3d turned(const Eigen::Vector3d& r) {
  const double angle = r.norm();
  return angle > 0 ? Eigen::AngleAxisd(angle, r / angle).toRotationMatrix()
                   : Eigen::Matrix3d::Identity();
}

Eigen::Vector3d normal3(Random& random) {
  const double x = normal(random);
  const double y = normal(random);
  const double z = normal(random);
  return {x, y, z};
}

std::vector<Eigen::Vector3d> volume_points() {
  std::vector<Eigen::Vector3d> points;
  for (int y = 0; y < 7; ++y) {
    for (int a = 0; a < 8; ++a) {
      const double angle = a * 45 * kDegree;
      points.emplace_back(0.6 * std::sin(angle), 0.05 + 0.38 * y, 0.6 * std::cos(angle));
    }
  }
  return points;
}

}  // namespace

OptionTable describe(DomeOptions& options) {
  OptionTable table;
  table
      .add("cameras", options.cameras, 2, 1024, "",
           "Number of cameras around the subject; more give stereo closer neighbours")
      .add("pairs", options.pairs, "Arrangement of cameras in pairs side by side, for stereo")
      .add("rows", options.rows, 1, 2, "",
           "Number of pairs (or cameras) above each other on a post")
      .add("pair_angle", options.pair_angle, 1, 90, "deg",
           "Angle between the two cameras of a pair")
      .add("radius", options.radius, 1, 50, "m", "Distance from the subject's axis to the cameras")
      .add("low", options.low, 0.05, 20, "m", "Height of the lowest cameras")
      .add("high", options.high, 0.05, 20, "m", "Height of the highest cameras")
      .add("reach", options.reach, 0.1, 20, "m", "Height of the volume that fills an image")
      .add("aim", options.aim, 0, 20, "m", "Height that cameras look at")
      .add("width", options.width, 16, 16384, "px", "Width of an image")
      .add("height", options.height, 16, 16384, "px", "Height of an image")
      .add("distortion", options.distortion, 0, 3, "",
           "Factor on a common lens's distortion; 0: ideal lenses")
      .add("jitter", options.jitter, 0, 10, "", "Factor on the scatter of a hand-built rig")
      .add("gain", options.gain, 0, 0.5, "",
           "Spread of exposure between cameras; 0: equal exposure");
  return table;
}

std::vector<Camera> dome_cameras(const DomeOptions& options, Random random) {
  DomeOptions copy = options;
  const std::vector<std::string> wrong = check_options(describe(copy));
  ATELIER_CHECK(wrong.empty(), wrong.empty() ? "" : wrong.front());
  const int per_post = (options.pairs ? 2 : 1) * options.rows;
  ATELIER_CHECK(options.cameras % per_post == 0, std::to_string(options.cameras) +
                                                     " cameras do not fill posts of " +
                                                     std::to_string(per_post));
  const int posts = options.cameras / per_post;
  std::vector<Camera> cameras;
  for (int i = 0; i < options.cameras; ++i) {
    const int post = i / per_post;
    const int row = i % per_post / (options.pairs ? 2 : 1);
    const int side = options.pairs ? i % 2 : 0;
    const bool high = (post + row) % 2 == 1;
    double angle = 2 * std::numbers::pi * post / posts;
    if (options.pairs) {
      angle += (side - 0.5) * options.pair_angle * kDegree;
    }
    // With two rows both heights are on every post; posts alternate by a fifth of the range.
    double height = high ? options.high : options.low;
    if (options.rows == 2 && post % 2 == 1) {
      height += (high ? -0.2 : 0.2) * (options.high - options.low);
    }
    Eigen::Vector3d center(options.radius * std::sin(angle), height,
                           options.radius * std::cos(angle));
    center += 0.02 * options.jitter * normal3(random);
    const Eigen::Vector3d wobble = 1 * kDegree * options.jitter * normal3(random);
    const double focal_scatter = 1 + 0.004 * options.jitter * normal(random);
    const double offset_x = 0.006 * options.jitter * normal(random);
    const double offset_y = 0.006 * options.jitter * normal(random);
    const Eigen::Vector3d balance = normal3(random);
    const double exposure = normal(random);
    const double lens_a = normal(random);
    const double lens_b = normal(random);

    Camera camera;
    char id[16];
    std::snprintf(id, sizeof(id), options.cameras > 100 ? "%03d" : "%02d", i);
    camera.id = id;
    camera.width = options.width;
    camera.height = options.height;
    const double distance = std::hypot(options.radius, height - options.aim);
    camera.fx = camera.fy = focal_scatter * options.height * distance / options.reach;
    camera.cx = options.width * (0.5 + offset_x);
    camera.cy = options.height * (0.5 + offset_y);
    if (options.distortion > 0) {
      camera.distortion_model = Distortion::Brown;
      camera.distortion[0] = options.distortion * (-0.08 + 0.01 * lens_a);
      camera.distortion[1] = options.distortion * 0.03;
      camera.distortion[2] = options.distortion * 0.0005 * lens_b;
      camera.distortion[3] = options.distortion * 0.0004 * lens_a;
    }
    camera.camera_from_world_rotation =
        turned(wobble) * looking(center, Eigen::Vector3d(0, options.aim, 0));
    camera.camera_from_world_translation = -camera.camera_from_world_rotation * center;
    for (int c = 0; c < 3; ++c) {
      camera.gain[c] = std::exp(options.gain * std::clamp(exposure, -2.5, 2.5) +
                                0.6 * options.gain * std::clamp(balance[c], -2.5, 2.5));
    }
    cameras.push_back(camera);
  }
  return cameras;
}

double reprojection_rms(const Camera& a, const Camera& b) {
  double sum = 0;
  int count = 0;
  for (const Eigen::Vector3d& point : volume_points()) {
    const auto pixel_a = project(a, point);
    const auto pixel_b = project(b, point);
    if (pixel_a && pixel_b) {
      sum += (*pixel_a - *pixel_b).squaredNorm();
      ++count;
    }
  }
  return count == 0 ? 0 : std::sqrt(sum / count);
}

std::vector<Camera> calibrated_cameras(const std::vector<Camera>& cameras, double rms,
                                       Random random) {
  ATELIER_CHECK(rms >= 0 && rms < 100, "rms must be in [0, 100)");
  std::vector<Camera> found;
  for (const Camera& camera : cameras) {
    const double d_focal = normal(random);
    const double d_cx = normal(random);
    const double d_cy = normal(random);
    const Eigen::Vector3d turn = normal3(random);
    const Eigen::Vector3d shift = normal3(random);
    const double lens = normal(random);
    // Shares as calibrations have them: centre and direction trade against each other, and so do
    // focal length and distance; what is left over in the image is what `rms` says.
    const auto off = [&](double scale) {
      Camera result = camera;
      const double pixel = scale;
      result.fx += pixel * d_focal * camera.fx / camera.height;
      result.fy += pixel * d_focal * camera.fy / camera.height;
      result.cx += pixel * d_cx;
      result.cy += pixel * d_cy;
      if (camera.distortion_model == Distortion::Brown) {
        result.distortion[0] += pixel * 2e-4 * lens * 1000 / camera.height;
      }
      const Eigen::Vector3d center = camera_center(camera) + pixel * shift / camera.fx;
      result.camera_from_world_rotation =
          turned(pixel * turn / camera.fx) * camera.camera_from_world_rotation;
      result.camera_from_world_translation = -result.camera_from_world_rotation * center;
      result.gain = Eigen::Vector3d::Ones();
      return result;
    };
    double scale = rms;
    for (int i = 0; i < 8 && rms > 0; ++i) {
      scale *= rms / std::max(1e-12, reprojection_rms(camera, off(scale)));
    }
    found.push_back(off(scale));
  }
  return found;
}

}  // namespace atelier
