#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

#include "core/cuda_buffer.cuh"
#include "core/device.h"
#include "simulation/backend.h"
#include "simulation/cuda_body.cuh"
#include "simulation/cuda_frame_kernel.cuh"
#include "simulation/cuda_self.cuh"

namespace atelier {
namespace {

constexpr int kLargestCluster = 16;

template <class T>
Vec4<T> vec4(const Points& p, Index row, T w) {
  return {static_cast<T>(p(row, 0)), static_cast<T>(p(row, 1)), static_cast<T>(p(row, 2)), w};
}

/// A CUDA graph of the launches of one frame, replayed while the frame's arguments stay the same.
struct FrameGraph {
  cudaGraphExec_t exec = nullptr;
  std::vector<unsigned char> arguments;
  ~FrameGraph() {
    if (exec != nullptr) {
      cudaGraphExecDestroy(exec);
    }
  }
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
        records_(prepared_.records),
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
    if (options.iterations > 1 || options.report) {
      lambda_ = CudaBuffer<T>(prepared_.records.size() * static_cast<std::size_t>(scenes_));
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
      depth_ = CudaBuffer<T>(n);
      if (options.iterations > 1 || options.self_contact) {
        held_ = CudaBuffer<Vec4<T>>(n);
      }
    }
    if (options.self_contact && cloth.faces.rows() > 0) {
      self_ = std::make_unique<CudaSelf<T>>(cloth, prepared_, options, scenes_);
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
    arrived_ = CudaBuffer<unsigned>(static_cast<std::size_t>(scenes_));
    bad_ = CudaBuffer<int>(1);
    fixed_.assign(static_cast<std::size_t>(scenes_), Points::Zero(prepared_.count, 3));
    frames_.assign(static_cast<std::size_t>(scenes_), 0);
    ATELIER_CUDA_CHECK(cudaEventCreate(&before_));
    ATELIER_CUDA_CHECK(cudaEventCreate(&after_));
    ATELIER_CUDA_CHECK(cudaStreamCreate(&capture_));
    choose_launch();
  }

  ~CudaBackend() override {
    cudaEventDestroy(before_);
    cudaEventDestroy(after_);
    cudaStreamDestroy(capture_);
  }

  int scene_count() const override { return scenes_; }

  void set_state(int scene, const ClothState& state) override {
    ATELIER_CHECK(
        state.positions.rows() == prepared_.count && state.velocities.rows() == prepared_.count,
        "the state is of another cloth");
    check_finite(state.positions, state.frame);
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
    check_control(control, cloth_, body_faces_.rows() > 0 ? body_faces_.maxCoeff() + 1 : 0);
    upload_control(control);
    const bool with_body = !body_.empty() && control.body_start.rows() > 0;
    if (with_body) {
      body_.move(control.body_start, control.body_end);
    }
    CudaFrame<T> frame = frame_of(control, with_body);
    if (self_ != nullptr) {
      self_->describe(frame);
    }
    const int particles = prepared_.count * scenes_;
    ATELIER_CUDA_CHECK(cudaEventRecord(before_));
    const std::size_t bytes = static_cast<std::size_t>(particles) * sizeof(Vec4<T>);
    ATELIER_CUDA_CHECK(
        cudaMemcpyAsync(x_before_.data(), x_.data(), bytes, cudaMemcpyDeviceToDevice));
    ATELIER_CUDA_CHECK(cudaMemcpyAsync(velocity_before_.data(), velocity_.data(), bytes,
                                       cudaMemcpyDeviceToDevice));
    ATELIER_CUDA_CHECK(cudaMemsetAsync(bad_.data(), 0x7f, sizeof(int)));
    if (with_body) {
      body_.refit();
      launch_candidates(frame.body, frame.body_rule, particles, x_.data(), velocity_.data(),
                        frame.air, frame.gravity, static_cast<T>(options_.time_step),
                        outlook_.data(), candidates_.data());
    }
    const int span = self_ != nullptr ? options_.self_interval : options_.substeps;
    for (int s = 0; s < options_.substeps; s += span) {
      frame.first_substep = s;
      frame.last_substep = std::min(options_.substeps, s + span);
      if (self_ != nullptr) {
        self_->collect(x_.data(), velocity_.data(),
                       frame.h * static_cast<T>(frame.last_substep - s));
      }
      launch(frame);
    }
    ATELIER_CUDA_CHECK(cudaEventRecord(after_));
    int bad = 0;
    ATELIER_CUDA_CHECK(cudaMemcpy(&bad, bad_.data(), sizeof(bad), cudaMemcpyDeviceToHost));
    if (bad < particles) {
      ATELIER_CUDA_CHECK(cudaMemcpy(x_.data(), x_before_.data(), bytes, cudaMemcpyDeviceToDevice));
      ATELIER_CUDA_CHECK(
          cudaMemcpy(velocity_.data(), velocity_before_.data(), bytes, cudaMemcpyDeviceToDevice));
      if (self_ != nullptr) {
        self_->reset();
      }
      throw DataError("",
                      "frame " + std::to_string(frames_[bad / prepared_.count] + 1) + ", vertex " +
                          std::to_string(prepared_.external[bad % prepared_.count]),
                      "a position that is not finite",
                      "a simulation that stays finite: more substeps, or check material and body");
    }
    std::vector<FrameReport> reports(static_cast<std::size_t>(scenes_));
    float ms = 0;
    ATELIER_CUDA_CHECK(cudaEventElapsedTime(&ms, before_, after_));
    for (int scene = 0; scene < scenes_; ++scene) {
      reports[scene].frame = ++frames_[scene];
      reports[scene].device_ms = ms;
    }
    if (self_ != nullptr) {
      self_->count(reports);
    }
    if (options_.report) {
      fill_reports(frame, reports);
    }
    return reports;
  }

