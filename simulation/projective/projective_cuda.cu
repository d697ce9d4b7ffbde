#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/device.h"
#include "core/error.h"
#include "simulation/contact/body_encounter.h"
#include "simulation/contact/exact_counts.h"
#include "simulation/projective/cuda_projective.cuh"
#include "simulation/projective/elastic_rows.h"
#include "simulation/projective/projective_cuda.h"
#include "simulation/xpbd/backend.h"
#include "simulation/xpbd/cuda_body.cuh"
#include "simulation/xpbd/cuda_self.cuh"
#include "simulation/xpbd/prepared_cloth.h"

namespace atelier {
namespace {

constexpr int kAllFinite = std::numeric_limits<int>::max();
using Lane = Vec4<double>;

/// The options as the parts that both solvers share take them.
XpbdOptions options_of_parts(const SolverOptions& options) {
  XpbdOptions shared;
  static_cast<CommonSolverOptions&>(shared) = options;
  shared.substeps = options.projective.substeps;
  shared.precision = "double";
  return shared;
}

/// An event of the device's clock.
class FrameClock {
 public:
  FrameClock() { ATELIER_CUDA_CHECK(cudaEventCreate(&event_)); }
  ~FrameClock() { static_cast<void>(cudaEventDestroy(event_)); }
  FrameClock(const FrameClock&) = delete;
  FrameClock& operator=(const FrameClock&) = delete;

  void record() { ATELIER_CUDA_CHECK(cudaEventRecord(event_)); }
  /// ms from `before` to this one; both have to be over.
  double since(const FrameClock& before) const {
    float ms = 0;
    ATELIER_CUDA_CHECK(cudaEventElapsedTime(&ms, before.event_, event_));
    return static_cast<double>(ms);
  }

 private:
  cudaEvent_t event_ = nullptr;
};

/// Launches of a frame. A second frame of the same arguments records them, later ones replay that.
class FrameReplay {
 public:
  /// What may differ between the arguments of two frames.
  struct Key {
    Vec3d gravity;
    bool body, air;
    int room;

    bool operator==(const Key& b) const {
      return gravity.x == b.gravity.x && gravity.y == b.gravity.y && gravity.z == b.gravity.z &&
             body == b.body && air == b.air && room == b.room;
    }
  };

  FrameReplay() { ATELIER_CUDA_CHECK(cudaStreamCreate(&recorder_)); }
  ~FrameReplay() {
    forget();
    static_cast<void>(cudaStreamDestroy(recorder_));
  }
  FrameReplay(const FrameReplay&) = delete;
  FrameReplay& operator=(const FrameReplay&) = delete;

  /// `launch(stream)` launches everything.
  template <class Launch>
  void run(const Key& key, const Launch& launch) {
    if (!key_ || !(*key_ == key)) {
      forget();
      launch(cudaStreamLegacy);
      key_ = key;  // kernels are loaded by now
      return;
    }
    if (graph_ == nullptr) {
      record(launch);
    }
    ATELIER_CUDA_CHECK(cudaGraphLaunch(graph_, cudaStreamLegacy));
  }

 private:
  void forget() {
    if (graph_ != nullptr) {
      static_cast<void>(cudaGraphExecDestroy(std::exchange(graph_, nullptr)));
    }
    key_.reset();
  }

  template <class Launch>
  void record(const Launch& launch) {
    cudaGraph_t graph = nullptr;
    ATELIER_CUDA_CHECK(cudaStreamBeginCapture(recorder_, cudaStreamCaptureModeThreadLocal));
    try {
      launch(recorder_);
    } catch (...) {  // the stream records no longer
      if (cudaStreamEndCapture(recorder_, &graph) == cudaSuccess) {
        static_cast<void>(cudaGraphDestroy(graph));
      }
      static_cast<void>(cudaGetLastError());
      throw;
    }
    ATELIER_CUDA_CHECK(cudaStreamEndCapture(recorder_, &graph));
    const cudaError_t status = cudaGraphInstantiate(&graph_, graph, 0);
    static_cast<void>(cudaGraphDestroy(graph));
    ATELIER_CUDA_CHECK(status);
  }

