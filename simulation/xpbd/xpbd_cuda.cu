#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>

#include "core/cuda_buffer.cuh"
#include "core/device.h"
#include "simulation/contact/body_encounter.h"
#include "simulation/xpbd/backend.h"
#include "simulation/xpbd/cuda_body.cuh"
#include "simulation/xpbd/cuda_features.cuh"
#include "simulation/xpbd/cuda_launch.cuh"
#include "simulation/xpbd/cuda_self.cuh"

namespace atelier {
namespace {

constexpr int kNobody = std::numeric_limits<int>::max();

template <class T>
Vec4<T> vec4(const Points& p, Index row, T w) {
  return {static_cast<T>(p(row, 0)), static_cast<T>(p(row, 1)), static_cast<T>(p(row, 2)), w};
}

struct CudaEvent {
  cudaEvent_t event = nullptr;

  CudaEvent() { ATELIER_CUDA_CHECK(cudaEventCreate(&event)); }
  ~CudaEvent() { static_cast<void>(cudaEventDestroy(event)); }
  CudaEvent(const CudaEvent&) = delete;
  CudaEvent& operator=(const CudaEvent&) = delete;
};

template <class T>
class CudaBackend final : public ClothSolver::Backend {
 public:
  CudaBackend(const Cloth& cloth, const std::vector<ClothVariation>& variations,
              const Triangles& body_faces, const XpbdOptions& options)
      : cloth_(cloth),
        variations_(variations),
        body_faces_(body_faces),
        options_(options),
        prepared_(prepare_cloth<T>(cloth)),
        scenes_(static_cast<int>(variations.size())),
        phases_(prepared_.phases),
        patches_(prepared_.patches),
        colours_(prepared_.colours),
        patch_particles_(prepared_.patch_particles),
        edges_(prepared_.edges),
        edge_rules_(prepared_.edge_rules),
        strain_places_(prepared_.strain_places),
        strains_(prepared_.strains),
        body_(body_faces) {
    const std::size_t n =
        static_cast<std::size_t>(prepared_.count) * static_cast<std::size_t>(scenes_);
    ATELIER_CHECK(n < static_cast<std::size_t>(std::numeric_limits<int>::max()),
                  "too many particles");
    for (CudaBuffer<Vec4<T>>* buffer :
         {&x_, &start_, &velocity_, &target_, &x_before_, &velocity_before_}) {
      *buffer = CudaBuffer<Vec4<T>>(n);
    }
    if (options.iterations > 1 || options.report || options.sweep == "jacobi") {
      lambda_ = CudaBuffer<EdgeMultipliers<T>>(prepared_.edges.size() *
                                               static_cast<std::size_t>(scenes_));
      strain_lambda_ =
          CudaBuffer<T>(3 * prepared_.strains.size() * static_cast<std::size_t>(scenes_));
      lambda_.clear();
      strain_lambda_.clear();
    }
    if (!prepared_.tether_anchor.empty()) {
      tether_anchor_ = CudaBuffer<int>(prepared_.tether_anchor);
      tether_length_ = CudaBuffer<T>(prepared_.tether_length);
    }
    if (!body_.empty()) {
      outlook_ = CudaBuffer<BodyOutlook<T>>(n);
      candidates_ = CudaBuffer<int>(n * kBodyCandidates);
      touched_ = CudaBuffer<int>(n);
      touch_counts_ = CudaBuffer<int>(4 * static_cast<std::size_t>(scenes_));
      touch_items_ = CudaBuffer<int>(2 * n);
      depth_ = CudaBuffer<T>(n);
      if (options.iterations > 1 || options.self_contact) {
        held_ = CudaBuffer<Vec4<T>>(n);
      }
    }
    if (options.self_contact && cloth.faces.rows() > 0) {
      self_ = std::make_unique<CudaSelf<T>>(cloth, prepared_, options, scenes_);
    }
    if (options.body_edges && !body_.empty() && cloth.faces.rows() > 0) {
      features_ = std::make_unique<CudaFeatures<T>>(cloth, prepared_, body_.faces(), scenes_);
    }
    std::vector<CudaSceneRule<T>> rules;
    for (const ClothVariation& v : variations) {
      const double friction = v.friction >= 0         ? v.friction
                              : options.friction >= 0 ? options.friction
                                                      : cloth.material.friction;
      rules.push_back(
          {static_cast<T>(1 / v.stretch), static_cast<T>(1 / v.bending), static_cast<T>(friction)});
    }
    rules_ = CudaBuffer<CudaSceneRule<T>>(rules);
    arrived_ = CudaBuffer<unsigned>(2 * static_cast<std::size_t>(scenes_));
    arrived_.clear();
    bad_ = CudaBuffer<int>(std::vector<int>{kNobody});
    fixed_.assign(static_cast<std::size_t>(scenes_), Points::Zero(prepared_.count, 3));
    frames_.assign(static_cast<std::size_t>(scenes_), 0);
    const bool moves_starts = !body_.empty() || self_ != nullptr || cloth_.material.damping > 0;
    const bool full =
        moves_starts || !prepared_.strains.empty() || !prepared_.tether_anchor.empty();
    launch_ = std::make_unique<CudaLaunch<T>>(
        prepared_, options, std::move(rules),
        CudaFrameParts{full, self_ != nullptr, !body_.empty(), moves_starts});
  }

