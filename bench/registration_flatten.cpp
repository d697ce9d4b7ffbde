// Laying a sewn garment flat. Counters: s (whole), triangles, p99 (stretch, %).
#include <chrono>
#include <cmath>
#include <numbers>

#include <benchmark/benchmark.h>

#include "registration/edge_paths.h"
#include "registration/flattening/cut_to_disks.h"
#include "registration/flattening/find_seams.h"
#include "registration/flattening/flat_pattern.h"

namespace atelier {
namespace {

/// A skirt with folds: a cone whose radius waves, `around` x `along` quads.
Mesh folded_skirt(int around, int along) {
  Mesh mesh;
  mesh.vertices.resize(around * (along + 1), 3);
  mesh.faces.resize(2 * around * along, 3);
  Index f = 0;
  for (int j = 0; j <= along; ++j) {
    for (int i = 0; i < around; ++i) {
      const double u = 2 * std::numbers::pi * i / around;
      const double v = static_cast<double>(j) / along;
      const double radius = 0.12 + 0.25 * v + 0.03 * v * v * std::sin(9 * u);
      mesh.vertices.row(j * around + i) << radius * std::cos(u), 1 - 0.6 * v, -radius * std::sin(u);
      if (j < along) {
        const int a = j * around + i;
        const int b = j * around + (i + 1) % around;
        mesh.faces.row(f++) << a, a + around, b;
        mesh.faces.row(f++) << b, a + around, b + around;
      }
    }
  }
  return mesh;
}

void flatten_opened(benchmark::State& state) {
  const Mesh mesh =
      folded_skirt(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  FlatMeasures measures;
  for (auto _ : state) {
    const std::vector<char> cut = cut_to_disks(
        topology, std::vector<char>(static_cast<std::size_t>(topology.edges.rows()), 0),
        edge_lengths(topology, mesh.vertices));
    measures = measure_flat(mesh, flatten_surface(mesh, cut));
  }
  state.counters["triangles"] = static_cast<double>(mesh.faces.rows());
  state.counters["p99"] = 100 * measures.strain_p99;
}
BENCHMARK(flatten_opened)
    ->Args({100, 50})
    ->Args({160, 80})
    ->Unit(benchmark::kSecond)
    ->Iterations(1);

void find_seams_of_skirt(benchmark::State& state) {
  const Mesh mesh = folded_skirt(100, 50);
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  FoundSeams found;
  for (auto _ : state) {
    found = find_seams(mesh, std::vector<char>(static_cast<std::size_t>(topology.edges.rows()), 0));
  }
  state.counters["triangles"] = static_cast<double>(mesh.faces.rows());
  state.counters["added"] = found.added;
}
BENCHMARK(find_seams_of_skirt)->Unit(benchmark::kSecond)->Iterations(1);

}  // namespace
}  // namespace atelier