  std::optional<Key> key_;
  cudaGraphExec_t graph_ = nullptr;
  cudaStream_t recorder_ = nullptr;
};

/// W on the device.
class DeviceInverse {
 public:
  explicit DeviceInverse(const InverseFactor& factor)
      : values_(std::vector<float>(factor.values().begin(), factor.values().end())) {
    std::vector<RowsItem> items;
    std::vector<TileRow> rows;
    for (const InverseFactor::Part& part : factor.parts()) {
      add_rows(part, items);
      chunks_ = std::max(chunks_, part.begin < part.end ? chunks_of(part) : 0);
    }
    std::vector<ColumnsTile> tiles = tiles_of(factor, rows);
    std::stable_sort(tiles.begin(), tiles.end(), [](const ColumnsTile& a, const ColumnsTile& b) {
      return a.rows_end - a.rows_begin > b.rows_end - b.rows_begin;
    });
    std::stable_sort(items.begin(), items.end(), [](const RowsItem& a, const RowsItem& b) {
      return a.columns * a.rows > b.columns * b.rows;
    });
    constexpr int kLong = 512;  // columns that a warp alone would take long for
    const auto short_begin = std::stable_partition(
        items.begin(), items.end(), [](const RowsItem& item) { return item.columns > kLong; });
    long_items_ = static_cast<int>(short_begin - items.begin());
    items_ = CudaBuffer<RowsItem>(items);
    tiles_ = CudaBuffer<ColumnsTile>(tiles);
    tile_rows_ = CudaBuffer<TileRow>(rows);
  }

  InverseView view() const {
    return {values_.data(),   items_.data(),
            long_items_,      static_cast<int>(items_.size()),
            tiles_.data(),    static_cast<int>(tiles_.size()),
            tile_rows_.data()};
  }
  /// Into which the products of a row are cut at most.
  int chunks() const { return chunks_; }
  int tiles() const { return static_cast<int>(tiles_.size()); }

 private:
  static int chunks_of(const InverseFactor::Part& part) {
    return (part.stride + kColumnsAnItem - 1) / kColumnsAnItem;
  }

  static void add_rows(const InverseFactor::Part& part, std::vector<RowsItem>& items) {
    for (int row = part.begin; row < part.end; row += kRowsAnItem) {
      for (int c = 0; c < chunks_of(part); ++c) {
        const int column = c * kColumnsAnItem;
        items.push_back({part.row(row) + column, part.stride, row,
                         std::min(kRowsAnItem, part.end - row), part.column + column,
                         std::min(kColumnsAnItem, part.stride - column), c});
      }
    }
  }

  static std::vector<ColumnsTile> tiles_of(const InverseFactor& factor,
                                           std::vector<TileRow>& rows) {
    const std::vector<InverseFactor::Part>& parts = factor.parts();
    std::vector<int> part_of(static_cast<std::size_t>(factor.size()));
    for (std::size_t p = 0; p < parts.size(); ++p) {
      std::fill(part_of.begin() + parts[p].begin, part_of.begin() + parts[p].end,
                static_cast<int>(p));
    }
    std::vector<ColumnsTile> tiles;
    for (int column = 0; column < factor.size(); column += kColumnsATile) {
      const int end = std::min(column + kColumnsATile, factor.size());
      std::set<int> with_rows;  // parts of these columns, and those around them
      for (int c = column; c < end; ++c) {
        for (int p = part_of[c]; p >= 0 && with_rows.insert(p).second; p = parts[p].parent) {
        }
      }
      const int rows_begin = static_cast<int>(rows.size());
      for (int p : with_rows) {
        add_tile_rows(parts[p], column, rows);
      }
      tiles.push_back({column, end - column, rows_begin, static_cast<int>(rows.size())});
    }
    return tiles;
  }

  static void add_tile_rows(const InverseFactor::Part& part, int column,
                            std::vector<TileRow>& rows) {
    const int low = std::max(0, part.column - column) / 4;
    const int high = std::min(kColumnsATile, part.column + part.stride - column) / 4;
    for (int row = std::max(part.begin, column); row < part.end; ++row) {
      const std::int64_t quad = (part.row(row) + (column - part.column)) / 4;
      ATELIER_CHECK(quad <= std::numeric_limits<int>::max(), "a factor of less than 32 GB");
      rows.push_back({row, static_cast<int>(quad), static_cast<unsigned char>(low),
                      static_cast<unsigned char>(high),
                      static_cast<unsigned short>(chunks_of(part))});
    }
  }

