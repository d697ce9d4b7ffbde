#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/device.h"
#include "core/error.h"
#include "simulation/contact/exact_counts.h"
#include "simulation/projective/begun_report.h"
#include "simulation/projective/cuda_projective.cuh"
#include "simulation/projective/cuda_projective_memory.cuh"
#include "simulation/projective/cuda_replay.cuh"
#include "simulation/projective/options_of_parts.h"
#include "simulation/projective/projective_cuda.h"
#include "simulation/xpbd/backend.h"
#include "simulation/xpbd/cuda_body.cuh"
#include "simulation/xpbd/cuda_self.cuh"

namespace atelier {
namespace {

using Lane = Vec4<double>;
constexpr int kAllFinite = MovingProjective::kAllFinite;

}  // namespace

struct ProjectiveCudaSolver::Scene {
  Scene(const Cloth& cloth, const Triangles& body_faces, const SolverOptions& options)
      : cloth(cloth),
        body_faces(body_faces),
        options(options),
        shared(options_of_parts(options)),
        h(options.time_step / options.projective.substeps),
        prepared(cloth, options.projective, h),
        device(prepared),
        body(body_faces),
        moving(prepared.place.size(), prepared.particle.size(), device.inverse,
               static_cast<std::size_t>(options.projective.acceleration), !body.empty()),
        touches(options.self_contact ? prepared.place.size() : 0),
        rules(bound_rules(options, cloth.material, options.projective.substeps)),
        counted(counted_cloth(cloth, body_faces, shared)) {
    if (options.self_contact && cloth.faces.rows() > 0) {
      self = std::make_unique<CudaSelf<double>>(cloth, prepared.particles, shared, 1);
      self->push_nearer(kGuardShare);
      clock = CudaBuffer<unsigned char>(projective_clock_size());
      arrived = CudaBuffer<unsigned>(2);
      arrived.clear();
      scene_rule = CudaBuffer<CudaSceneRule<double>>(
          std::vector<CudaSceneRule<double>>{{1, 1, rules.guard.friction}});
    }
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
    f.gentle = device.gentle.data();
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
    f.pinched = m.bad.data() + 1;
    if (with_body) {
      f.touched = m.touched.data();
      f.across = m.across.data();
      f.across_impulses = m.across_impulses.data();
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
    if (touches.room() != g.self.room) {
      touches.make_room(g.self.room);
    }
    f.touches = touches.view(self->rule().friction);
    return g;
  }

  void launch_substep(const ProjectiveFrame& f, const CudaFrame<double>& g, int s,
                      cudaStream_t stream) {
    launch_projective_begin(f, s, stream);
    if (f.body.face_count > 0) {
      launch_projective_find(f, s, stream);
    }
    SelfClock* const pairs_clock = reinterpret_cast<SelfClock*>(clock.data());
    if (self != nullptr) {
      CudaFrame<double> flight = g;
      flight.x = touches.flight();
      launch_projective_touches(flight, f, s, pairs_clock, stream);
    }
    int iterations = f.unknowns > 0 ? f.iterations : 0;
    for (int k = 0; k < iterations; ++k) {
      if (f.body.face_count > 0 && looks_across(k, f.iterations)) {
        launch_projective_across(f, s, k, stream);
      }
      launch_projective_forces(f, k, pinched, stream);
      for (int j = 0; j < kTouchSweeps && self != nullptr; ++j) {
        launch_projective_hold(f, k, j, pinched, stream);
      }
      launch_projective_rows(f, stream);
      launch_projective_columns(f, k, stream);
      launch_projective_next(f, k, stream);
      if (pinched && k + 1 == f.iterations && flags().pinched == s + 1) {
        iterations *= kPinchedIterations;
      }
    }
    launch_projective_leave(f, stream);
    if (self != nullptr) {
      launch_projective_self(g, s, pairs_clock, stream);
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
    const auto launch = [&](cudaStream_t stream) {
      for (int s = 0; s < f.substeps; ++s) {
        launch_substep(f, g, s, stream);
      }
    };
    if (pinched) {  // how many launches there are is known on the way
      launch(cudaStreamLegacy);
    } else {
      replay.run(key, launch);
    }
  }

  /// What a frame leaves.
  struct Flags {
    int bad, pinched;
  };
  Flags flags() const {
    const std::vector<int> both = moving.bad.download();
    return {both[0], both[1]};
  }
  void clear_flags() { moving.bad.upload({kAllFinite, 0}); }

  static void copy_state(CudaBuffer<Lane>& to, const CudaBuffer<Lane>& from) {
    ATELIER_CUDA_CHECK(cudaMemcpyAsync(to.data(), from.data(), from.size() * sizeof(Lane),
                                       cudaMemcpyDeviceToDevice));
  }

  /// Goes back to the start of the frame, which has run.
  void restore() {
    copy_state(moving.x, moving.frame_start);
    copy_state(moving.velocity, moving.frame_velocity);
    clear_flags();
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
      body.refit(f.count);
    }
    const auto once = [&] {
      if (with_body) {
        launch_candidates(
            f.body, rules.wide, FrameParticles<double>{f.count, f.x, f.velocity, f.frame_time},
            FrameForces<double>{f.air, f.gravity}, moving.outlook.data(), moving.candidates.data());
        body.wait_for_tree();
      }
      copy_state(moving.frame_start, moving.x);
      copy_state(moving.frame_velocity, moving.velocity);
      ran = true;
      run(f);
    };
    once();
    Flags left{};
    for (bool done = false; !done;) {
      const bool longer = self != nullptr && self->too_short();  // a list of pairs has to be
      left = flags();
      const bool slower = left.pinched > 0 && !pinched;  // some substeps take more iterations
      done = !longer && !slower;
      if (!done) {  // the frame is done again
        restore();
        ran = false;
        if (longer) {
          self->grow();
        }
        pinched = left.pinched > 0;
        once();
      }
    }
    pinched = left.pinched > 0;
    const FrameParticles<double> at_start{f.count, f.frame_start, f.frame_velocity, f.frame_time};
    if (with_body && *closed) {
      launch_end_outside(f.body, rules.kept, at_start, moving.outlook.data(), f.substeps,
                         moving.x.data());
    }
    after.record();
    if (left.bad != kAllFinite) {
      throw_not_finite(frame_number + 1, prepared.particles.external[left.bad]);
    }
    if (pinched) {
      clear_flags();
    }
    std::vector<FrameReport> reports = {begun_report(frame_number + 1)};
    FrameReport& report = reports[0];
    report.device_ms = after.since(before);
    if (self != nullptr) {
      self->count(reports);
    }
    if (options.report && with_body) {
      count_contacts(f, report);
    }
    report = reported(report, {cloth, counted, options}, control, [&] { return state(); });
    ++frame_number;
    return report;
  }

  void count_contacts(const ProjectiveFrame& f, FrameReport& report) {
    launch_depths(f.body, rules.kept.reach, f.count, f.x, moving.depth.data());
    for (double depth : moving.depth.download()) {
      note_depth(report, depth);
    }
    const std::vector<int> touched = moving.touched.download();
    report.body_contacts = static_cast<int>(std::count(touched.begin(), touched.end(), 1));
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
  DeviceTouches touches;
  BoundRules rules;
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
  bool pinched = false;  ///< parts of the body pinch cloth, in the last frame or this one
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
  check_state(state, scene_->count());
  scene_->set_state(state);
}

ClothState ProjectiveCudaSolver::state() const {
  return scene_->state();
}

FrameReport ProjectiveCudaSolver::advance(const Control& control) {
  return scene_->advance(control);
}

}  // namespace atelier
