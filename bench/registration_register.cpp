// One frame of clothing registration: a tube of cloth of 5,000 vertices and 1.9 m2 on a body, a
// scan of 20,000 points, 16 cameras of 800x1000. All that a sequence spends on a frame but reading
// files. As it is, where images settle early, and with every step that it may take (all_steps:1).
// Counters: error (mm, of points), correlation, picture_steps.
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include <benchmark/benchmark.h>

#include "core/parallel.h"
#include "registration/tracking/register_sequence.h"

namespace atelier {
namespace {

constexpr double kRadius = 0.25;  // m
constexpr double kHeight = 1.2;   // m

Mesh tube(int around, int along, double radius) {
  Mesh mesh;
  mesh.vertices.resize(around * (along + 1), 3);
  mesh.faces.resize(2 * around * along, 3);
  Index f = 0;
  for (int j = 0; j <= along; ++j) {
    for (int i = 0; i < around; ++i) {
      const double u = 2 * std::numbers::pi * i / around;
      mesh.vertices.row(j * around + i) << radius * std::cos(u), 0.4 + kHeight * j / along,
          -radius * std::sin(u);
      if (j < along) {
        const int a = j * around + i;
        const int b = j * around + (i + 1) % around;
        mesh.faces.row(f++) << a, b, a + around;
        mesh.faces.row(f++) << a + around, b, b + around;
      }
    }
  }
  return mesh;
}

/// Turned about the Y axis.
Points turned(const Points& points, double angle) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
  return points * turn.transpose();
}

double print(double u, double y) {
  u *= kRadius;
  return 0.4 + 0.1 * (std::sin(110 * u + 3 * std::sin(61 * y)) +
                      std::sin(140 * y + 2 * std::cos(45 * u)) + std::sin(90 * u - 75 * y));
}

PhotoView picture(int number, double angle) {
  const double at = 2 * std::numbers::pi * number / 16;
  const Eigen::Vector3d eye(2.6 * std::cos(at), 1 + 0.4 * (number % 2), -2.6 * std::sin(at));
  PhotoView view;
  Camera& camera = view.camera;
  camera.width = 800;
  camera.height = 1000;
  camera.fx = camera.fy = 1300;
  camera.cx = 400;
  camera.cy = 500;
  const Eigen::Vector3d forward = (Eigen::Vector3d(0, 1, 0) - eye).normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitY()).normalized();
  camera.camera_from_world_rotation.row(0) = right.transpose();
  camera.camera_from_world_rotation.row(1) = forward.cross(right).transpose();
  camera.camera_from_world_rotation.row(2) = forward.transpose();
  camera.camera_from_world_translation = -camera.camera_from_world_rotation * eye;
  view.image = Image(camera.width, camera.height, 3, 0.2F);
  parallel_for(camera.height, 16, [&](Index begin, Index end) {
    for (auto y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const Eigen::Vector3d d = ray_direction(camera, {x + 0.5, y + 0.5}).value();
        const double a = d.x() * d.x() + d.z() * d.z();
        const double b = eye.x() * d.x() + eye.z() * d.z();
        const double c = eye.x() * eye.x() + eye.z() * eye.z() - kRadius * kRadius;
        if (b * b > a * c) {
          const Eigen::Vector3d p = eye + (-b - std::sqrt(b * b - a * c)) / a * d;
          for (int channel = 0; channel < 3; ++channel) {
            view.image.at(x, y, channel) =
                static_cast<float>(print(std::atan2(-p.z(), p.x()) - angle + 0.7 * channel, p.y()));
          }
        }
      }
    }
  });
  return view;
}

void registered_frame(benchmark::State& state) {
  constexpr double kTurn = 0.03;  // 7.5 mm that the shape does not show
  Garment garment;
  garment.mesh = tube(72, 69, kRadius);
  const Mesh scan = tube(140, 142, kRadius);
  const Mesh body = tube(100, 100, kRadius - 0.03);
  std::vector<std::vector<PhotoView>> pictures(2);
  for (int row = 0; row < 2; ++row) {
    for (int c = 0; c < 16; ++c) {
      pictures[static_cast<std::size_t>(row)].push_back(picture(c, kTurn * row));
    }
  }
  RegisterSequenceOptions options;
  if (state.range(0) != 0) {
    options.fit.settled = 0;
  }
  RegistrationSource source;
  source.rows = 2;
  source.body_faces = body.faces;
  source.body = [&](Index) { return body.vertices; };
  source.load = [&](Index row) {
    RegistrationFrame frame;
    frame.scan = garment_scan(scan, {});
    frame.body = body_obstacle(body.vertices, body.faces);
    for (const PhotoView& view : pictures[static_cast<std::size_t>(row)]) {
      frame.views.push_back(view_pyramid(view, options.fit.photometric_levels));
    }
    return frame;
  };
  RegisteredSequence sequence(garment, source, options);
  const Points first = sequence.at(0).vertices;
  RegisteredGarment found;
  for (auto _ : state) {
    found = sequence.again(1, 0, first);
  }
  state.counters["vertices"] = static_cast<double>(first.rows());
  state.counters["error"] =
      1e3 * (found.vertices - turned(garment.mesh.vertices, kTurn)).rowwise().norm().mean();
  state.counters["correlation"] = found.correlation;
  state.counters["picture_steps"] = found.picture_steps;
}
BENCHMARK(registered_frame)
    ->ArgName("all_steps")
    ->Arg(0)
    ->Arg(1)
    ->Unit(benchmark::kSecond)
    ->Iterations(2)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

}  // namespace
}  // namespace atelier