  CudaBuffer<float> values_;
  CudaBuffer<RowsItem> items_;
  CudaBuffer<ColumnsTile> tiles_;
  CudaBuffer<TileRow> tile_rows_;
  int long_items_ = 0;
  int chunks_ = 0;
};

/// For every particle the rows that it is in.
struct RowEntries {
  explicit RowEntries(const ElasticRows& of) : begin(static_cast<std::size_t>(of.count) + 1, 0) {
    const auto each = [&](const auto& add) {
      for (std::size_t r = 0; r < of.rows.size(); ++r) {
        for (int k = 0; k < 4; ++k) {
          if (of.rows[r].particle[k] >= 0) {
            add(of.rows[r].particle[k], static_cast<int>(r), of.rows[r].weight[k]);
          }
        }
      }
    };
    each([&](int particle, int, double) { ++begin[particle + 1]; });
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    row.resize(static_cast<std::size_t>(begin.back()));
    weight.resize(row.size());
    std::vector<int> next(begin.begin(), begin.end() - 1);
    each([&](int particle, int r, double w) {
      row[next[particle]] = r;
      weight[next[particle]++] = w;
    });
  }

  std::vector<int> begin;  ///< [V + 1]
  std::vector<int> row;
  std::vector<double> weight;
};

/// What of a cloth never changes, on the host.
struct PreparedProjective {
  PreparedProjective(const Cloth& cloth, double h)
      : particles(prepare_cloth<double>(cloth)),
        rows(make_elastic_rows(cloth, particles.internal)),
        entries(rows) {
    std::vector<int> among_free(static_cast<std::size_t>(particles.count), -1);
    std::vector<int> particle_of;
    for (int i = 0; i < particles.count; ++i) {
      mass.push_back(cloth.mass[particles.external[i]]);
      if (particles.inverse_mass[i] > 0) {
        among_free[i] = static_cast<int>(particle_of.size());
        particle_of.push_back(i);
      }
    }
    const int unknowns = static_cast<int>(particle_of.size());
    Points positions(unknowns, 3);
    for (int u = 0; u < unknowns; ++u) {
      positions.row(u) = cloth.rest_positions.row(particles.external[particle_of[u]]);
    }
    inverse.emplace(projective_matrix(rows, mass, among_free, unknowns, h), positions);
    place.assign(static_cast<std::size_t>(particles.count), -1);
    for (int u = 0; u < unknowns; ++u) {
      particle.push_back(particle_of[inverse->order()[u]]);
      place[particle.back()] = u;
    }
  }

  PreparedCloth<double> particles;
  ElasticRows rows;
  RowEntries entries;
  std::vector<double> mass;
  std::optional<InverseFactor> inverse;
  std::vector<int> place;     ///< of particles among the unknowns, -1: fixed
  std::vector<int> particle;  ///< of unknowns
};

/// That on the device.
struct DeviceProjective {
  explicit DeviceProjective(const PreparedProjective& p)
      : rows(p.rows.rows),
        spring_rest(p.rows.spring_rest),
        bend_rest(p.rows.bend_rest),
        yarn_moduli(p.rows.yarn_moduli),
        begin(p.entries.begin),
        row(p.entries.row),
        weight(p.entries.weight),
        place(p.place),
        particle(p.particle),
        mass(p.mass),
        tether_anchor(p.particles.tether_anchor),
        tether_length(p.particles.tether_length),
        inverse(*p.inverse) {}

  ElasticView elastic(const ElasticRows& of) const {
    return {rows.data(),   spring_rest.data(), bend_rest.data(), yarn_moduli.data(), of.bend_begin,
            of.yarn_begin, of.damping,         begin.data(),     row.data(),         weight.data()};
  }