  int scene_count() const override { return scenes_; }

  void set_state(int scene, const ClothState& state) override {
    check_state(state, prepared_.count);
    const std::size_t n = static_cast<std::size_t>(prepared_.count);
    std::vector<Vec4<T>> x(n);
    std::vector<Vec4<T>> v(n);
    for (std::size_t i = 0; i < n; ++i) {
      x[i] = vec4(state.positions, prepared_.external[i], prepared_.inverse_mass[i]);
      v[i] = vec4(state.velocities, prepared_.external[i], T(0));
    }
    const std::size_t at = n * static_cast<std::size_t>(scene);
    ATELIER_CUDA_CHECK(
        cudaMemcpy(x_.data() + at, x.data(), n * sizeof(x[0]), cudaMemcpyHostToDevice));
    ATELIER_CUDA_CHECK(
        cudaMemcpy(velocity_.data() + at, v.data(), n * sizeof(v[0]), cudaMemcpyHostToDevice));
    fixed_[scene] = state.positions;
    frames_[scene] = state.frame;
    targets_current_ = false;
  }

  ClothState state(int scene) const override {
    const std::size_t n = static_cast<std::size_t>(prepared_.count);
    std::vector<Vec4<T>> x(n);
    std::vector<Vec4<T>> v(n);
    const std::size_t at = n * static_cast<std::size_t>(scene);
    ATELIER_CUDA_CHECK(
        cudaMemcpy(x.data(), x_.data() + at, n * sizeof(x[0]), cudaMemcpyDeviceToHost));
    ATELIER_CUDA_CHECK(
        cudaMemcpy(v.data(), velocity_.data() + at, n * sizeof(v[0]), cudaMemcpyDeviceToHost));
    ClothState out{Points(prepared_.count, 3), Points(prepared_.count, 3), frames_[scene]};
    for (std::size_t i = 0; i < n; ++i) {
      out.positions.row(prepared_.external[i]) << x[i].x, x[i].y, x[i].z;
      out.velocities.row(prepared_.external[i]) << v[i].x, v[i].y, v[i].z;
    }
    return out;
  }

  std::vector<FrameReport> advance(const Control& control) override {
    check_control(control, cloth_, body_faces_.rows() > 0 ? body_faces_.maxCoeff() + 1 : 0,
                  options_.time_step);
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
      if (!fixed_before_.empty()) {
        fixed_ = std::move(fixed_before_);
      }
      targets_current_ = false;
      throw;
    }
  }

  std::vector<double> spring_forces(int scene) const override {
    ATELIER_CHECK(lambda_.size() > 0, "spring forces need `report` in the options");
    const double h = options_.time_step / options_.substeps;
    return spring_forces_of(cloth_, multipliers(lambda_.download(), scene), h);
  }