  std::vector<double> spring_forces(int scene) const override {
    ATELIER_CHECK(lambda_.size() > 0, "spring forces need `report` in the options");
    const double h = options_.time_step / options_.substeps;
    const std::vector<T> lambda = lambda_.download();
    std::vector<double> out(cloth_.springs.size(), 0.0);
    for (std::size_t i = 0; i < prepared_.order.size(); ++i) {
      if (prepared_.order[i] < static_cast<int>(out.size())) {
        out[prepared_.order[i]] =
            -static_cast<double>(
                lambda[static_cast<std::size_t>(scene) * prepared_.records.size() + i]) /
            (h * h);
      }
    }
    return out;
  }

 private:
  void upload_control(const Control& control) {
    const std::size_t n = static_cast<std::size_t>(prepared_.count);
    const bool any_fixed =
        std::find(cloth_.fixed.begin(), cloth_.fixed.end(), 1) != cloth_.fixed.end();
    const bool moved = control.pin_targets.rows() > 0 ||
                       (!cloth_.attachments.empty() && control.body_end.rows() > 0);
    if (any_fixed && (moved || !targets_current_)) {
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
    f.records = records_.data();
    f.strains = strains_.data();
    f.record_count = static_cast<int>(prepared_.records.size());
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
    f.resident = resident_ ? 1 : 0;
    const double h = options_.time_step / options_.substeps;
    f.h = static_cast<T>(h);
    f.gamma = static_cast<T>(cloth_.material.damping) / f.h;
    f.keep = static_cast<T>(1 / (1 + options_.velocity_damping * static_cast<double>(f.h)));
    f.max_patch_particles = prepared_.max_patch_particles;
    f.max_colours = cloth_.schedule.max_colours;
    if (with_body) {
      f.body = body_.view();
      f.body_rule.thickness =
          static_cast<T>(options_.thickness >= 0 ? options_.thickness : cloth_.material.thickness);
      f.body_rule.reach = max_of(static_cast<T>(options_.contact_reach), f.body_rule.thickness);
      f.body_rule.old_overlap = static_cast<T>(options_.depenetration_speed * h);
      f.frame_start = x_before_.data();
      f.frame_velocity = velocity_before_.data();
      f.outlook = outlook_.data();
      f.candidates = candidates_.data();
      f.touched = touched_.data();
    }
    f.arrived = arrived_.data();
    f.bad = bad_.data();
    return f;
  }

  /// Blocks per scene and how they wait: as few barriers of the cheapest kind as fill the device.
  void choose_launch() {
    int device = 0;
    int multiprocessors = 0;
    ATELIER_CUDA_CHECK(cudaGetDevice(&device));
    ATELIER_CUDA_CHECK(
        cudaDeviceGetAttribute(&multiprocessors, cudaDevAttrMultiProcessorCount, device));
    int major = 0;
    ATELIER_CUDA_CHECK(cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, device));
    const int patches = prepared_.phases[0].patch_end - prepared_.phases[0].patch_begin;
    const std::size_t most_particles = static_cast<std::size_t>(prepared_.max_patch_particles);
    // On chip: particles and their starts, the list of contacts, and plans of patches: all that a
    // block works on where they fit, else one at a time.
    std::vector<int> sizes;
    for (const Schedule::Patch& patch : prepared_.patches) {
      const int colours = patch.colour_end - patch.colour_begin;
      const int records = colours > 0 ? prepared_.colours[patch.colour_end - 1].begin[3] -
                                            prepared_.colours[patch.colour_begin].begin[0]
                                      : 0;
      sizes.push_back(plan_size<T>(patch.vertex_end - patch.vertex_begin, colours, records));
    }
    int capacity = 0;
    ATELIER_CUDA_CHECK(
        cudaDeviceGetAttribute(&capacity, cudaDevAttrMaxSharedMemoryPerBlockOptin, device));
    const std::size_t base =
        2 * sizeof(Vec4<T>) * most_particles + sizeof(int) * (most_particles + 2) + 64;
    std::size_t together = 0;
    for (int block = 0; block < patches; ++block) {
      std::size_t sum = 0;
      for (const Schedule::Phase& phase : prepared_.phases) {
        for (int k = phase.patch_begin + block; k < phase.patch_end; k += patches) {
          sum += static_cast<std::size_t>(sizes[k]);
        }
      }
      together = std::max(together, sum);
    }
    resident_ = scenes_ == 1 && patches <= multiprocessors &&
                base + together <= static_cast<std::size_t>(capacity) &&
                (options_.cuda_barrier == "auto" || options_.cuda_barrier == "grid" ||
                 (options_.cuda_barrier == "cluster" && patches <= kLargestCluster));
    shared_bytes_ =
        base + (resident_
                    ? together
                    : static_cast<std::size_t>(*std::max_element(sizes.begin(), sizes.end())));
    ATELIER_CHECK(shared_bytes_ <= static_cast<std::size_t>(capacity),
                  "a patch does not fit on chip");
    for (const void* kernel :
         {reinterpret_cast<const void*>(&frame_kernel<T, CudaBarrier::Block>),
          reinterpret_cast<const void*>(&frame_kernel<T, CudaBarrier::Cluster>),
          reinterpret_cast<const void*>(&frame_kernel<T, CudaBarrier::Grid>),
          reinterpret_cast<const void*>(&frame_step_kernel<T>)}) {
      ATELIER_CUDA_CHECK(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                                              static_cast<int>(shared_bytes_)));
    }
    // A thread for every constraint of a colour; where there are more patches than multiprocessors,
    // two smaller blocks each hide one another's waits. Contacts take a warp a particle.
    int widest = 1;
    for (const PreparedColour& colour : prepared_.colours) {
      widest = std::max(widest, colour.begin[3] - colour.begin[0]);
    }
    const bool crowded = static_cast<long>(patches) * scenes_ > multiprocessors;
    const int most_threads = crowded ? kFrameThreads / 2 : kFrameThreads;
    threads_ = static_cast<unsigned>(
        body_.empty() ? std::clamp((widest + 31) / 32 * 32, 128, most_threads) : most_threads);
    int resident = 0;
    ATELIER_CUDA_CHECK(cudaOccupancyMaxActiveBlocksPerMultiprocessor(
        &resident, frame_kernel<T, CudaBarrier::Grid>, static_cast<int>(threads_), shared_bytes_));
    const int share = std::max(1, resident * multiprocessors / scenes_);
    std::string barrier = options_.cuda_barrier;
    if (barrier == "auto") {
      const int wanted = std::min(patches, share);
      barrier = wanted <= 1                               ? "block"
                : wanted <= kLargestCluster && major >= 9 ? "cluster"
                                                          : "grid";
      if (barrier == "grid" && scenes_ > 1 && major >= 9) {
        barrier = "cluster";
      }
    }
    const int most = barrier == "block"     ? 1
                     : barrier == "cluster" ? kLargestCluster
                     : barrier == "grid"    ? share
                                            : patches;
    blocks_ = std::min({options_.cuda_blocks > 0 ? options_.cuda_blocks : patches, most, patches});
    if (barrier == "cluster") {
      // Sizes of clusters are powers of two, and fewer than asked for where they do not fit.
      int size = 1;
      while (2 * size <= blocks_) {
        size *= 2;
      }
      blocks_ = size;
    }
    barrier_ = barrier;
    resident_ = resident_ && blocks_ == patches && barrier != "graph";
  }