  CudaBuffer<ElasticRow> rows;
  CudaBuffer<double> spring_rest, bend_rest;
  CudaBuffer<std::array<double, 3>> yarn_moduli;
  CudaBuffer<int> begin, row;
  CudaBuffer<double> weight;
  CudaBuffer<int> place, particle;
  CudaBuffer<double> mass;
  CudaBuffer<int> tether_anchor;
  CudaBuffer<double> tether_length;
  DeviceInverse inverse;
};

/// What changes.
struct MovingProjective {
  MovingProjective(std::size_t n, std::size_t unknowns, const DeviceInverse& inverse,
                   std::size_t window, bool with_body)
      : bounds(n),
        right(unknowns + 2 * InverseFactor::kAlign),
        partial(unknowns * static_cast<std::size_t>(inverse.chunks())),
        of_change(unknowns * window),
        of_next(unknowns * window),
        dots((1 + 2 * window) * static_cast<std::size_t>(inverse.tiles())),
        memory(2) {
    for (CudaBuffer<Lane>* buffer : {&x, &velocity, &frame_start, &frame_velocity, &origin, &start,
                                     &wish, &v, &at, &impulses, &target}) {
      *buffer = CudaBuffer<Lane>(n);
    }
    for (CudaBuffer<Lane>* buffer : {&change, &last_change, &last_next}) {
      *buffer = CudaBuffer<Lane>(unknowns);
    }
    right.clear();  // what is behind stays so
    target.clear();
    if (with_body) {
      touched = CudaBuffer<int>(n);
      touch_counts = CudaBuffer<int>(4);
      touch_items = CudaBuffer<int>(2 * n);
      outlook = CudaBuffer<BodyOutlook<double>>(n);
      candidates = CudaBuffer<int>(n * kBodyCandidates);
      depth = CudaBuffer<double>(n);
    }
    bad = CudaBuffer<int>(std::vector<int>{kAllFinite});
  }

  CudaBuffer<Lane> x, velocity, frame_start, frame_velocity, origin, start, wish, v, at, impulses,
      target, air;
  CudaBuffer<VelocityBound> bounds;
  CudaBuffer<Vec4<float>> right, partial;
  CudaBuffer<Lane> change, last_change, last_next, of_change, of_next;
  CudaBuffer<double> dots;
  CudaBuffer<AndersonMemory> memory;
  CudaBuffer<int> touched, touch_counts, touch_items;
  CudaBuffer<BodyOutlook<double>> outlook;
  CudaBuffer<int> candidates;
  CudaBuffer<double> depth;
  CudaBuffer<int> bad;
};

}  // namespace

struct ProjectiveCudaSolver::Scene {
  Scene(const Cloth& cloth, const Triangles& body_faces, const SolverOptions& options)
      : cloth(cloth),
        body_faces(body_faces),
        options(options),
        shared(options_of_parts(options)),
        h(options.time_step / options.projective.substeps),
        prepared(cloth, h),
        device(prepared),
        body(body_faces),
        moving(prepared.place.size(), prepared.particle.size(), device.inverse,
               static_cast<std::size_t>(options.projective.acceleration), !body.empty()) {
    BodyContactRule<double> kept{};
    kept.thickness = options.thickness >= 0 ? options.thickness : cloth.material.thickness;
    kept.friction = options.friction >= 0 ? options.friction : cloth.material.friction;
    kept.reach = std::max(options.contact_reach, kept.thickness);
    kept.old_overlap = options.depenetration_speed * h;
    rules = bound_rules(kept);
    if (options.self_contact && cloth.faces.rows() > 0) {
      self = std::make_unique<CudaSelf<double>>(cloth, prepared.particles, shared, 1);
      clock = CudaBuffer<unsigned char>(projective_clock_size());
      arrived = CudaBuffer<unsigned>(2);
      arrived.clear();
      scene_rule = CudaBuffer<CudaSceneRule<double>>(
          std::vector<CudaSceneRule<double>>{{1, 1, rules.guard.friction}});
    }
    counted = {cloth.faces,          body_faces,
               cloth.rest_positions, cloth.layer,
               kept.thickness,       options.self_contact ? kept_self_thickness(cloth, shared) : 0};
    fixed = Points::Zero(count(), 3);
  }

  int count() const { return prepared.particles.count; }

  void set_state(const ClothState& state) {
    const std::size_t n = prepared.place.size();
    std::vector<Lane> x(n);
    std::vector<Lane> v(n);
    for (std::size_t i = 0; i < n; ++i) {
      const auto p = state.positions.row(prepared.particles.external[i]);
      const auto u = state.velocities.row(prepared.particles.external[i]);
      x[i] = {p[0], p[1], p[2], prepared.particles.inverse_mass[i]};
      v[i] = {u[0], u[1], u[2], 0};
    }
    moving.x.upload(x);
    moving.velocity.upload(v);
    fixed = state.positions;
    frame_number = state.frame;
    targets_current = false;
  }

