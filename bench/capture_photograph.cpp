// One image of a synthetic capture as `atelier synthesize` takes it: light, maps, labels, noise.

#include <cmath>
#include <numbers>

#include <benchmark/benchmark.h>

#include "capture/detector.h"
#include "capture/dome.h"
#include "capture/fabric.h"
#include "capture/photograph.h"
#include "capture/sensor.h"
#include "core/io/image_file.h"

namespace {

using atelier::Index;

/// A folded skirt-like tube of 24,000 triangles, as tall as a person.
atelier::Mesh tube() {
  constexpr int kRows = 101;
  constexpr int kColumns = 120;
  atelier::Mesh mesh;
  mesh.vertices.resize(kRows * kColumns, 3);
  mesh.uvs.resize(kRows * kColumns, 2);
  mesh.faces.resize(2 * (kRows - 1) * kColumns, 3);
  Index f = 0;
  for (int r = 0; r < kRows; ++r) {
    const double t = static_cast<double>(r) / (kRows - 1);
    for (int c = 0; c < kColumns; ++c) {
      const double a = 2 * std::numbers::pi * c / kColumns;
      const double radius = (0.08 + 0.25 * (1 - t)) * (1 + 0.15 * (1 - t) * std::sin(11 * a));
      mesh.vertices.row(r * kColumns + c) << radius * std::sin(a), 1.75 * t, radius * std::cos(a);
      mesh.uvs.row(r * kColumns + c) << static_cast<double>(c) / kColumns, t;
      if (r + 1 < kRows) {
        const int d = (c + 1) % kColumns;
        mesh.faces.row(f++) << r * kColumns + c, r * kColumns + d, (r + 1) * kColumns + d;
        mesh.faces.row(f++) << r * kColumns + c, (r + 1) * kColumns + d, (r + 1) * kColumns + c;
      }
    }
  }
  mesh.uv_faces = mesh.faces;
  return mesh;
}

void photograph_one(benchmark::State& state) {
  atelier::StageInstant instant;
  atelier::StageLayer layer;
  layer.mesh.mesh = tube();
  layer.mesh.look.color = {1, 1, 1};
  layer.mesh.look.texture =
      std::make_shared<const atelier::Image>(atelier::fabric_image(1.5, {}, 1));
  layer.label = atelier::Label::Dress;
  instant.layers = {layer};
  atelier::AreaLight key;
  key.center = {2.4, 3.5, 2.8};
  key.half_u = {0.8, 0, -0.7};
  key.half_v = {-0.35, 0.6, -0.4};
  key.radiance = {7, 7, 7};
  atelier::AreaLight rim = key;
  rim.center = {-2.6, 3.4, -2.4};
  rim.half_u = -key.half_u;
  instant.surroundings.area_lights = {key, rim};
  instant.surroundings.environment = atelier::constant_environment({0.5F, 0.5F, 0.5F});
  instant.surroundings.background.kind = atelier::Background::Kind::Environment;
  instant.surroundings.ground = atelier::Ground{0, {0.3F, 0.3F, 0.3F}, true};
  const atelier::PreparedScene scene = prepare(
      scene_of(instant),
      {.ambient = atelier::Ambient::PerVertex, .vertex_samples = 96, .ground_shadow_rays = 64});
  const atelier::Camera camera = atelier::dome_cameras({.cameras = 2,
                                                        .pairs = false,
                                                        .width = static_cast<int>(state.range(0)),
                                                        .height = static_cast<int>(state.range(1))},
                                                       {1, 1})[0];
  atelier::RenderOptions rays;
  rays.samples = 4;
  rays.penumbra_samples = 2;
  for (auto _ : state) {
    const atelier::Photograph taken = photograph(instant, scene, camera, rays);
    const atelier::Image light = atelier::exposed(taken.light, camera.gain);
    benchmark::DoNotOptimize(atelier::detected_labels(taken.labels, {}, {1, 1}));
    benchmark::DoNotOptimize(
        atelier::image_bytes(atelier::noisy(light, {}, 1, 1), atelier::ImageFormat::Png));
    benchmark::DoNotOptimize(atelier::image_bytes(light, atelier::ImageFormat::Png));
  }
}

BENCHMARK(photograph_one)
    ->Args({400, 480})
    ->Args({800, 1000})
    ->Args({1536, 2048})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

}  // namespace