 private:
  /// `ran`: whether the frame began, so that `restore` goes back to its start.
  std::vector<FrameReport> advance_checked(const Control& control, bool& ran) {
    upload_control(control);
    const bool with_body = !body_.empty() && control.body_start.rows() > 0;
    if (with_body) {
      if (!has_inside_) {
        has_inside_ = has_inside(control.body_start, body_faces_);
      }
      body_.move(control.body_start, control.body_end);
    }
    CudaFrame<T> frame = frame_of(control, with_body);
    if (self_ != nullptr) {
      self_->describe(frame);
    }
    const int particles = prepared_.count * scenes_;
    ATELIER_CUDA_CHECK(cudaEventRecord(before_.event));
    if (with_body) {
      body_.refit(particles);
    }
    const auto run = [&] {
      if (with_body) {
        const FrameParticles<T> at_start{particles, x_.data(), velocity_.data(),
                                         static_cast<T>(options_.time_step)};
        launch_candidates(frame.body, frame.body_rule, at_start,
                          FrameForces<T>{frame.air, frame.gravity}, outlook_.data(),
                          candidates_.data());
        body_.wait_for_tree();
        if (features_ != nullptr) {
          features_->begin_frame(body_, frame, x_.data(), velocity_.data());
        }
      }
      launch_->run(frame);
      ran = true;
      if (with_body && *has_inside_) {
        const FrameParticles<T> at_start{particles, frame.frame_start, frame.frame_velocity,
                                         frame.frame_time};
        launch_end_outside(frame.body, frame.body_rule, at_start, outlook_.data(), frame.substeps,
                           x_.data());
      }
      ATELIER_CUDA_CHECK(cudaEventRecord(after_.event));
    };
    run();
    while (self_ != nullptr && self_->too_short()) {
      // A list of pairs was too short: the frame is done again with longer ones.
      restore();
      ran = false;
      self_->grow();
      self_->describe(frame);
      run();
    }
    int bad = 0;
    ATELIER_CUDA_CHECK(cudaMemcpy(&bad, bad_.data(), sizeof(bad), cudaMemcpyDeviceToHost));
    if (bad != kNobody) {
      throw_not_finite(frames_[bad / prepared_.count] + 1,
                       prepared_.external[bad % prepared_.count]);
    }
    std::vector<FrameReport> reports(static_cast<std::size_t>(scenes_));
    float ms = 0;
    ATELIER_CUDA_CHECK(cudaEventElapsedTime(&ms, before_.event, after_.event));
    for (int scene = 0; scene < scenes_; ++scene) {
      reports[scene].frame = frames_[scene] + 1;
      reports[scene].device_ms = ms;
    }
    if (self_ != nullptr) {
      self_->count(reports);
    }
    if (options_.report) {
      fill_reports(frame, reports);
    }
    for (std::int64_t& frames : frames_) {
      ++frames;
    }
    return reports;
  }

  /// Goes back to the start of the frame, which has run.
  void restore() {
    const std::size_t bytes = x_.size() * sizeof(Vec4<T>);
    ATELIER_CUDA_CHECK(cudaMemcpy(x_.data(), x_before_.data(), bytes, cudaMemcpyDeviceToDevice));
    ATELIER_CUDA_CHECK(
        cudaMemcpy(velocity_.data(), velocity_before_.data(), bytes, cudaMemcpyDeviceToDevice));
    bad_.upload(&kNobody, 1);
    if (self_ != nullptr) {
      self_->reset();
    }
    if (features_ != nullptr) {
      features_->reset();
    }
  }

  std::vector<double> multipliers(const std::vector<EdgeMultipliers<T>>& lambda, int scene) const {
    return multipliers_in_order(
        prepared_, lambda.data() + static_cast<std::size_t>(scene) * prepared_.edges.size(),
        cloth_.schedule.order.size());
  }

