// The body under the clothes of one frame: the default human of 12,000 vertices, a scan of 20,000
// points with cloth about trunk and thighs, a personal body that is millimetres wrong. `frame` is
// all that a sequence spends on a frame: read once for each fit, fitted alone, then with its
// neighbours.
#include <cmath>

#include <benchmark/benchmark.h>

#include "bodymodel/human/default_human.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/skinning.h"
#include "bodymodel/underlying/underlying_sequence.h"
#include "core/normals.h"
#include "core/parallel.h"

namespace atelier {
namespace {

constexpr Index kScanPoints = 20'000;

struct Dressed {
  Triangles faces;
  Points posed;
  ClothedScan scan;
};

/// Faces cut in three at their middles until the mesh has so many vertices.
Mesh refined(const Mesh& mesh, Index vertices) {
  const Index cuts = std::min(vertices - mesh.vertices.rows(), mesh.faces.rows());
  Mesh fine;
  fine.vertices.resize(mesh.vertices.rows() + cuts, 3);
  fine.vertices.topRows(mesh.vertices.rows()) = mesh.vertices;
  fine.faces.resize(mesh.faces.rows() + 2 * cuts, 3);
  fine.faces.topRows(mesh.faces.rows()) = mesh.faces;
  for (Index i = 0; i < cuts; ++i) {
    const Index f = i * mesh.faces.rows() / cuts;
    const int a = mesh.faces(f, 0);
    const int b = mesh.faces(f, 1);
    const int c = mesh.faces(f, 2);
    const Index middle = mesh.vertices.rows() + i;
    fine.vertices.row(middle) =
        (mesh.vertices.row(a) + mesh.vertices.row(b) + mesh.vertices.row(c)) / 3;
    const int m = static_cast<int>(middle);
    fine.faces.row(f) << a, b, m;
    fine.faces.row(mesh.faces.rows() + 2 * i) << b, c, m;
    fine.faces.row(mesh.faces.rows() + 2 * i + 1) << c, a, m;
  }
  return fine;
}

const Dressed& dressed() {
  static const Dressed one = [] {
    const BodyModel model = default_human();
    Mesh truth;
    truth.vertices = skin_vertices(model, rest_pose(model.skeleton));
    truth.faces = model.mesh.faces;
    Dressed made;
    made.faces = truth.faces;
    made.posed = truth.vertices;
    for (Index v = 0; v < made.posed.rows(); ++v) {
      const Eigen::RowVector3d p = truth.vertices.row(v);
      made.posed.row(v) +=
          0.005 * Eigen::RowVector3d(std::sin(9 * p.y()), std::sin(7 * p.x()), std::cos(8 * p.y()));
    }
    Mesh scan = refined(truth, kScanPoints);
    const Points normals = vertex_normals(scan.vertices, scan.faces);
    const double height = scan.vertices.col(1).maxCoeff();
    for (Index v = 0; v < scan.vertices.rows(); ++v) {
      const Eigen::RowVector3d p = scan.vertices.row(v);
      const bool worn = p.y() > 0.3 * height && p.y() < 0.8 * height && std::abs(p.x()) < 0.2;
      made.scan.roles.push_back(worn ? ScanRole::Cloth : ScanRole::Skin);
      if (worn) {
        scan.vertices.row(v) += (0.004 + 0.03 * std::abs(std::sin(11 * p.y()))) * normals.row(v);
      }
    }
    made.scan.mesh = std::move(scan);
    return made;
  }();
  return one;
}

void frame(benchmark::State& state) {
  const Dressed& at = dressed();
  set_thread_count(static_cast<int>(state.range(0)));
  UnderlyingSequenceOptions options;
  options.gap_frames = 0;  // once a sequence
  const auto load = [&](Index) { return PosedScan{at.posed, scan_surface(at.scan)}; };
  constexpr Index kFrames = 4;
  double skin = 0;
  double outside = 0;
  double proximity = 0;
  for (auto _ : state) {
    const UnderlyingSequence sequence(at.faces, kFrames, load, options);
    for (Index i = 0; i < kFrames; ++i) {
      const UnderlyingBody body = sequence.at(i);
      skin = body.certificate.skin_distance;
      outside = body.certificate.outside_rate;
      proximity = body.certificate.proximity;
    }
  }
  set_thread_count(0);
  state.counters["seconds_a_frame"] = benchmark::Counter(
      kFrames, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  state.counters["skin_mm"] = 1e3 * skin;
  state.counters["outside_rate"] = outside;
  state.counters["proximity_mm"] = 1e3 * proximity;
}
BENCHMARK(frame)
    ->Arg(1)
    ->Arg(2)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime();

// Its parts.
void prepare_scan(benchmark::State& state) {
  const Dressed& at = dressed();
  for (auto _ : state) {
    benchmark::DoNotOptimize(scan_surface(at.scan).areas.data());
  }
}
BENCHMARK(prepare_scan)->Unit(benchmark::kMillisecond);

void fit_alone(benchmark::State& state) {
  const Dressed& at = dressed();
  const ScanSurface scan = scan_surface(at.scan);
  const BodyCover cover = body_cover(at.faces, cover_votes(at.faces, at.posed, scan));
  UnderlyingBodyOptions options;
  options.iterations = static_cast<int>(state.range(0));
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        underlying_body(at.faces, at.posed, scan, cover, {}, options).vertices.data());
  }
}
BENCHMARK(fit_alone)->Arg(1)->Arg(4)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace atelier
