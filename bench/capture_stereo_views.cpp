// Stereo of one instant: a textured ball that covers a share of each view, before a dome of
// cameras. Prints the median depth error beside every time, so that speed is speed of the same
// result.

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include <benchmark/benchmark.h>

#include "capture/stereo/choose_sources.h"
#include "capture/stereo/stereo.h"
#include "core/parallel.h"
#include "core/random.h"

namespace {

using namespace atelier;

constexpr double kDistance = 3;
constexpr int kTexture = 1024;

/// Smooth noise on a map of the ball.
const Image& texture() {
  static const Image image = [] {
    Image noise(kTexture, kTexture, 1, 0.5f);
    for (int size = 4; size <= 64; size *= 2) {
      const int n = kTexture / size;
      const auto value = [&](int x, int y) {
        const int cell = (y % n) * n + x % n;
        return random_words(5, static_cast<std::uint64_t>(size), static_cast<std::uint64_t>(cell))
                       .word[0] /
                   4294967296.0 -
               0.5;
      };
      for (int y = 0; y < kTexture; ++y) {
        for (int x = 0; x < kTexture; ++x) {
          const int cx = x / size;
          const int cy = y / size;
          const double u = static_cast<double>(x % size) / size;
          const double v = static_cast<double>(y % size) / size;
          const double above = (1 - u) * value(cx, cy) + u * value(cx + 1, cy);
          const double below = (1 - u) * value(cx, cy + 1) + u * value(cx + 1, cy + 1);
          noise.at(x, y) += static_cast<float>(0.2 * ((1 - v) * above + v * below));
        }
      }
    }
    return noise;
  }();
  return image;
}

struct Dome {
  std::vector<StereoView> views;
  std::vector<std::vector<float>> truth;  ///< [view] depth, 0: no ball

  /// @param share  of each image that the ball covers
  Dome(int count, int width, int height, double share) {
    const double focal = 1.6 * height;
    const double pixel_radius = std::sqrt(share * width * height / std::numbers::pi);
    const double sine = std::sin(std::atan(pixel_radius / focal));
    const double radius = kDistance * sine;
    std::vector<Camera> cameras;
    for (int i = 0; i < count; ++i) {
      const double azimuth = 2 * std::numbers::pi * i / count;
      const double elevation = i % 2 == 0 ? 0.12 : -0.12;
      const Eigen::Vector3d centre =
          kDistance * Eigen::Vector3d(std::sin(azimuth) * std::cos(elevation), std::sin(elevation),
                                      std::cos(azimuth) * std::cos(elevation));
      Camera camera;
      camera.id = std::to_string(i);
      camera.width = width;
      camera.height = height;
      camera.fx = camera.fy = focal;
      camera.cx = 0.5 * width;
      camera.cy = 0.5 * height;
      const Eigen::Vector3d z = -centre.normalized();
      const Eigen::Vector3d x = Eigen::Vector3d(0, -1, 0).cross(z).normalized();
      camera.camera_from_world_rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
      camera.camera_from_world_translation = -camera.camera_from_world_rotation * centre;
      cameras.push_back(camera);
    }
    const auto sources = choose_sources(cameras, Eigen::Vector3d::Zero(), 4);
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      photograph(cameras[i], sources[i], radius, share);
    }
  }