  void launch(const CudaFrame<T>& frame) {
    const unsigned grid = static_cast<unsigned>(scenes_ * blocks_);
    if (barrier_ == "block") {
      frame_kernel<T, CudaBarrier::Block><<<grid, threads_, shared_bytes_>>>(frame, 1);
      ATELIER_CUDA_LAUNCHED(frame_kernel);
    } else if (barrier_ == "graph") {
      launch_graph(frame, grid);
    } else {
      if (barrier_ == "grid") {
        ATELIER_CUDA_CHECK(cudaMemsetAsync(arrived_.data(), 0, arrived_.size() * sizeof(unsigned)));
      }
      cudaLaunchConfig_t config{};
      config.gridDim = dim3(grid);
      config.blockDim = dim3(threads_);
      config.dynamicSmemBytes = shared_bytes_;
      cudaLaunchAttribute attribute{};
      config.attrs = &attribute;
      config.numAttrs = 1;
      if (barrier_ == "cluster") {
        attribute.id = cudaLaunchAttributeClusterDimension;
        attribute.val.clusterDim.x = static_cast<unsigned>(blocks_);
        attribute.val.clusterDim.y = 1;
        attribute.val.clusterDim.z = 1;
        if (blocks_ > 8) {
          ATELIER_CUDA_CHECK(cudaFuncSetAttribute(frame_kernel<T, CudaBarrier::Cluster>,
                                                  cudaFuncAttributeNonPortableClusterSizeAllowed,
                                                  1));
        }
        ATELIER_CUDA_CHECK(
            cudaLaunchKernelEx(&config, frame_kernel<T, CudaBarrier::Cluster>, frame, blocks_));
      } else {
        attribute.id = cudaLaunchAttributeCooperative;
        attribute.val.cooperative = 1;
        ATELIER_CUDA_CHECK(
            cudaLaunchKernelEx(&config, frame_kernel<T, CudaBarrier::Grid>, frame, blocks_));
      }
    }
  }

