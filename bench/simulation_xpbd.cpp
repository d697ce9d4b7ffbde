// Speed of the cloth solver. Counters: ms (a frame, on its device), Gproj/s (constraint
// projections), limit_ms (the physical limit on an H100 by the formula of the targets: barriers and
// phases, or bytes), x_limit (ms / limit_ms), colours_ms and x_colours (the same with every colour
// of a phase counted), and what the speed cost: strain_p95, strain_max [%], residual_um (springs),
// deepest_um. Rows of projective dynamics on CUDA end with its name: limit_ms is what the products
// of its iterations read, at 3 TB/s, inverse_MB one of their matrices, TB/s what was read of them.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <numeric>

#include <benchmark/benchmark.h>

#include "simulation/contact/body_contact_math.h"
#include "simulation/contact/crossings.h"
#include "simulation/projective/elastic_rows.h"
#include "simulation/projective/inverse_factor.h"
#include "simulation/solver.h"
#include "simulation/xpbd/xpbd.h"

namespace atelier {
namespace {

constexpr double kPi = 3.14159265358979323846;

Garment garment_of(Mesh mesh) {
  Garment garment;
  garment.name = "bench";
  garment.mesh = std::move(mesh);
  garment.material.density = 0.2;
  garment.material.stretch_warp = 1000;
  garment.material.stretch_weft = 1000;
  garment.material.bending = 1e-5;
  garment.material.friction = 0.3;
  garment.material.thickness = 0.002;
  return garment;
}

/// `side` x `side` vertices, one diagonal; `size` metres each way.
Mesh square(int side, double size = 1) {
  Mesh mesh;
  mesh.vertices.resize(side * side, 3);
  mesh.faces.resize(2 * (side - 1) * (side - 1), 3);
  Index f = 0;
  for (int r = 0; r < side; ++r) {
    for (int c = 0; c < side; ++c) {
      mesh.vertices.row(r * side + c) << size * c / (side - 1.0), 0, size * r / (side - 1.0);
      if (r + 1 < side && c + 1 < side) {
        const int a = r * side + c;
        mesh.faces.row(f++) << a, a + side, a + side + 1;
        mesh.faces.row(f++) << a, a + side + 1, a + 1;
      }
    }
  }
  return mesh;
}

/// A skirt: rings of vertices with every second one turned by half a step, jittered so that no two
/// triangles are alike, flaring from `top` to `bottom` radius over a metre. Without `turned`,
/// straight columns.
Mesh skirt(int around, int rings, double top, double bottom, bool turned = true) {
  Mesh mesh;
  mesh.vertices.resize(around * rings, 3);
  mesh.faces.resize(2 * around * (rings - 1), 3);
  Index f = 0;
  for (int r = 0; r < rings; ++r) {
    for (int i = 0; i < around; ++i) {
      const double wiggle =
          r == 0 ? 0 : 0.2 * std::sin(12.9898 * (r * around + i)) * std::cos(78.233 * i + r);
      const double share = (r + 0.5 * wiggle) / (rings - 1);
      const double angle =
          2 * kPi * (i + (turned ? 0.5 * (r % 2) + wiggle : 0.1 * wiggle)) / around;
      const double radius = top + (bottom - top) * share;
      mesh.vertices.row(r * around + i) << radius * std::cos(angle), 0.5 - share,
          radius * std::sin(angle);
      if (r + 1 < rings) {
        const int a = r * around + i;
        const int b = r * around + (i + 1) % around;
        const int c = (r + 1) * around + (r % 2 == 0 ? i : (i + 1) % around);
        const int d = (r + 1) * around + (r % 2 == 0 ? (i + around - 1) % around : i);
        mesh.faces.row(f++) << a, b, c;
        mesh.faces.row(f++) << a, c, d;
      }
    }
  }
  return mesh;
}

/// Hips and two legs in one: a smooth closed body of `side` rings of as many vertices.
Mesh body_mesh(int side) {
  Mesh mesh;
  mesh.vertices.resize(side * side + 2, 3);
  std::vector<Eigen::RowVector3i> faces;
  for (int r = 0; r < side; ++r) {
    const double y = 0.7 - 1.4 * r / (side - 1);
    const double cap = std::sqrt(std::max(0.02, 1 - std::pow(y / 0.72, 8)));
    for (int i = 0; i < side; ++i) {
      const double a = 2 * kPi * i / side;
      // Narrow waist at the top of the skirt, a waist between the legs below.
      const double radius = cap * (0.15 + 0.03 * std::exp(-std::pow((y - 0.25) / 0.15, 2))) *
                            (1 + 0.25 * std::cos(2 * a) * (y < 0 ? -y : 0));
      mesh.vertices.row(r * side + i) << radius * std::cos(a), y, radius * std::sin(a);
      if (r + 1 < side) {
        const int p = r * side + i;
        const int q = r * side + (i + 1) % side;
        faces.emplace_back(p, q, q + side);
        faces.emplace_back(p, q + side, p + side);
      }
    }
  }
  const int top = side * side;
  mesh.vertices.row(top) << 0, 0.71, 0;
  mesh.vertices.row(top + 1) << 0, -0.71, 0;
  for (int i = 0; i < side; ++i) {
    const int n = (i + 1) % side;
    faces.emplace_back(top, n, i);
    faces.emplace_back(top + 1, (side - 1) * side + i, (side - 1) * side + n);
  }
  mesh.faces.resize(static_cast<Index>(faces.size()), 3);
  for (std::size_t i = 0; i < faces.size(); ++i) {
    mesh.faces.row(static_cast<Index>(i)) = faces[i];
  }
  return mesh;
}

struct Case {
  Cloth cloth;
  Mesh body;
  XpbdOptions options;
  int scenes = 1;
};

Control control_of(const Case& c, int frame) {
  Control control;
  if (c.body.vertices.rows() > 0) {
    const auto at = [&](int f) -> Points {
      const double t = f / 60.0;
      return c.body.vertices.rowwise() +
             Eigen::RowVector3d(0.06 * std::sin(5 * t), 0.02 * std::sin(7 * t), 0);
    };
    control.body_start = at(frame);
    control.body_end = at(frame + 1);
  }
  return control;
}

/// Waits and colours on an H100: a barrier takes 0.5 us in a cluster of 16 blocks, 1.1 us over the
/// grid; 0.1 us a step of springs, 0.17 us where it has hinges.
double barrier_seconds(const Schedule& s) {
  const int patches = s.phases[0].patch_end - s.phases[0].patch_begin;
  return patches <= 16 ? 0.5e-6 : 1.1e-6;
}
double step_seconds(const Case& c) {
  return c.cloth.hinges.empty() ? 0.1e-6 : 0.17e-6;
}

int edge_count(const Schedule& s) {
  int out = 0;
  for (const Schedule::Colour& colour : s.colours) {
    out += colour.begin[2] - colour.begin[0] - colour.paired;
  }
  return out;
}

/// Memory at 3 TB/s: a particle is read and written with its start and velocity in a substep and
/// again in every phase; an edge is 24 bytes.
double memory_ms(const Case& c) {
  const double bytes = c.options.substeps * (128.0 * static_cast<double>(c.cloth.mass.size()) +
                                             24.0 * c.options.iterations *
                                                 static_cast<double>(edge_count(c.cloth.schedule)));
  return 1e3 * bytes * c.scenes / 3e12;
}

/// The limit as the targets have it: substeps x [2 barriers + iterations x phases x (barrier + a
/// step)], or memory. It takes a phase as one step, whatever its colours, and knows nothing of
/// scenes but their bytes.
double limit_ms(const Case& c) {
  const double barrier = barrier_seconds(c.cloth.schedule);
  const double phases = static_cast<double>(c.cloth.schedule.phases.size());
  const double substep = 2 * barrier + c.options.iterations * phases * (barrier + step_seconds(c));
  return std::max(1e3 * c.options.substeps * substep, memory_ms(c));
}

/// The finer one: a step for each colour of a phase's widest patch, once more where its patches are
/// more than the 132 multiprocessors, and no barrier between blocks from 132 scenes on, where a
/// block has a scene and scenes beyond a multiple of 132 wait for the ones before.
double colours_ms(const Case& c) {
  const Schedule& s = c.cloth.schedule;
  const double barrier = c.scenes >= 132 ? 0 : barrier_seconds(s);
  double iteration = 0;
  for (const Schedule::Phase& phase : s.phases) {
    int colours = 0;
    for (int p = phase.patch_begin; p < phase.patch_end; ++p) {
      colours = std::max(colours, s.patches[p].colour_end - s.patches[p].colour_begin);
    }
    const double waves = std::ceil((phase.patch_end - phase.patch_begin) / 132.0);
    iteration += barrier + waves * colours * step_seconds(c);
  }
  const double steps = c.options.substeps * (2 * barrier + c.options.iterations * iteration);
  return std::max(1e3 * steps * std::ceil(c.scenes / 132.0), memory_ms(c));
}

void run(benchmark::State& state, Case c, Device device) {
  if (device == Device::Cuda && !cuda_available()) {
    state.SkipWithError("no CUDA device");
    return;
  }
  // Always the same frames, so that two versions are timed on the same motion.
  const int settle = device == Device::Cpu ? 20 : c.scenes > 1 ? 60 : 300;
  c.options.report = false;
  const auto make_solver = [&] {
    return ClothSweep(c.cloth, std::vector<ClothVariation>(static_cast<std::size_t>(c.scenes)),
                      c.body.faces, c.options, device);
  };
  if (device == Device::Cuda) {
    // Long enough for a device to leave its idle clocks.
    ClothSweep spare = make_solver();
    const auto begin = std::chrono::steady_clock::now();
    for (int f = 0; std::chrono::steady_clock::now() - begin < std::chrono::seconds(1); ++f) {
      spare.advance(control_of(c, f));
    }
  }
  ClothSweep solver = make_solver();
  int frame = 0;
  for (; frame < settle; ++frame) {
    solver.advance(control_of(c, frame));
  }
  std::vector<double> ms;
  for (auto _ : state) {
    const Control control = control_of(c, frame++);
    const auto before = std::chrono::steady_clock::now();
    const FrameReport report = solver.advance(control)[0];
    const double wall =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count();
    const double seconds = device == Device::Cuda ? report.device_ms / 1e3 : wall;
    state.SetIterationTime(seconds);
    ms.push_back(1e3 * seconds);
  }
  std::sort(ms.begin(), ms.end());
  const double median = ms[ms.size() / 2];
  state.counters["ms"] = median;
  state.counters["Gproj/s"] = static_cast<double>(c.cloth.schedule.order.size()) *
                              c.options.substeps * c.options.iterations * c.scenes / (median * 1e6);
  if (device == Device::Cuda) {
    state.counters["limit_ms"] = limit_ms(c);
    state.counters["x_limit"] = median / limit_ms(c);
    state.counters["colours_ms"] = colours_ms(c);
    state.counters["x_colours"] = median / colours_ms(c);
    state.counters["scene_frames/s"] = c.scenes * 1e3 / median;
  }
  state.counters["phases"] = static_cast<double>(c.cloth.schedule.phases.size());
  state.counters["colours"] = c.cloth.schedule.max_colours;
  // Two frames with numbers: what the speed cost.
  XpbdOptions with_report = c.options;
  with_report.report = true;
  ClothSolver reporter(c.cloth, c.body.faces, with_report, device);
  reporter.set_state(solver.state(0));
  FrameReport last;
  for (int i = 0; i < 2; ++i) {
    last = reporter.advance(control_of(c, frame++));
  }
  state.counters["strain_p50_%"] = 100 * last.strain_p50;
  state.counters["strain_p95_%"] = 100 * last.strain_p95;
  state.counters["strain_max_%"] = 100 * last.strain_max;
  state.counters["residual_um"] = 1e6 * last.spring_residual;
  state.counters["deepest_um"] = 1e6 * last.penetration_depth;
  state.counters["touching"] = last.body_contacts;
  state.counters["self"] = last.self_contacts;
  state.counters["pairs"] = last.self_candidates;
  state.counters["searches"] = last.self_searches;
  state.counters["renewals"] = last.self_renewals;
  state.counters["crossings"] =
      c.options.self_contact ? count_crossings(solver.state(0).positions, c.cloth.faces) : 0;
}

/// Bytes of the matrix whose products solve an iteration of projective dynamics on a GPU, in half
/// precision where `half` is asked for and serves.
double inverse_bytes(const Cloth& cloth, double h, bool half) {
  std::vector<int> vertices(cloth.mass.size());
  std::iota(vertices.begin(), vertices.end(), 0);
  std::vector<int> place(cloth.mass.size(), -1);
  int count = 0;
  for (std::size_t v = 0; v < place.size(); ++v) {
    place[v] = cloth.fixed[v] == 0 ? count++ : -1;
  }
  Points positions(count, 3);
  std::vector<double> mass(static_cast<std::size_t>(count));
  for (std::size_t v = 0; v < place.size(); ++v) {
    if (place[v] >= 0) {
      positions.row(place[v]) = cloth.rest_positions.row(static_cast<Index>(v));
      mass[place[v]] = cloth.mass[v];
    }
  }
  const Eigen::SparseMatrix<double> matrix =
      projective_matrix(make_elastic_rows(cloth, vertices), cloth.mass, place, count, h);
  const InverseFactor factor(matrix, positions);
  return static_cast<double>(factor.values().size()) *
         (half && half_precision_serves(matrix, mass) ? 2 : sizeof(float));
}

/// The same by projective dynamics with dry friction, with its usual substeps and iterations.
void run_projective(benchmark::State& state, const Case& c, bool half) {
  if (!cuda_available()) {
    state.SkipWithError("no CUDA device");
    return;
  }
  SolverOptions options;
  const CommonSolverOptions& common = c.options;
  static_cast<CommonSolverOptions&>(options) = common;
  options.name = "projective-friction";
  options.projective.half_precision = half;
  options.report = false;
  const SimulationModel model{c.cloth, c.body.faces};
  const std::unique_ptr<Solver> solver = create_solver(model, options, Device::Cuda);
  int frame = 0;
  for (; frame < 300; ++frame) {
    solver->step(control_of(c, frame));
  }
  std::vector<double> ms;
  for (auto _ : state) {
    ms.push_back(solver->step(control_of(c, frame++)).device_ms);
    state.SetIterationTime(ms.back() / 1e3);
  }
  std::sort(ms.begin(), ms.end());
  const double median = ms[ms.size() / 2];
  const double h = options.time_step / options.projective.substeps;
  const double matrix = inverse_bytes(c.cloth, h, half);
  const double read = 2 * matrix * options.projective.substeps * options.projective.iterations;
  state.counters["ms"] = median;
  state.counters["ms_most"] = ms.back();
  state.counters["limit_ms"] = 1e3 * read / 3e12;
  state.counters["x_limit"] = median / (1e3 * read / 3e12);
  state.counters["inverse_MB"] = matrix / 1e6;
  state.counters["TB/s"] = read / (median * 1e9);
  options.report = true;
  const std::unique_ptr<Solver> reporter = create_solver(model, options, Device::Cuda);
  reporter->set_state(solver->state());
  const FrameReport last = reporter->step(control_of(c, frame));
  state.counters["strain_p50_%"] = 100 * last.strain_p50;
  state.counters["strain_p95_%"] = 100 * last.strain_p95;
  state.counters["strain_max_%"] = 100 * last.strain_max;
  state.counters["deepest_um"] = 1e6 * last.penetration_depth;
  state.counters["touching"] = last.body_contacts;
  state.counters["self"] = last.self_contacts;
  state.counters["pairs"] = last.self_candidates;
  state.counters["searches"] = last.self_searches;
  state.counters["renewals"] = last.self_renewals;
  state.counters["crossings"] =
      c.options.self_contact ? count_crossings(solver->state().positions, c.cloth.faces) : 0;
}

/// Hung by its first row.
Case hanging_square(int side, int iterations, int patches = 0) {
  Case c;
  std::vector<int> pins(static_cast<std::size_t>(side));
  std::iota(pins.begin(), pins.end(), 0);
  ClothOptions options;
  options.schedule.patches = patches;
  c.cloth = make_cloth(garment_of(square(side)), pins, options);
  c.options.iterations = iterations;
  return c;
}

/// Every 16th vertex each way.
std::vector<int> quilt_pins(int columns, int rows) {
  std::vector<int> pins;
  for (int r = 0; r < rows; r += 16) {
    for (int k = 0; k < columns; k += 16) {
      pins.push_back(r * columns + k);
    }
  }
  return pins;
}

/// Cells of a centimetre, pinned like a quilt: ten substeps hold no more cloth than that up, so the
/// strain stays that of a fabric and the times count.
Case quilted_square(int side) {
  Case c;
  c.cloth = make_cloth(garment_of(square(side, (side - 1) / 100.0)), quilt_pins(side, side));
  return c;
}

Case hanging_skirt(int around, int rings, int iterations) {
  Case c;
  const Garment garment = garment_of(skirt(around, rings, 0.17, 0.45));
  std::vector<int> waist(static_cast<std::size_t>(around));
  std::iota(waist.begin(), waist.end(), 0);
  c.cloth = make_cloth(garment, waist);
  c.options.iterations = iterations;
  return c;
}

/// The skirt rides by its waist on the swaying body, which has `side` squared vertices.
Case dressed(int around, int rings, bool self_contact, int patches = 0, int side = 100) {
  Case c;
  Garment garment = garment_of(skirt(around, rings, 0.19, 0.4, false));
  c.body = body_mesh(side);
  for (int i = 0; i < around; ++i) {
    const Eigen::RowVector3d p = garment.mesh.vertices.row(i);
    // To the nearest point of the body, so that every vertex of the waist stays where it is.
    const Vec3d at{p.x(), p.y(), p.z()};
    Attachment a;
    a.vertex = i;
    a.distance = 1e30;
    for (Index f = 0; f < c.body.faces.rows(); ++f) {
      const auto corner = [&](int k) {
        const Eigen::RowVector3d q = c.body.vertices.row(c.body.faces(f, k));
        return Vec3d{q.x(), q.y(), q.z()};
      };
      const FaceCorners<double> t{corner(0), corner(1), corner(2)};
      const Vec3d b = nearest_on_triangle(at, t);
      const double d = norm(at - weighted(t, b));
      if (d < a.distance) {
        a.distance = d;
        a.triangle = static_cast<int>(f);
        a.barycentric = {b.x, b.y, b.z};
      }
    }
    garment.attachments.push_back(a);
  }
  // Ten substeps do not carry a metre of cloth: tethers (along the columns) keep it from
  // stretching, so that the times are of cloth that hangs in folds.
  ClothOptions options;
  options.tether_stretch = 1.01;
  options.schedule.patches = patches;
  c.cloth = make_cloth(garment, {}, options);
  c.options.self_contact = self_contact;
  return c;
}

/// 150k particles, 900k springs: edges, diagonals and every second neighbour of a grid, quilted.
Case small_steps() {
  constexpr int kColumns = 388;
  constexpr int kRows = 387;
  const double cell = 1.0 / kRows;
  Points x(kColumns * kRows, 3);
  std::vector<ClothSpring> springs;
  const auto spring = [&](int r, int c, int dr, int dc, double stiffness) {
    if (r + dr < kRows && c + dc >= 0 && c + dc < kColumns) {
      springs.push_back(
          {r * kColumns + c, (r + dr) * kColumns + c + dc, cell * std::hypot(dr, dc), stiffness});
    }
  };
  for (int r = 0; r < kRows; ++r) {
    for (int c = 0; c < kColumns; ++c) {
      x.row(r * kColumns + c) << c * cell, 0, r * cell;
      spring(r, c, 0, 1, 1e4);
      spring(r, c, 1, 0, 1e4);
      spring(r, c, 1, 1, 1e3);
      spring(r, c, 1, -1, 1e3);
      spring(r, c, 0, 2, 10);
      spring(r, c, 2, 0, 10);
    }
  }
  Case out;
  out.cloth =
      make_spring_net(x, std::vector<double>(static_cast<std::size_t>(x.rows()), 0.2 * cell * cell),
                      springs, quilt_pins(kColumns, kRows));
  out.options.substeps = 30;
  return out;
}

void add(const std::string& name, const std::function<Case()>& make, Device device, int frames) {
  benchmark::RegisterBenchmark(
      (std::string(device_name(device)) + "/" + name).c_str(),
      [make, device](benchmark::State& state) { run(state, make(), device); })
      ->UseManualTime()
      ->Iterations(frames)
      ->Unit(benchmark::kMillisecond);
}

void add_projective(const std::string& name, const std::function<Case()>& make, int frames) {
  for (const bool half : {false, true}) {
    const std::string solver = half ? "/projective_half" : "/projective";
    benchmark::RegisterBenchmark(
        (std::string(device_name(Device::Cuda)) + "/" + name + solver).c_str(),
        [make, half](benchmark::State& state) { run_projective(state, make(), half); })
        ->UseManualTime()
        ->Iterations(frames)
        ->Unit(benchmark::kMillisecond);
  }
}

Case with_jacobi(Case c, int iterations) {
  c.options.sweep = "jacobi";
  c.options.iterations = iterations;
  return c;
}

Case with_barrier(Case c, const std::string& barrier, int blocks = 0) {
  c.options.cuda_barrier = barrier;
  c.options.cuda_blocks = blocks;
  return c;
}

const bool kRegistered = [] {
  const Device gpu = Device::Cuda;
  const Device cpu = Device::Cpu;
  add("small_steps_150k_900k_30x1", small_steps, gpu, 30);
  // All springs at once, for how many iterations come to the residual of the row above.
  for (int iterations : {1, 4, 16}) {
    add(
        "small_steps_150k_900k/jacobi_30x" + std::to_string(iterations),
        [iterations] { return with_jacobi(small_steps(), iterations); }, gpu, 30);
  }
  add(
      "grid_10k_10x1", [] { return hanging_square(100, 1); }, gpu, 60);
  add(
      "grid_10k_10x4", [] { return hanging_square(100, 4); }, gpu, 60);
  add(
      "garment_10k_10x1", [] { return hanging_skirt(100, 100, 1); }, gpu, 60);
  add(
      "garment_10k_10x4", [] { return hanging_skirt(100, 100, 4); }, gpu, 60);
  for (const char* barrier : {"block", "cluster", "grid", "graph"}) {
    add(
        std::string("grid_10k_10x1/") + barrier,
        [barrier] { return with_barrier(hanging_square(100, 1), barrier); }, gpu, 60);
  }
  for (int iterations : {4, 16, 64}) {
    add(
        "grid_10k/jacobi_10x" + std::to_string(iterations),
        [iterations] { return with_jacobi(hanging_square(100, 1), iterations); }, gpu, 30);
  }
  for (int patches : {8, 24, 32, 64}) {
    add(
        "grid_10k_10x1/patches_" + std::to_string(patches),
        [patches] { return hanging_square(100, 1, patches); }, gpu, 60);
  }
  add(
      "grid_100k_10x1", [] { return quilted_square(316); }, gpu, 30);
  add(
      "grid_100k_10x1/graph", [] { return with_barrier(quilted_square(316), "graph"); }, gpu, 30);
  add(
      "grid_1M_10x1", [] { return quilted_square(1000); }, gpu, 20);
  add(
      "grid_1M_10x1/graph", [] { return with_barrier(quilted_square(1000), "graph"); }, gpu, 20);
  add(
      "dressed_10k_body", [] { return dressed(100, 100, false); }, gpu, 60);
  add(
      "dressed_10k_body_self", [] { return dressed(100, 100, true); }, gpu, 60);
  const auto with_edges = [](Case c) {
    c.options.body_edges = true;
    return c;
  };
  add(
      "dressed_10k_body_edges", [with_edges] { return with_edges(dressed(100, 100, false)); }, gpu,
      60);
  add(
      "dressed_15.7k_body_12.8k_self", [] { return dressed(125, 126, true, 0, 113); }, gpu, 60);
  add(
      "dressed_100k_body", [] { return dressed(316, 316, false); }, gpu, 30);
  add(
      "dressed_100k_body_self", [] { return dressed(316, 316, true); }, gpu, 30);
  add_projective(
      "grid_10k", [] { return hanging_square(100, 1); }, 60);
  add_projective(
      "dressed_10k_body", [] { return dressed(100, 100, false); }, 60);
  add_projective(
      "dressed_10k_body_self", [] { return dressed(100, 100, true); }, 60);
  const auto sweep = [](bool self) {
    Case c = dressed(100, 100, self, 8);
    c.scenes = 256;
    return c;
  };
  add(
      "sweep_256x10k_body", [sweep] { return sweep(false); }, gpu, 10);
  add(
      "sweep_256x10k_body_self", [sweep] { return sweep(true); }, gpu, 10);
  add(
      "grid_10k_10x4", [] { return hanging_square(100, 4); }, cpu, 30);
  add(
      "grid_10k_10x4/scalar",
      [] {
        Case c = hanging_square(100, 4);
        c.options.vectors = "scalar";
        return c;
      },
      cpu, 30);
  add(
      "garment_10k_10x4", [] { return hanging_skirt(100, 100, 4); }, cpu, 30);
  add(
      "dressed_10k_body", [] { return dressed(100, 100, false); }, cpu, 30);
  add(
      "dressed_10k_body_self", [] { return dressed(100, 100, true); }, cpu, 30);
  return true;
}();

}  // namespace
}  // namespace atelier
