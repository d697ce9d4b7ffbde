// One picture of a dressed person: body of 10,000 vertices and garment of 10,000, a network each,
// into a picture of 1024 x 1024, with everything that a new frame costs (tree, occlusion, raster,
// networks). Arguments: texels a side, channels, rays a vertex and side (root), pictures' samples.
// Networks are random: the arithmetic does not ask what they learnt.
#include <cmath>
#include <memory>
#include <numbers>

#include <benchmark/benchmark.h>

#include "appearance/network/painter.h"
#include "core/error.h"

namespace atelier {
namespace {

constexpr int kSide = 1024;   // px
constexpr int kAround = 100;  // vertices
constexpr int kAlong = 99;    // their rows

/// A tube round the Y axis with one chart.
Mesh tube(double radius) {
  Mesh mesh;
  mesh.vertices.resize(kAround * (kAlong + 1), 3);
  mesh.faces.resize(2 * kAround * kAlong, 3);
  mesh.uvs.resize((kAround + 1) * (kAlong + 1), 2);
  mesh.uv_faces.resize(mesh.faces.rows(), 3);
  Index f = 0;
  for (int j = 0; j <= kAlong; ++j) {
    for (int i = 0; i <= kAround; ++i) {
      mesh.uvs.row(j * (kAround + 1) + i) << 0.02 + 0.96 * i / kAround, 0.02 + 0.96 * j / kAlong;
      if (i == kAround) {
        continue;
      }
      const double angle = 2 * std::numbers::pi * i / kAround;
      mesh.vertices.row(j * kAround + i) << radius * std::cos(angle), 1.6 * j / kAlong,
          -radius * std::sin(angle);
      if (j < kAlong) {
        const int a = j * kAround + i;
        const int b = j * kAround + (i + 1) % kAround;
        const int t = j * (kAround + 1) + i;
        mesh.faces.row(f) << a, b, a + kAround;
        mesh.uv_faces.row(f++) << t, t + 1, t + kAround + 1;
        mesh.faces.row(f) << a + kAround, b, b + kAround;
        mesh.uv_faces.row(f++) << t + kAround + 1, t + 1, t + kAround + 2;
      }
    }
  }
  return mesh;
}

/// A network as before training, whose last convolutions give something.
std::shared_ptr<const AppearanceModel> model_of(const Mesh& mesh, int resolution, int channels) {
  AppearanceData data;
  data.name = "tube";
  data.faces = mesh.faces;
  data.uvs = mesh.uvs;
  data.uv_faces = mesh.uv_faces;
  data.camera_ids = {"a"};
  data.centers = Points::Zero(1, 3);
  data.widths = data.heights = {kSide};
  SurfaceFrame frame = surface_frame(mesh.vertices, mesh.faces, mesh.uvs, mesh.uv_faces);
  frame.visibility.setConstant(mesh.vertices.rows(), 2, 0.7F);
  data.frames = {frame};
  AppearanceView view;
  view.pixel = {0};
  view.u = view.v = {0.5F};
  view.colors = {120, 80, 60};
  data.views = {view};
  NetworkOptions options;
  options.resolution = resolution;
  options.channels = channels;
  auto model = std::make_shared<AppearanceModel>(initial_model(data, options, 1));
  for (auto& [name, tensor] : model->parameters) {
    if (name.ends_with(".last.g")) {
      tensor = tensor_of(std::vector<float>(tensor.data.size() / 4, 0.1F), tensor.shape);
    }
  }
  return model;
}

void paint(benchmark::State& state, Device device) {
  const Mesh body = tube(0.2);
  const Mesh garment = tube(0.25);
  PaintOptions options;
  options.samples = static_cast<int>(state.range(3));
  options.occlusion.strata = static_cast<int>(state.range(2));
  const auto texels = static_cast<int>(state.range(0));
  const auto channels = static_cast<int>(state.range(1));
  std::unique_ptr<Painter> painter;
  try {
    painter = std::make_unique<Painter>(
        std::vector<PaintedLayer>{{body.faces, model_of(body, texels, channels)},
                                  {garment.faces, model_of(garment, texels, channels)}},
        options, device);
  } catch (const EnvironmentError& error) {
    state.SkipWithError(error.what());
    return;
  }
  Camera camera;
  camera.id = "front";
  camera.width = camera.height = kSide;
  camera.fx = camera.fy = 1.5 * kSide;
  camera.cx = camera.cy = 0.5 * kSide;
  camera.camera_from_world_rotation << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  camera.camera_from_world_translation = {0, 0.8, 3};
  int frame = 0;
  painter->paint({body.vertices, garment.vertices}, camera);  // memory and libraries
  for (auto _ : state) {
    Points moved = garment.vertices;
    moved.col(1).array() += 1e-3 * std::sin(0.1 * ++frame);
    benchmark::DoNotOptimize(painter->paint({body.vertices, moved}, camera).data.data());
  }
  state.counters["frames/s"] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

BENCHMARK_CAPTURE(paint, cpu, Device::Cpu)
    ->Args({256, 8, 8, 1})
    ->Args({1024, 16, 8, 2})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(paint, cuda, Device::Cuda)
    ->Args({256, 8, 8, 1})
    ->Args({512, 16, 8, 1})
    ->Args({1024, 16, 4, 1})
    ->Args({1024, 16, 8, 1})
    ->Args({1024, 32, 8, 1})
    ->Args({1024, 16, 8, 2})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace atelier