  ClothState state() const {
    const std::vector<Lane> x = moving.x.download();
    const std::vector<Lane> v = moving.velocity.download();
    ClothState out{Points(count(), 3), Points(count(), 3), frame_number};
    for (std::size_t i = 0; i < x.size(); ++i) {
      out.positions.row(prepared.particles.external[i]) << x[i].x, x[i].y, x[i].z;
      out.velocities.row(prepared.particles.external[i]) << v[i].x, v[i].y, v[i].z;
    }
    return out;
  }

  std::vector<Lane> lanes_of(const Points& points) const {
    std::vector<Lane> out(prepared.place.size());
    for (std::size_t i = 0; i < out.size(); ++i) {
      const auto p = points.row(prepared.particles.external[i]);
      out[i] = {p[0], p[1], p[2], 0};
    }
    return out;
  }

  void upload_control(const Control& control) {
    fixed_before.reset();
    const bool any_fixed = prepared.particle.size() < prepared.place.size();
    const bool moves = control.pin_targets.rows() > 0 ||
                       (!cloth.attachments.empty() && control.body_end.rows() > 0);
    if (any_fixed && (moves || !targets_current)) {
      fixed_before = fixed;
      fixed = pin_targets_of(cloth, control, body_faces, fixed);
      moving.target.upload(lanes_of(fixed));
    }
    targets_current = true;
    use_air = options.air_density > 0 && (options.drag > 0 || options.lift > 0);
    if (use_air) {
      const std::vector<Lane> air = lanes_of(air_accelerations(cloth, state(), control, shared));
      if (moving.air.size() != air.size()) {
        moving.air = CudaBuffer<Lane>(air.size());
      }
      moving.air.upload(air);
    }
  }

  ProjectiveFrame frame_of(const Control& control, bool with_body) {
    MovingProjective& m = moving;
    ProjectiveFrame f{};
    f.count = count();
    f.unknowns = static_cast<int>(prepared.particle.size());
    f.substeps = options.projective.substeps;
    f.iterations = options.projective.iterations;
    f.window = options.projective.acceleration;
    f.h = h;
    f.keep = 1 / (1 + options.velocity_damping * h);
    f.friction = rules.kept.friction;
    f.frame_time = options.time_step;
    f.gravity = {control.gravity.x(), control.gravity.y(), control.gravity.z()};
    f.elastic = device.elastic(prepared.rows);
    f.inverse = device.inverse.view();
    f.place = device.place.data();
    f.particle = device.particle.data();
    f.mass = device.mass.data();
    f.air = use_air ? m.air.data() : nullptr;
    f.target = m.target.data();
    f.tether_anchor = device.tether_anchor.size() > 0 ? device.tether_anchor.data() : nullptr;
    f.tether_length = device.tether_length.data();
    f.x = m.x.data();
    f.velocity = m.velocity.data();
    f.frame_start = m.frame_start.data();
    f.frame_velocity = m.frame_velocity.data();
    f.origin = m.origin.data();
    f.start = m.start.data();
    f.wish = m.wish.data();
    f.v = m.v.data();
    f.at = m.at.data();
    f.bounds = m.bounds.data();
    f.impulses = m.impulses.data();
    f.right = m.right.data();
    f.partial = m.partial.data();
    f.change = m.change.data();
    f.last_change = m.last_change.data();
    f.last_next = m.last_next.data();
    f.of_change = m.of_change.data();
    f.of_next = m.of_next.data();
    f.dots = m.dots.data();
    f.memory = m.memory.data();
    f.rules = rules;
    f.bad = m.bad.data();
    if (with_body) {
      f.touched = m.touched.data();
      f.body = body.view();
      f.outlook = m.outlook.data();
      f.candidates = m.candidates.data();
    }
    return f;
  }