  void upload_control(const Control& control) {
    const std::size_t n = static_cast<std::size_t>(prepared_.count);
    const bool any_fixed =
        std::find(cloth_.fixed.begin(), cloth_.fixed.end(), 1) != cloth_.fixed.end();
    const bool moved = control.pin_targets.rows() > 0 ||
                       (!cloth_.attachments.empty() && control.body_end.rows() > 0);
    fixed_before_.clear();
    if (any_fixed && (moved || !targets_current_)) {
      fixed_before_ = fixed_;
      std::vector<Vec4<T>> target(n * static_cast<std::size_t>(scenes_));
      for (int scene = 0; scene < scenes_; ++scene) {
        fixed_[scene] = pin_targets_of(cloth_, control, body_faces_, fixed_[scene]);
        for (std::size_t i = 0; i < n; ++i) {
          target[static_cast<std::size_t>(scene) * n + i] =
              vec4(fixed_[scene], prepared_.external[i], T(0));
        }
      }
      target_.upload(target);
      targets_current_ = true;
    } else if (!targets_current_) {
      target_.clear();
      targets_current_ = true;
    }
    use_air_ = options_.air_density > 0 && (options_.drag > 0 || options_.lift > 0);
    if (use_air_) {
      std::vector<Vec4<T>> air(n * static_cast<std::size_t>(scenes_));
      for (int scene = 0; scene < scenes_; ++scene) {
        const Points a = air_accelerations(cloth_, state(scene), control, options_);
        for (std::size_t i = 0; i < n; ++i) {
          air[static_cast<std::size_t>(scene) * n + i] = vec4(a, prepared_.external[i], T(0));
        }
      }
      if (air_.size() != air.size()) {
        air_ = CudaBuffer<Vec4<T>>(air.size());
      }
      air_.upload(air);
    }
  }

  CudaFrame<T> frame_of(const Control& control, bool with_body) {
    CudaFrame<T> f{};
    std::memset(static_cast<void*>(&f), 0, sizeof(f));  // padding too: graphs compare the bytes
    f.count = prepared_.count;
    f.phase_count = static_cast<int>(prepared_.phases.size());
    f.phases = phases_.data();
    f.patches = patches_.data();
    f.colours = colours_.data();
    f.patch_particles = patch_particles_.data();
    f.edges = edges_.data();
    f.edge_rules = edge_rules_.data();
    f.strain_places = strain_places_.data();
    f.strains = strains_.data();
    f.edge_count = static_cast<int>(prepared_.edges.size());
    f.strain_count = static_cast<int>(prepared_.strains.size());
    f.tether_anchor = tether_anchor_.data();
    f.tether_length = tether_length_.data();
    f.x = x_.data();
    f.start = start_.data();
    f.velocity = velocity_.data();
    f.air = use_air_ ? air_.data() : nullptr;
    f.target = target_.data();
    f.lambda = lambda_.data();
    f.strain_lambda = strain_lambda_.data();
    f.held = with_body ? held_.data() : nullptr;
    f.rules = rules_.data();
    f.gravity = {static_cast<T>(control.gravity.x()), static_cast<T>(control.gravity.y()),
                 static_cast<T>(control.gravity.z())};
    f.substeps = options_.substeps;
    f.iterations = options_.iterations;
    f.first_substep = 0;
    f.last_substep = options_.substeps;
    f.frame_time = static_cast<T>(options_.time_step);
    const double h = options_.time_step / options_.substeps;
    f.h = static_cast<T>(h);
    f.damping = static_cast<T>(cloth_.material.damping);
    f.keep = static_cast<T>(1 / (1 + options_.velocity_damping * static_cast<double>(f.h)));
    f.max_patch_particles = prepared_.max_patch_particles;
    launch_->describe(f);
    f.frame_start = x_before_.data();
    f.frame_velocity = velocity_before_.data();
    if (with_body) {
      f.body = body_.view();
      f.body_rule.thickness =
          static_cast<T>(options_.thickness >= 0 ? options_.thickness : cloth_.material.thickness);
      f.body_rule.reach = max_of(static_cast<T>(options_.contact_reach), f.body_rule.thickness);
      f.body_rule.old_overlap = static_cast<T>(options_.depenetration_speed * h);
      f.outlook = outlook_.data();
      f.candidates = candidates_.data();
      f.touched = touched_.data();
      f.touch_counts = touch_counts_.data();
      f.touch_items = touch_items_.data();
      if (features_ != nullptr) {
        features_->describe(f);
      }
    }
    f.arrived = arrived_.data();
    f.bad = bad_.data();
    return f;
  }

