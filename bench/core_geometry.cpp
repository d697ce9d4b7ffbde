// Rates of the shared geometry: trees, raster, winding numbers.

#include <chrono>
#include <numbers>

#include <benchmark/benchmark.h>

#include "core/mesh.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/raster.h"
#include "core/tree.h"
#include "core/winding_number.h"

namespace {

using namespace atelier;

/// A wavy closed surface of 2 n m triangles, about a metre across.
Mesh wavy_torus(int n, int m) {
  Mesh mesh;
  mesh.vertices.resize(n * m, 3);
  mesh.faces.resize(2 * n * m, 3);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < m; ++j) {
      const double u = 2 * std::numbers::pi * i / n;
      const double v = 2 * std::numbers::pi * j / m;
      const double radius = 0.35 + (0.12 + 0.02 * std::sin(9 * u + 5 * v)) * std::cos(v);
      const int a = i * m + j;
      const int b = (i + 1) % n * m + j;
      const int c = i * m + (j + 1) % m;
      const int d = (i + 1) % n * m + (j + 1) % m;
      mesh.vertices.row(a) << radius * std::cos(u), 0.12 * std::sin(v), -radius * std::sin(u);
      mesh.faces.row(2 * a) << a, b, c;
      mesh.faces.row(2 * a + 1) << c, b, d;
    }
  }
  return mesh;
}

/// A wavy tube of 2 n m triangles, open at both ends: a trouser leg, an arm of a scan.
Mesh wavy_tube(int n, int m) {
  Mesh mesh;
  mesh.vertices.resize((n + 1) * m, 3);
  mesh.faces.resize(2 * n * m, 3);
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j < m; ++j) {
      const double u = 2 * std::numbers::pi * i / n;
      const double v = 2 * std::numbers::pi * j / m;
      const double radius = 0.25 + 0.03 * std::sin(5 * u + 3 * v);
      const int a = i * m + j;
      mesh.vertices.row(a) << radius * std::cos(v), 0.9 * i / n - 0.45, -radius * std::sin(v);
      if (i < n) {
        const int c = i * m + (j + 1) % m;
        mesh.faces.row(2 * a) << a, c, a + m;
        mesh.faces.row(2 * a + 1) << c, c + m, a + m;
      }
    }
  }
  return mesh;
}

const Mesh& large() {
  static const Mesh mesh = wavy_torus(500, 100);  // 100,000 triangles
  return mesh;
}

Points random_points(Index n, double size, std::uint64_t seed) {
  Random random{seed};
  Points points(n, 3);
  for (Index i = 0; i < points.size(); ++i) {
    points.data()[i] = uniform(random, -size, size);
  }
  return points;
}

/// Points within a centimetre of the surface: correspondences, contacts.
Points points_near(const Mesh& mesh, Index n) {
  Points points = random_points(n, 0.01, 7);
  for (Index i = 0; i < n; ++i) {
    points.row(i) += mesh.vertices.row(i * 7919 % mesh.vertices.rows());
  }
  return points;
}

void build(benchmark::State& state) {
  for (auto _ : state) {
    benchmark::DoNotOptimize(build_tree(large().vertices, large().faces));
  }
  state.SetItemsProcessed(state.iterations() * large().faces.rows());
}
BENCHMARK(build)->Name("tree/build/100k")->Unit(benchmark::kMillisecond)->UseRealTime();

void refit(benchmark::State& state) {
  TriangleTree tree = build_tree(large().vertices, large().faces);
  for (auto _ : state) {
    tree = refit_tree(std::move(tree), large().vertices);
  }
  state.SetItemsProcessed(state.iterations() * large().faces.rows());
}
BENCHMARK(refit)->Name("tree/refit/100k")->Unit(benchmark::kMillisecond)->UseRealTime();