  void launch_graph(const CudaFrame<T>& frame, unsigned grid) {
    std::vector<unsigned char> arguments(sizeof(frame));
    std::memcpy(arguments.data(), static_cast<const void*>(&frame), sizeof(frame));
    if (graph_.exec == nullptr || graph_.arguments != arguments) {
      if (graph_.exec != nullptr) {
        ATELIER_CUDA_CHECK(cudaGraphExecDestroy(graph_.exec));
        graph_.exec = nullptr;
      }
      const auto add = [&](FrameStep step, int s, int iteration, int p) {
        frame_step_kernel<T>
            <<<grid, threads_, shared_bytes_, capture_>>>(frame, blocks_, step, s, iteration, p);
        ATELIER_CUDA_LAUNCHED(frame_step_kernel);
      };
      ATELIER_CUDA_CHECK(cudaStreamBeginCapture(capture_, cudaStreamCaptureModeThreadLocal));
      for (int s = frame.first_substep; s < frame.last_substep; ++s) {
        for (int iteration = 0; iteration < frame.iterations; ++iteration) {
          for (int p = 0; p < frame.phase_count; ++p) {
            add(FrameStep::Phase, s, iteration, p);
          }
          if (frame.tether_anchor != nullptr) {
            add(FrameStep::Tethers, s, iteration, 0);
          }
          if (frame.sums != nullptr) {
            if (frame.body.face_count > 0) {
              add(FrameStep::Touch, s, iteration, 0);
            }
            add(FrameStep::Pairs, s, iteration, 0);
          }
          if (iteration + 1 < frame.iterations &&
              (frame.body.face_count > 0 || frame.sums != nullptr)) {
            add(FrameStep::Touch, s, iteration, 0);
          }
        }
      }
      add(FrameStep::Finish, 0, 0, 0);
      cudaGraph_t graph = nullptr;
      ATELIER_CUDA_CHECK(cudaStreamEndCapture(capture_, &graph));
      const cudaError_t status = cudaGraphInstantiate(&graph_.exec, graph, 0);
      cudaGraphDestroy(graph);
      ATELIER_CUDA_CHECK(status);
      graph_.arguments = std::move(arguments);
    }
    ATELIER_CUDA_CHECK(cudaGraphLaunch(graph_.exec, cudaStreamLegacy));
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
    const std::vector<T> lambda = lambda_.download();
    for (int scene = 0; scene < scenes_; ++scene) {
      FrameReport& report = reports[scene];
      const std::size_t first = static_cast<std::size_t>(scene) * prepared_.records.size();
      const std::vector<double> own(
          lambda.begin() + static_cast<std::ptrdiff_t>(first),
          lambda.begin() + static_cast<std::ptrdiff_t>(first + prepared_.records.size()));
      report = report_state(cloth_, variations_[scene], state(scene), own,
                            options_.time_step / options_.substeps, report);
      for (std::size_t i = 0; i < (depth.empty() ? 0 : n); ++i) {
        const std::size_t at = static_cast<std::size_t>(scene) * n + i;
        report.penetrating += depth[at] > T(0) ? 1 : 0;
        report.penetration_depth =
            std::max(report.penetration_depth, static_cast<double>(depth[at]));
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
  CudaBuffer<ConstraintRecord<T>> records_;
  CudaBuffer<StrainRest<T>> strains_;
  CudaBuffer<int> tether_anchor_;
  CudaBuffer<T> tether_length_;
  CudaBody<T> body_;
  CudaBuffer<Vec4<T>> x_, start_, velocity_, target_, air_, held_;
  CudaBuffer<Vec4<T>> x_before_, velocity_before_;  ///< the last good frame
  CudaBuffer<T> lambda_, strain_lambda_;
  CudaBuffer<CudaSceneRule<T>> rules_;
  CudaBuffer<T> depth_;
  CudaBuffer<BodyOutlook<T>> outlook_;
  CudaBuffer<int> candidates_, touched_;
  CudaBuffer<unsigned> arrived_;
  CudaBuffer<int> bad_;
  std::vector<Points> fixed_;  ///< where fixed vertices are
  std::vector<std::int64_t> frames_;
  bool targets_current_ = false;
  bool use_air_ = false;
  int blocks_ = 1;
  unsigned threads_ = kFrameThreads;
  std::string barrier_;
  std::size_t shared_bytes_ = 0;
  bool resident_ = false;  ///< all that a block works on fits on chip
  cudaEvent_t before_ = nullptr;
  cudaEvent_t after_ = nullptr;
  cudaStream_t capture_ = nullptr;
  FrameGraph graph_;
  std::unique_ptr<CudaSelf<T>> self_;  ///< null: no contact with itself
};

}  // namespace

std::unique_ptr<ClothSolver::Backend> make_cuda_backend(
    const Cloth& cloth, const std::vector<ClothVariation>& variations, const Triangles& body_faces,
    const XpbdOptions& options) {
  if (!cuda_available()) {
    throw EnvironmentError("CUDA", "no device answers; use the CPU");
  }
  ATELIER_CHECK(options.sweep == "gauss-seidel", "Jacobi sweeps run on the CPU alone");
  if (options.precision == "double") {
    return std::make_unique<CudaBackend<double>>(cloth, variations, body_faces, options);
  }
  return std::make_unique<CudaBackend<float>>(cloth, variations, body_faces, options);
}

}  // namespace atelier