  void fill_reports(const CudaFrame<T>& frame, std::vector<FrameReport>& reports) {
    const std::size_t n = static_cast<std::size_t>(prepared_.count);
    std::vector<T> depth;
    std::vector<int> touched;
    if (frame.body.face_count > 0) {
      launch_depths(frame.body, frame.body_rule.reach, static_cast<int>(depth_.size()), x_.data(),
                    depth_.data());
      depth = depth_.download();
      touched = touched_.download();
    }
    const std::vector<EdgeMultipliers<T>> lambda = lambda_.download();
    const std::vector<T> strain_lambda = strain_lambda_.download();
    const std::size_t strains = 3 * prepared_.strains.size();
    for (int scene = 0; scene < scenes_; ++scene) {
      FrameReport& report = reports[scene];
      report = report_state(
          cloth_, variations_[scene], state(scene),
          {multipliers(lambda, scene),
           strain_multipliers(prepared_,
                              strain_lambda.data() + static_cast<std::size_t>(scene) * strains),
           options_.time_step / options_.substeps},
          report);
      for (std::size_t i = 0; i < (depth.empty() ? 0 : n); ++i) {
        const std::size_t at = static_cast<std::size_t>(scene) * n + i;
        note_depth(report, static_cast<double>(depth[at]));
        report.body_contacts += prepared_.inverse_mass[i] > T(0) ? touched[at] : 0;
      }
    }
  }

  Cloth cloth_;
  std::vector<ClothVariation> variations_;
  Triangles body_faces_;
  XpbdOptions options_;
  PreparedCloth<T> prepared_;
  int scenes_;
  CudaBuffer<Schedule::Phase> phases_;
  CudaBuffer<Schedule::Patch> patches_;
  CudaBuffer<PreparedColour> colours_;
  CudaBuffer<int> patch_particles_;
  CudaBuffer<Places> edges_;
  CudaBuffer<EdgeRule<T>> edge_rules_;
  CudaBuffer<Places> strain_places_;
  CudaBuffer<StrainRest<T>> strains_;
  CudaBuffer<int> tether_anchor_;
  CudaBuffer<T> tether_length_;
  CudaBody<T> body_;
  std::optional<bool> has_inside_;  ///< asked when the body is first seen
  CudaBuffer<Vec4<T>> x_, start_, velocity_, target_, air_, held_;
  CudaBuffer<Vec4<T>> x_before_, velocity_before_;  ///< the last good frame
  CudaBuffer<EdgeMultipliers<T>> lambda_;
  CudaBuffer<T> strain_lambda_;
  CudaBuffer<CudaSceneRule<T>> rules_;
  CudaBuffer<T> depth_;
  CudaBuffer<BodyOutlook<T>> outlook_;
  CudaBuffer<int> candidates_, touched_, touch_counts_, touch_items_;
  CudaBuffer<unsigned> arrived_;
  CudaBuffer<int> bad_;
  std::vector<Points> fixed_;         ///< where fixed vertices are
  std::vector<Points> fixed_before_;  ///< and were before this frame, where it moves them
  std::vector<std::int64_t> frames_;
  bool targets_current_ = false;
  bool use_air_ = false;
  CudaEvent before_, after_;
  std::unique_ptr<CudaLaunch<T>> launch_;
  std::unique_ptr<CudaSelf<T>> self_;          ///< null: no contact with itself
  std::unique_ptr<CudaFeatures<T>> features_;  ///< null: no body, or its faces alone
};

}  // namespace

std::unique_ptr<ClothSolver::Backend> make_cuda_backend(
    const Cloth& cloth, const std::vector<ClothVariation>& variations, const Triangles& body_faces,
    const XpbdOptions& options) {
  check_device(Device::Cuda);
  if (options.precision == "double") {
    return std::make_unique<CudaBackend<double>>(cloth, variations, body_faces, options);
  }
  return std::make_unique<CudaBackend<float>>(cloth, variations, body_faces, options);
}

}  // namespace atelier