  void photograph(const Camera& camera, const std::vector<int>& sources, double radius,
                  double share) {
    StereoView view;
    view.camera = camera;
    view.sources = sources;
    view.image = Image(camera.width, camera.height, 1, 0.3f);
    view.near_depth = Image(camera.width, camera.height, 1);
    view.far_depth = view.near_depth;
    std::vector<float> depths(view.image.data.size(), 0);
    const Eigen::Vector3d centre = camera_center(camera);
    parallel_for(camera.height, 16, [&](Index begin, Index end) {
      for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
        for (int x = 0; x < camera.width; ++x) {
          const std::size_t p = static_cast<std::size_t>(y) * camera.width + x;
          const Eigen::Vector3d ray = camera.camera_from_world_rotation.transpose() *
                                      Eigen::Vector3d((x + 0.5 - camera.cx) / camera.fx,
                                                      (y + 0.5 - camera.cy) / camera.fy, 1);
          const double b = ray.dot(centre);
          const double a = ray.squaredNorm();
          const double root = b * b - a * (centre.squaredNorm() - radius * radius);
          if (share >= 1 || root > 0) {
            view.near_depth.data[p] = static_cast<float>(kDistance - 1.2 * radius);
            view.far_depth.data[p] = static_cast<float>(kDistance + 0.2 * radius);
          }
          if (root <= 0) {
            continue;
          }
          depths[p] = static_cast<float>((-b - std::sqrt(root)) / a);
          const Eigen::Vector3d at = centre + static_cast<double>(depths[p]) * ray;
          const double u = (std::atan2(at.x(), at.z()) / std::numbers::pi + 1) * 0.5 * kTexture * 2;
          const double v = (at.y() / radius + 1) * 0.5 * kTexture;
          const auto cu = static_cast<int>(u);
          const auto cv = static_cast<int>(v);
          const auto texel = [&](int i, int j) {
            return texture().at(i % kTexture, std::min(j, kTexture - 1));
          };
          const auto fu = static_cast<float>(u - cu);
          const auto fv = static_cast<float>(v - cv);
          view.image.data[p] = (1 - fv) * ((1 - fu) * texel(cu, cv) + fu * texel(cu + 1, cv)) +
                               fv * ((1 - fu) * texel(cu, cv + 1) + fu * texel(cu + 1, cv + 1));
        }
      }
    });
    views.push_back(std::move(view));
    truth.push_back(std::move(depths));
  }

  /// Median error over the first view's ball, pixels of disparity to its first source.
  double median_error(const std::vector<DepthMap>& maps) const {
    std::vector<double> errors;
    for (std::size_t p = 0; p < truth[0].size(); ++p) {
      if (truth[0][p] > 0) {
        errors.push_back(std::abs(maps[0].depth.data[p] - truth[0][p]));
      }
    }
    std::nth_element(errors.begin(), errors.begin() + errors.size() / 2, errors.end());
    return errors[errors.size() / 2];
  }
};

void report(benchmark::State& state, const Dome& dome, const std::vector<DepthMap>& maps) {
  double looked = 0;
  for (const StereoView& view : dome.views) {
    looked +=
        static_cast<double>(std::count_if(view.near_depth.data.begin(), view.near_depth.data.end(),
                                          [](float depth) { return depth > 0; }));
  }
  const StereoOptions options;
  const double coarse = std::pow(0.25, options.levels - 1);  // of the pixels
  const double sweeps = coarse * options.iterations + options.refinements * (4 - coarse) / 3;
  const auto samples =
      looked * sweeps * 13 * static_cast<double>(dome.views[0].sources.size()) * 32;
  state.counters["median_mm"] = 1e3 * dome.median_error(maps);
  state.counters["s_per_view"] = benchmark::Counter(
      static_cast<double>(dome.views.size()),
      benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  state.counters["samples_per_s"] =
      benchmark::Counter(samples, benchmark::Counter::kIsIterationInvariantRate);
}

// One view of 800x1000 and those that it is compared with, on the CPU; the share of the image in
// percent.
void stereo_cpu(benchmark::State& state) {
  Dome dome(24, 800, 1000, 0.01 * static_cast<double>(state.range(0)));
  // Only the first view is computed, against its sources.
  std::vector<StereoView> views = {dome.views[0]};
  for (int& source : views[0].sources) {
    views.push_back(dome.views[static_cast<std::size_t>(source)]);
    std::fill(views.back().near_depth.data.begin(), views.back().near_depth.data.end(), 0.0f);
    views.back().sources = {0};
    source = static_cast<int>(views.size()) - 1;
  }
  dome.views = std::move(views);
  std::vector<DepthMap> maps;
  for (auto _ : state) {
    maps = stereo(dome.views, {.sources = 4});
  }
  report(state, dome, maps);
  state.counters["s_per_view"] = benchmark::Counter(
      1, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(stereo_cpu)->Arg(25)->Arg(100)->Unit(benchmark::kSecond)->Iterations(1)->UseRealTime();

// Forty views of 1536x2048, one instant, copies to and from the device included.
void stereo_cuda(benchmark::State& state) {
  if (!cuda_available()) {
    state.SkipWithError("no CUDA device");
    return;
  }
  const Dome dome(40, 1536, 2048, 0.01 * static_cast<double>(state.range(0)));
  std::vector<DepthMap> maps;
  for (auto _ : state) {
    maps = stereo(dome.views, {}, Device::Cuda);
  }
  report(state, dome, maps);
}
BENCHMARK(stereo_cuda)->Arg(25)->Arg(100)->Unit(benchmark::kSecond)->Iterations(2)->UseRealTime();

}  // namespace
