// Images of a 30,000-triangle scene as synthetic captures and previews take them, and bare rays.

#include <cmath>
#include <numbers>

#include <benchmark/benchmark.h>

#include "core/render/prepared_scene.h"
#include "core/render/studio.h"

namespace {

using atelier::Index;

// A folded, closed surface as tall as a person: 2 x 120 x 125 triangles.
atelier::RenderMesh folded_figure() {
  constexpr int kRows = 126;
  constexpr int kColumns = 120;
  atelier::RenderMesh figure;
  figure.mesh.vertices.resize(kRows * kColumns, 3);
  figure.mesh.uvs.resize(kRows * kColumns, 2);
  for (int r = 0; r < kRows; ++r) {
    const double t = static_cast<double>(r) / (kRows - 1);
    for (int c = 0; c < kColumns; ++c) {
      const double a = 2 * std::numbers::pi * c / kColumns;
      const double folds = 1 + 0.18 * (1 - t) * std::sin(11 * a + 4 * t);
      const double radius = (0.05 + 0.28 * (1 - t) + 0.06 * std::sin(9 * t)) * folds;
      figure.mesh.vertices.row(r * kColumns + c) << radius * std::sin(a), 1.75 * t,
          radius * std::cos(a);
      figure.mesh.uvs.row(r * kColumns + c) << 3.0 * c / kColumns, 3 * t;
    }
  }
  figure.mesh.faces.resize(2 * (kRows - 1) * kColumns, 3);
  Index f = 0;
  for (int r = 0; r + 1 < kRows; ++r) {
    for (int c = 0; c < kColumns; ++c) {
      const int d = (c + 1) % kColumns;
      figure.mesh.faces.row(f++) << r * kColumns + c, r * kColumns + d, (r + 1) * kColumns + d;
      figure.mesh.faces.row(f++) << r * kColumns + c, (r + 1) * kColumns + d,
          (r + 1) * kColumns + c;
    }
  }
  figure.mesh.uv_faces = figure.mesh.faces;
  auto weave = std::make_shared<atelier::Image>(512, 512, 3);
  for (int y = 0; y < 512; ++y) {
    for (int x = 0; x < 512; ++x) {
      const bool over = ((x / 8) + (y / 8)) % 2 == 0;
      weave->at(x, y, 0) = over ? 0.55f : 0.35f;
      weave->at(x, y, 1) = over ? 0.25f : 0.20f;
      weave->at(x, y, 2) = over ? 0.22f : 0.30f;
    }
  }
  figure.look.color = {1, 1, 1};
  figure.look.texture = weave;
  figure.look.sheen = 0.2f;
  return figure;
}

const atelier::Scene& scene() {
  static const atelier::Scene made = atelier::studio_scene({folded_figure()});
  return made;
}

atelier::Camera camera(int width, int height) {
  atelier::Camera c =
      atelier::camera_around(scene().meshes.front().mesh.vertices, {0.4, 0.1}, width, height);
  c.distortion_model = atelier::Distortion::Brown;
  c.distortion = {-0.08, 0.02, 0.0005, -0.0003, 0, 0, 0, 0};
  return c;
}

void image(benchmark::State& state, atelier::Ambient ambient, int samples) {
  const auto prepared = atelier::prepare(scene(), {.ambient = ambient});
  const auto view = camera(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  atelier::RenderOptions options;
  options.samples = samples;
  for (auto _ : state) {
    benchmark::DoNotOptimize(atelier::render(prepared, view, options));
  }
}

void capture(benchmark::State& state) {
  image(state, atelier::Ambient::PerVertex, 8);
}
void still(benchmark::State& state) {
  image(state, atelier::Ambient::PerPixel, 8);
}
void preview(benchmark::State& state) {
  image(state, atelier::Ambient::PerVertex, 4);
}

void prepare_capture(benchmark::State& state) {
  for (auto _ : state) {
    benchmark::DoNotOptimize(atelier::prepare(scene(), {.ambient = atelier::Ambient::PerVertex}));
  }
}

void prepare_still(benchmark::State& state) {
  for (auto _ : state) {
    benchmark::DoNotOptimize(atelier::prepare(scene()));
  }
}

// Bare rays, without shading: 16 neighbours at once from the camera, and from surface points into
// random directions.
void coherent_rays(benchmark::State& state) {
  const auto prepared = atelier::prepare(scene());
  const auto view = camera(800, 1000);
  const atelier::Vec3f eye = atelier::vec3f(atelier::camera_center(view));
  std::vector<RTCRayHit16> packets;
  for (int y = 0; y < 1000; y += 4) {
    for (int x = 0; x + 16 <= 800; x += 16) {
      RTCRayHit16 packet{};
      for (int lane = 0; lane < 16; ++lane) {
        const auto d = atelier::vec3f(*atelier::ray_direction(view, {x + lane + 0.5, y + 0.5}));
        packet.ray.org_x[lane] = eye.x;
        packet.ray.org_y[lane] = eye.y;
        packet.ray.org_z[lane] = eye.z;
        packet.ray.dir_x[lane] = d.x;
        packet.ray.dir_y[lane] = d.y;
        packet.ray.dir_z[lane] = d.z;
        packet.ray.tfar[lane] = 1e30f;
        packet.ray.mask[lane] = ~0u;
        packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
      }
      packets.push_back(packet);
    }
  }
  for (auto _ : state) {
    for (RTCRayHit16 packet : packets) {
      prepared.data().tree.intersect(packet);
      benchmark::DoNotOptimize(packet);
    }
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(packets.size()) * 16);
}

void incoherent_rays(benchmark::State& state) {
  const auto prepared = atelier::prepare(scene());
  const atelier::PreparedMesh& mesh = prepared.data().meshes.front();
  atelier::OcclusionRays rays;
  const auto count = static_cast<std::uint32_t>(mesh.normals.size());
  for (auto _ : state) {
    for (std::uint32_t i = 0; i < count; i += 4) {
      const atelier::Frame frame(mesh.normals[i]);
      rays.clear();
      for (std::uint32_t k = 0; k < 16; ++k) {
        rays.add(mesh.position(i) + 1e-4f * frame.n,
                 frame.world(atelier::cosine_direction(atelier::sobol_point(k, i))), 1e-4f, 1e30f);
      }
      rays.trace(prepared.data().tree, false);
      benchmark::DoNotOptimize(rays.visible(0));
    }
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>((count + 3) / 4) * 16);
}

}  // namespace

BENCHMARK(coherent_rays)->Unit(benchmark::kMillisecond);
BENCHMARK(incoherent_rays)->Unit(benchmark::kMillisecond);
BENCHMARK(capture)
    ->Args({400, 480})
    ->Args({800, 1000})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();
BENCHMARK(still)
    ->Args({400, 480})
    ->Args({800, 1000})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();
BENCHMARK(preview)
    ->Args({400, 480})
    ->Args({800, 1000})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();
BENCHMARK(prepare_capture)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();
BENCHMARK(prepare_still)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();
