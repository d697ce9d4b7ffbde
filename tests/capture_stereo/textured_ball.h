#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <optional>
#include <vector>

#include "capture/stereo/choose_sources.h"
#include "capture/stereo/stereo.h"
#include "core/random.h"

namespace atelier::fixtures {

/// A ball with a solid texture, seen by cameras on an arc around it: everything is known exactly.
struct TexturedBall {
  double radius = 0.3;    ///< m
  double contrast = 0.3;  ///< of the texture
  double noise = 0.003;   ///< of the sensor
  double shading = 0;     ///< brighter by this where it faces a lamp
  double band = 0;        ///< m: half the height of a ring round its middle without texture

  /// Value noise of the place on the ball, 4 mm to 3 cm.
  double texture(const Eigen::Vector3d& p) const {
    double sum = 0;
    double size = 0.03;
    for (int octave = 0; octave < 4; ++octave, size /= 2) {
      sum += lattice(p / size, octave) / (1 + octave);
    }
    const double textured = std::abs(p.y()) < band ? 0 : contrast;
    return 0.5 + textured * sum + shading * p.normalized().dot(Eigen::Vector3d(0.6, 0.64, 0.48));
  }
  static double lattice(const Eigen::Vector3d& p, int octave) {
    const Eigen::Vector3d low = p.array().floor();
    const Eigen::Vector3d t = p - low;
    const Eigen::Vector3d s = t.array() * t.array() * (3 - 2 * t.array());
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
      double weight = 1;
      std::uint64_t hash = static_cast<std::uint64_t>(octave);
      for (int k = 0; k < 3; ++k) {
        const int bit = (corner >> k) & 1;
        weight *= bit != 0 ? s(k) : 1 - s(k);
        hash = hash * 1000003 + static_cast<std::uint64_t>(static_cast<int>(low(k)) + bit + 5000);
      }
      sum += weight * (random_words(7, 3, hash).word[0] / 4294967296.0 * 2 - 1);
    }
    return sum;
  }

  /// Depth along the ray (z = 1 in the camera) at which it meets the ball.
  std::optional<double> depth(const Camera& camera, double x, double y) const {
    const auto direction = ray_direction(camera, {x, y});
    const Eigen::Vector3d origin = camera_center(camera);
    const double b = direction->dot(origin);
    const double discriminant = b * b - origin.squaredNorm() + radius * radius;
    if (discriminant < 0) {
      return std::nullopt;
    }
    const double distance = -b - std::sqrt(discriminant);
    return distance * camera.camera_from_world_rotation.row(2).dot(*direction);
  }

  StereoView view(const Camera& camera, std::uint64_t stream) const {
    StereoView view;
    view.camera = camera;
    view.image = Image(camera.width, camera.height, 1, 0.2f);
    view.near_depth = Image(camera.width, camera.height, 1);
    view.far_depth = Image(camera.width, camera.height, 1);
    Random random{11, stream, 0};
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        double sum = 0;
        int hits = 0;
        for (int k = 0; k < 4; ++k) {
          const double px = x + 0.25 + 0.5 * (k & 1);
          const double py = y + 0.25 + 0.5 * (k >> 1);
          const auto found = depth(camera, px, py);
          sum += found ? texture(place(camera, px, py, *found)) : 0.2;
          hits += found ? 1 : 0;
        }
        view.image.at(x, y) = static_cast<float>(sum / 4 + noise * normal(random));
        if (hits == 4) {
          view.near_depth.at(x, y) = static_cast<float>(1.5 - 1.3 * radius);
          view.far_depth.at(x, y) = 1.6f;
        }
      }
    }
    return view;
  }
  static Eigen::Vector3d place(const Camera& camera, double x, double y, double depth) {
    const auto direction = ray_direction(camera, {x, y});
    return camera_center(camera) +
           *direction * (depth / camera.camera_from_world_rotation.row(2).dot(*direction));
  }

  /// Cameras 1.5 m away, `angle` radians apart, every second one lower.
  std::vector<StereoView> views(int count, double angle, int width, int height) const {
    std::vector<Camera> cameras;
    for (int i = 0; i < count; ++i) {
      const double azimuth = angle * (i - 0.5 * (count - 1));
      const double elevation = (i & 1) != 0 ? 0.1 : -0.1;
      const Eigen::Vector3d centre =
          1.5 * Eigen::Vector3d(std::sin(azimuth) * std::cos(elevation), std::sin(elevation),
                                std::cos(azimuth) * std::cos(elevation));
      Camera camera;
      camera.id = "cam" + std::to_string(i);
      camera.width = width;
      camera.height = height;
      camera.fx = camera.fy = 1.9 * std::min(width, height);
      camera.cx = 0.5 * width + 1.3;
      camera.cy = 0.5 * height - 0.7;
      const Eigen::Vector3d z = -centre.normalized();
      const Eigen::Vector3d x = Eigen::Vector3d(0, -1, 0).cross(z).normalized();
      camera.camera_from_world_rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
      camera.camera_from_world_translation = -camera.camera_from_world_rotation * centre;
      cameras.push_back(camera);
    }
    const auto sources = choose_sources(cameras, Eigen::Vector3d::Zero(), kSources);
    std::vector<StereoView> all;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      all.push_back(view(cameras[i], i));
      all.back().sources = sources[i];
    }
    return all;
  }
  static constexpr int kSources = 4;
};

}  // namespace atelier::fixtures