void closest(benchmark::State& state, const Points& queries, Device device) {
  if (device == Device::Cuda && !cuda_available()) {
    state.SkipWithError("no CUDA device");
    return;
  }
  const TriangleTree tree = build_tree(large().vertices, large().faces);
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        closest_points(tree, queries, std::numeric_limits<double>::infinity(), device));
  }
  state.SetItemsProcessed(state.iterations() * queries.rows());
}
void closest_near(benchmark::State& state, Device device) {
  closest(state, points_near(large(), 100'000), device);
}
void closest_far(benchmark::State& state, Device device) {
  closest(state, random_points(100'000, 0.6, 8), device);
}
BENCHMARK_CAPTURE(closest_near, cpu, Device::Cpu)
    ->Name("tree/closest/near/cpu")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(closest_near, cuda, Device::Cuda)
    ->Name("tree/closest/near/cuda")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(closest_far, cpu, Device::Cpu)
    ->Name("tree/closest/anywhere/cpu")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(closest_far, cuda, Device::Cuda)
    ->Name("tree/closest/anywhere/cuda")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void rays(benchmark::State& state, Device device, bool any) {
  if (device == Device::Cuda && !cuda_available()) {
    state.SkipWithError("no CUDA device");
    return;
  }
  const TriangleTree tree = build_tree(large().vertices, large().faces);
  const Points origins = random_points(100'000, 0.6, 9);
  const Points targets = random_points(100'000, 0.4, 10);
  std::vector<Ray> all;
  for (Index i = 0; i < origins.rows(); ++i) {
    all.push_back({origins.row(i), targets.row(i) - origins.row(i)});
  }
  for (auto _ : state) {
    if (any) {
      benchmark::DoNotOptimize(any_hits(tree, all, device));
    } else {
      benchmark::DoNotOptimize(first_hits(tree, all, device));
    }
  }
  state.SetItemsProcessed(state.iterations() * origins.rows());
}
BENCHMARK_CAPTURE(rays, first_cpu, Device::Cpu, false)
    ->Name("tree/first_hit/cpu")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(rays, first_cuda, Device::Cuda, false)
    ->Name("tree/first_hit/cuda")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(rays, any_cpu, Device::Cpu, true)
    ->Name("tree/any_hit/cpu")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(rays, any_cuda, Device::Cuda, true)
    ->Name("tree/any_hit/cuda")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// 20,000 triangles and 20,000 queries. The direct sum is timed on every 20th query, in parallel as
/// well; "ratio" is its time for all queries over that of the tree, "error" the largest difference.
enum class Surface { Closed, Open };

void winding(benchmark::State& state, Surface surface, Device device) {
  if (device == Device::Cuda && !cuda_available()) {
    state.SkipWithError("no CUDA device");
    return;
  }
  const Mesh mesh = surface == Surface::Closed ? wavy_torus(200, 50) : wavy_tube(200, 50);
  const Points queries = random_points(20'000, 0.55, 11);
  constexpr Index kEvery = 20;
  const WindingTree tree = build_winding_tree(mesh.vertices, mesh.faces);
  const WindingOptions options = {static_cast<double>(state.range(0)) / 10};
  std::vector<double> fast;
  double seconds = 0;
  for (auto _ : state) {
    const auto start = std::chrono::steady_clock::now();
    fast = winding_numbers(tree, queries, options, device);
    seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  std::vector<double> exact(static_cast<std::size_t>(queries.rows() / kEvery));
  const auto start = std::chrono::steady_clock::now();
  parallel_for(queries.rows() / kEvery, 16, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      exact[i] = exact_winding_number(mesh.vertices, mesh.faces, queries.row(i * kEvery));
    }
  });
  const double direct =
      kEvery * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  double error = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    error = std::max(error, std::abs(exact[i] - fast[i * kEvery]));
  }
  state.counters["error"] = error;
  state.counters["ratio"] = direct / (seconds / static_cast<double>(state.iterations()));
  state.SetItemsProcessed(state.iterations() * queries.rows());
}
BENCHMARK_CAPTURE(winding, closed_cpu, Surface::Closed, Device::Cpu)
    ->Name("winding/closed/cpu/accuracy_x10")
    ->Arg(20)
    ->Arg(30)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(winding, open_cpu, Surface::Open, Device::Cpu)
    ->Name("winding/open/cpu/accuracy_x10")
    ->Arg(20)
    ->Arg(30)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(winding, closed_cuda, Surface::Closed, Device::Cuda)
    ->Name("winding/closed/cuda/accuracy_x10")
    ->Arg(20)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// 100,000 triangles that fill much of a 1920 x 1080 image; the rate is of the image's pixels.
void raster(benchmark::State& state, Device device) {
  if (device == Device::Cuda && !cuda_available()) {
    state.SkipWithError("no CUDA device");
    return;
  }
  Camera camera;
  camera.id = "bench";
  camera.width = 1920;
  camera.height = 1080;
  camera.fx = camera.fy = 2000;
  camera.cx = 960;
  camera.cy = 540;
  camera.camera_from_world_rotation << 1, 0, 0, 0, 0, -1, 0, 1, 0;  // from above
  camera.camera_from_world_translation = {0, 0, 1.8};
  Raster seen;
  for (auto _ : state) {
    seen = rasterize(large().vertices, large().faces, camera, {}, device);
  }
  const auto covered =
      std::count_if(seen.face.data.begin(), seen.face.data.end(), [](int f) { return f >= 0; });
  state.counters["covered"] = static_cast<double>(covered) / (1920.0 * 1080.0);
  state.counters["Mpix/s"] =
      benchmark::Counter(1920.0 * 1080.0 * 1e-6 * static_cast<double>(state.iterations()),
                         benchmark::Counter::kIsRate);
}
BENCHMARK_CAPTURE(raster, cpu, Device::Cpu)
    ->Name("raster/1080p/100k/cpu")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(raster, cuda, Device::Cuda)
    ->Name("raster/1080p/100k/cuda")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
