// Tracking: frames a second with 2,000 sampled points of a scan an iteration and with all of them.
// Beside the time stands the mean error of the joints, so that speed is not bought with it, and the
// processor time of all threads: what counts where other programs run.
#include <algorithm>
#include <cmath>
#include <ctime>

#include <benchmark/benchmark.h>

#include "bodymodel/human/default_human.h"
#include "bodymodel/tracking/track.h"
#include "core/random.h"

namespace atelier {
namespace {

constexpr int kFrames = 24;
constexpr double kFps = 24;

struct Walk {
  BodyModel model;
  TrackInput input;
  std::vector<Points> joints;  // the true ones
};

/// The surface with vertices in the middles of as many faces as make it one of `count`.
Mesh refined_to(const Mesh& mesh, Index count) {
  const Index added = std::clamp<Index>(count - mesh.vertices.rows(), 0, mesh.faces.rows());
  Mesh out;
  out.vertices.resize(mesh.vertices.rows() + added, 3);
  out.vertices.topRows(mesh.vertices.rows()) = mesh.vertices;
  out.faces.resize(mesh.faces.rows() + 2 * added, 3);
  out.faces.topRows(mesh.faces.rows()) = mesh.faces;
  for (Index i = 0; i < added; ++i) {
    const Index f = i * mesh.faces.rows() / added;  // spread over the surface
    const Eigen::RowVector3i t = mesh.faces.row(f);
    const int v = static_cast<int>(mesh.vertices.rows() + i);
    out.vertices.row(v) =
        (mesh.vertices.row(t[0]) + mesh.vertices.row(t[1]) + mesh.vertices.row(t[2])) / 3;
    out.faces.row(f) << t[0], t[1], v;
    out.faces.row(mesh.faces.rows() + 2 * i) << t[1], t[2], v;
    out.faces.row(mesh.faces.rows() + 2 * i + 1) << t[2], t[0], v;
  }
  return out;
}

/// Someone who walks and turns: keypoints with noise, the body's own surface as scan with
/// 1 mm of noise: 20,000 points.
Walk make_walk() {
  DefaultHumanOptions human;
  human.shape_basis = false;
  Walk walk;
  walk.model = default_human(human);
  walk.input.keypoint_names = {
      "nose",          "neck",           "right_shoulder", "right_elbow",   "right_wrist",
      "left_shoulder", "left_elbow",     "left_wrist",     "mid_hip",       "right_hip",
      "right_knee",    "right_ankle",    "left_hip",       "left_knee",     "left_ankle",
      "left_big_toe",  "left_small_toe", "left_heel",      "right_big_toe", "right_small_toe",
      "right_heel"};
  walk.input.fps = kFps;
  const FittedPerson person = fitted_person(walk.model, walk.input.keypoint_names);
  Random random{.seed = 7};
  for (int f = 0; f < kFrames; ++f) {
    const double t = f / kFps;
    Pose pose = rest_pose(person.shaped.skeleton);
    const auto turn = [&](const char* name, double x, double y, double z) {
      pose.rotations.row(find_joint(person.shaped.skeleton, name)) << x, y, z;
    };
    const double swing = std::sin(5 * t);
    turn("pelvis", 0, t, 0);
    turn("left_hip", -0.5 * swing, 0, 0);
    turn("right_hip", 0.5 * swing, 0, 0);
    turn("left_knee", 0.4 + 0.3 * swing, 0, 0);
    turn("right_knee", 0.4 - 0.3 * swing, 0, 0);
    turn("left_elbow", 0, -0.5, 0);
    pose.root_translation = {0.8 * t, 0, 0.3 * t};
    TrackFrame frame;
    frame.keypoints =
        marker_positions(person.places.riding, forward_kinematics(person.shaped.skeleton, pose));
    for (Index i = 0; i < frame.keypoints.size(); ++i) {
      frame.keypoints.data()[i] += 0.008 * normal(random);
    }
    frame.deviations = Eigen::VectorXd::Constant(frame.keypoints.rows(), 0.005);
    Mesh skin;
    skin.vertices = skin_vertices(walk.model, pose);
    skin.faces = walk.model.mesh.faces;
    Mesh scan = refined_to(skin, 20000);
    for (Index i = 0; i < scan.vertices.size(); ++i) {
      scan.vertices.data()[i] += 0.001 * normal(random);
    }
    frame.scan = scan_points(
        scan,
        std::vector<ScanPart>(static_cast<std::size_t>(scan.vertices.rows()), ScanPart::Skin));
    walk.joints.push_back(forward_kinematics(person.shaped.skeleton, pose).positions);
    walk.input.frame_ids.push_back(f);
    walk.input.frames.push_back(std::move(frame));
  }
  return walk;
}

/// Argument 0: points an iteration, 0 all; argument 1: fingers sought too (52 joints).
void track_frames(benchmark::State& state) {
  static const Walk walk = make_walk();
  TrackOptions options;
  options.samples = static_cast<int>(state.range(0));
  options.fingers = state.range(1) != 0;
  double error = 0;
  const std::clock_t before = std::clock();
  for (auto _ : state) {
    const Tracking found = track(walk.model, walk.input, options);
    error = 0;
    for (std::size_t f = 0; f < walk.joints.size(); ++f) {
      error += (found.tracked.joints[f].topRows(22) - walk.joints[f].topRows(22))
                   .rowwise()
                   .norm()
                   .mean() /
               static_cast<double>(walk.joints.size());
    }
  }
  const double cpu = static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;  // all threads
  state.counters["cpu_ms_a_frame"] = 1e3 * cpu / static_cast<double>(state.iterations() * kFrames);
  state.SetItemsProcessed(state.iterations() * kFrames);  // frames a second
  state.counters["joint_mm"] = 1e3 * error;
  state.counters["scan_points"] = static_cast<double>(walk.input.frames[0].scan.points.rows());
}

BENCHMARK(track_frames)
    ->Args({2000, 0})
    ->Args({2000, 1})
    ->Args({0, 0})
    ->Args({0, 1})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
}  // namespace atelier