  /// What the passes of contact with itself take of the frame.
  CudaFrame<double> self_frame_of(ProjectiveFrame& f) {
    CudaFrame<double> g{};
    g.count = f.count;
    g.x = f.x;
    g.start = f.start;
    g.velocity = f.velocity;
    g.rules = scene_rule.data();
    g.frame_start = moving.frame_start.data();
    g.frame_velocity = moving.frame_velocity.data();
    g.substeps = f.substeps;
    g.iterations = 1;
    g.last_substep = f.substeps;
    g.frame_time = f.frame_time;
    g.h = f.h;
    g.body = f.body;
    g.body_rule = rules.guard;
    g.outlook = f.outlook;
    g.candidates = f.candidates;
    g.touched = f.touched;
    g.touch_counts = moving.touch_counts.data();
    g.touch_items = moving.touch_items.data();
    g.impulses = {f.impulses, rules.kept};
    g.arrived = arrived.data();
    g.bad = f.bad;
    self->describe(g);
    f.self_origin = g.self.origin;
    f.self_carry = g.self.carry;
    return g;
  }

  void launch_substep(const ProjectiveFrame& f, const CudaFrame<double>& g, int s,
                      cudaStream_t stream) {
    launch_projective_begin(f, s, stream);
    if (f.body.face_count > 0) {
      launch_projective_find(f, s, stream);
    }
    for (int k = 0; k < f.iterations && f.unknowns > 0; ++k) {
      launch_projective_forces(f, stream);
      launch_projective_rows(f, stream);
      launch_projective_columns(f, k, stream);
      launch_projective_next(f, k, stream);
    }
    launch_projective_leave(f, stream);
    if (self != nullptr) {
      launch_projective_self(g, s, reinterpret_cast<SelfClock*>(clock.data()), stream);
    } else if (f.body.face_count > 0) {
      launch_projective_guard(f, s, stream);
    }
    launch_projective_finish(f, stream);
  }

  void run(ProjectiveFrame& f) {
    CudaFrame<double> g{};
    if (self != nullptr) {
      g = self_frame_of(f);
    }
    if (f.body.face_count > 0) {
      ATELIER_CUDA_CHECK(
          cudaMemsetAsync(moving.touch_counts.data(), 0, moving.touch_counts.size() * sizeof(int)));
    }
    const FrameReplay::Key key{f.gravity, f.body.face_count > 0, f.air != nullptr,
                               self != nullptr ? g.self.room : 0};
    replay.run(key, [&](cudaStream_t stream) {
      for (int s = 0; s < f.substeps; ++s) {
        launch_substep(f, g, s, stream);
      }
    });
  }

  static void copy_state(CudaBuffer<Lane>& to, const CudaBuffer<Lane>& from) {
    ATELIER_CUDA_CHECK(cudaMemcpyAsync(to.data(), from.data(), from.size() * sizeof(Lane),
                                       cudaMemcpyDeviceToDevice));
  }

  /// Goes back to the start of the frame, which has run.
  void restore() {
    copy_state(moving.x, moving.frame_start);
    copy_state(moving.velocity, moving.frame_velocity);
    moving.bad.upload(&kAllFinite, 1);
    if (self != nullptr) {
      self->reset();
    }
  }

  /// `ran`: whether the frame's start was kept, so that `restore` goes back to its start.
  FrameReport advance_checked(const Control& control, bool& ran) {
    upload_control(control);
    const bool with_body = !body.empty() && control.body_start.rows() > 0;
    if (with_body) {
      if (!closed) {
        closed = has_inside(control.body_start, body_faces);
      }
      body.move(control.body_start, control.body_end);
    }
    ProjectiveFrame f = frame_of(control, with_body);
    before.record();
    if (with_body) {
      body.refit();
    }
    const auto once = [&] {
      if (with_body) {
        launch_candidates(
            f.body, rules.wide, FrameParticles<double>{f.count, f.x, f.velocity, f.frame_time},
            FrameForces<double>{f.air, f.gravity}, moving.outlook.data(), moving.candidates.data());
      }
      copy_state(moving.frame_start, moving.x);
      copy_state(moving.frame_velocity, moving.velocity);
      ran = true;
      run(f);
    };
    once();
    while (self != nullptr && self->too_short()) {
      // A list of pairs was too short: the frame is done again with longer ones.
      restore();
      ran = false;
      self->grow();
      once();
    }
    const FrameParticles<double> at_start{f.count, f.frame_start, f.frame_velocity, f.frame_time};
    if (with_body && *closed) {
      launch_end_outside(f.body, rules.kept, at_start, moving.outlook.data(), f.substeps,
                         moving.x.data());
    }
    after.record();
    int bad = 0;
    ATELIER_CUDA_CHECK(cudaMemcpy(&bad, moving.bad.data(), sizeof(bad), cudaMemcpyDeviceToHost));
    if (bad != kAllFinite) {
      throw DataError("",
                      "frame " + std::to_string(frame_number + 1) + ", vertex " +
                          std::to_string(prepared.particles.external[bad]),
                      "a position that is not finite",
                      "a simulation that stays finite: more substeps, or check material and body");
    }
    std::vector<FrameReport> reports(1);
    FrameReport& report = reports[0];
    report.frame = frame_number + 1;
    report.device_ms = after.since(before);
    if (self != nullptr) {
      self->count(reports);
    }
    if (options.report) {
      fill_report(f, report);
    }
    if (control.exact_counts ||
        (options.intersection_interval > 0 && report.frame % options.intersection_interval == 0)) {
      report = with_exact_counts(report, counted, state().positions, control);
    }
    ++frame_number;
    return report;
  }

