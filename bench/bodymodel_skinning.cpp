// One pose of a body of 20,000 vertices and 55 joints on one core, held against the time that the
// same bytes take to move, and the cost of one residual row of the Jacobian.
#include <benchmark/benchmark.h>

#include "bodymodel/skinning.h"
#include "bodymodel/skinning_device.h"
#include "bodymodel/skinning_jacobian.h"
#include "core/parallel.h"
#include "core/random.h"

namespace atelier {
namespace {

constexpr Index kVertices = 20'000;
constexpr int kJoints = 55;

// A tree as deep as a person's: a spine of five, four limbs of four, fingers of three.
BodyModel bench_body(int slots) {
  Random random{7};
  BodyModel model;
  model.skeleton.parents = {-1, 0, 0,  0,  1,  2,  3,  4,  5,  6,  7,  8, 9,
                            9,  9, 12, 13, 14, 16, 17, 18, 19, 15, 15, 15};
  while (static_cast<int>(model.skeleton.parents.size()) < kJoints) {
    const int finger = (static_cast<int>(model.skeleton.parents.size()) - 25) % 3;
    const int joint = static_cast<int>(model.skeleton.parents.size());
    model.skeleton.parents.push_back(finger == 0 ? (joint < 40 ? 20 : 21) : joint - 1);
  }
  model.skeleton.offsets.resize(kJoints, 3);
  for (int j = 0; j < kJoints; ++j) {
    model.skeleton.names.push_back("joint_" + std::to_string(j));
    model.skeleton.offsets.row(j) << uniform(random) - 0.5, uniform(random) - 0.5, 0.1;
  }
  model.mesh.vertices.resize(kVertices, 3);
  model.skin.joints.resize(kVertices, slots);
  model.skin.weights.resize(kVertices, slots);
  for (Index v = 0; v < kVertices; ++v) {
    model.mesh.vertices.row(v) << uniform(random), uniform(random), uniform(random);
    int joint = static_cast<int>(v * kJoints / kVertices);
    for (int k = 0; k < slots; ++k) {
      model.skin.joints(v, k) = joint;
      model.skin.weights(v, k) = uniform(random, 0.1, 1);
      joint = std::max(0, model.skeleton.parents[static_cast<std::size_t>(joint)]);
    }
    model.skin.weights.row(v) /= model.skin.weights.row(v).sum();
  }
  return model;
}

Pose bench_pose(const BodyModel& model) {
  Random random{8};
  Pose pose = rest_pose(model.skeleton);
  for (Index i = 0; i < pose.rotations.size(); ++i) {
    pose.rotations.data()[i] = 0.3 * normal(random);
  }
  return pose;
}

std::size_t bytes_a_pose(int slots) {
  return static_cast<std::size_t>(kVertices) *
         (2 * 3 * sizeof(double) +
          static_cast<std::size_t>(slots) * (sizeof(int) + sizeof(double)));
}

void skin(benchmark::State& state, SkinMethod method, bool vectors) {
  set_thread_count(1);
  const int slots = static_cast<int>(state.range(0));
  const BodyModel model = bench_body(slots);
  const ShapedBody body = shape_body(model);
  const Pose pose = bench_pose(model);
  SkinOptions options;
  options.method = method;
  options.vectors = vectors;
  for (auto _ : state) {
    benchmark::DoNotOptimize(skin_vertices(model, body, pose, options));
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations() * bytes_a_pose(slots)));
}
BENCHMARK_CAPTURE(skin, linear, SkinMethod::Linear, true)
    ->Arg(4)
    ->Arg(8)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(skin, linear_scalar, SkinMethod::Linear, false)
    ->Arg(4)
    ->Arg(8)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(skin, dual_quaternion, SkinMethod::DualQuaternion, false)
    ->Arg(4)
    ->Arg(8)
    ->Unit(benchmark::kMicrosecond);

// The limit: read what skinning reads, write what it writes, compute nothing to speak of.
void memory_limit(benchmark::State& state) {
  const int slots = static_cast<int>(state.range(0));
  const std::size_t read = bytes_a_pose(slots) / sizeof(double) - 3 * kVertices;
  const Eigen::VectorXd from = Eigen::VectorXd::Ones(static_cast<Index>(read));
  for (auto _ : state) {
    Points to(kVertices, 3);
    const double sum = from.sum();
    to.setConstant(sum);
    benchmark::DoNotOptimize(to);
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations() * bytes_a_pose(slots)));
}
BENCHMARK(memory_limit)->Arg(4)->Arg(8)->Unit(benchmark::kMicrosecond);

void jacobian_rows(benchmark::State& state) {
  set_thread_count(1);
  const BodyModel model = bench_body(4);
  const PosedBody posed = pose_body(model, shape_body(model), bench_pose(model));
  const SkinChains chains = skin_chains(model);
  std::vector<int> vertices;
  for (int v = 0; v < kVertices; v += 5) {
    vertices.push_back(v);
  }
  const Index rows = static_cast<Index>(vertices.size());
  const Points directions = Points::Constant(rows, 3, 0.57735);
  std::size_t entries = 0;
  for (auto _ : state) {
    const SkinRows result = skin_jacobian_rows(model, posed, chains, vertices, directions);
    entries = result.joints.size();
    benchmark::DoNotOptimize(result.values.data());
  }
  state.counters["joints_a_row"] = static_cast<double>(entries) / static_cast<double>(rows);
  state.counters["seconds_a_row"] =
      benchmark::Counter(static_cast<double>(rows), benchmark::Counter::kIsIterationInvariantRate |
                                                        benchmark::Counter::kInvert);
}
BENCHMARK(jacobian_rows)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace atelier