  void fill_report(const ProjectiveFrame& f, FrameReport& report) {
    if (f.body.face_count > 0) {
      launch_depths(f.body, rules.kept.reach, f.count, f.x, moving.depth.data());
      for (double depth : moving.depth.download()) {
        report.penetrating += depth > 0 ? 1 : 0;
        report.penetration_depth = std::max(report.penetration_depth, depth);
      }
      const std::vector<int> touched = moving.touched.download();
      report.body_contacts = static_cast<int>(std::count(touched.begin(), touched.end(), 1));
    }
    report = report_state(cloth, {}, state(), {{}, {}, h}, report);
  }

  FrameReport advance(const Control& control) {
    check_control(control, cloth, body_faces.rows() > 0 ? body_faces.maxCoeff() + 1 : 0,
                  options.time_step);
    bool ran = false;
    try {
      return advance_checked(control, ran);
    } catch (...) {  // a device out of memory, say: everything is where it was before the frame
      try {
        if (ran) {
          restore();
        }
      } catch (const EnvironmentError&) {  // the device itself failed: the first error says more
      }
      if (fixed_before) {
        fixed = std::move(*fixed_before);
      }
      targets_current = false;
      throw;
    }
  }

  Cloth cloth;
  Triangles body_faces;
  SolverOptions options;
  XpbdOptions shared;
  double h;  ///< s, a substep
  PreparedProjective prepared;
  DeviceProjective device;
  CudaBody<double> body;
  MovingProjective moving;
  BoundRules rules{};
  std::optional<bool> closed;              ///< asked when the body is first seen
  std::unique_ptr<CudaSelf<double>> self;  ///< null: no contact with itself
  CudaBuffer<unsigned char> clock;
  CudaBuffer<unsigned> arrived;
  CudaBuffer<CudaSceneRule<double>> scene_rule;
  CountedCloth counted;
  Points fixed;                        ///< where fixed vertices are
  std::optional<Points> fixed_before;  ///< and were before this frame, where it moves them
  std::int64_t frame_number = 0;
  bool targets_current = false;
  bool use_air = false;
  FrameClock before, after;
  FrameReplay replay;
};

ProjectiveCudaSolver::ProjectiveCudaSolver(const Cloth& cloth, const Triangles& body_faces,
                                           const SolverOptions& options) {
  SolverOptions checked = options;
  const std::vector<std::string> problems = check_options(describe(checked));
  ATELIER_CHECK(problems.empty(), "options of projective dynamics: " + problems.front());
  check_device(Device::Cuda);
  scene_ = std::make_unique<Scene>(cloth, body_faces, options);
  set_state(rest_state(cloth));
}
ProjectiveCudaSolver::~ProjectiveCudaSolver() = default;
ProjectiveCudaSolver::ProjectiveCudaSolver(ProjectiveCudaSolver&&) noexcept = default;
ProjectiveCudaSolver& ProjectiveCudaSolver::operator=(ProjectiveCudaSolver&&) noexcept = default;

void ProjectiveCudaSolver::set_state(const ClothState& state) {
  ATELIER_CHECK(
      state.positions.rows() == scene_->count() && state.velocities.rows() == scene_->count(),
      "the state is of another cloth");
  check_finite(state.positions, state.frame);
  scene_->set_state(state);
}

ClothState ProjectiveCudaSolver::state() const {
  return scene_->state();
}

FrameReport ProjectiveCudaSolver::advance(const Control& control) {
  return scene_->advance(control);
}

}  // namespace atelier
