#include <algorithm>
#include <array>
#include <cstring>

#include "simulation/xpbd/cuda_block.cuh"
#include "simulation/xpbd/cuda_frame_kernels.cuh"
#include "simulation/xpbd/cuda_launch.cuh"
#include "simulation/xpbd/cuda_sweep.cuh"

namespace atelier {
namespace {

constexpr int kLargestCluster = 16;

/// True if the blocks of a cluster wait for one another in this kernel: on a newer device the
/// driver may have made it from byte code for an older one, where scene_barrier is empty.
bool has_cluster_barrier(const cudaFuncAttributes& kernel) {
  return std::min(kernel.ptxVersion, kernel.binaryVersion) >= 90;
}

template <class T>
int edges_of(const PreparedCloth<T>& prepared, const Schedule::Patch& patch) {
  return prepared.colours[patch.colour_end].edge_begin -
         prepared.colours[patch.colour_begin].edge_begin;
}

/// Bytes of the plans of the block that has most of them, where each of `blocks` blocks takes its
/// share of every phase.
template <class T>
std::size_t plan_bytes(const PreparedCloth<T>& prepared, int blocks, bool with_edges) {
  std::size_t most = 0;
  for (int block = 0; block < blocks; ++block) {
    std::size_t sum = 0;
    for (const Schedule::Phase& phase : prepared.phases) {
      for (int k = phase.patch_begin + block; k < phase.patch_end; k += blocks) {
        const Schedule::Patch& patch = prepared.patches[k];
        sum += static_cast<std::size_t>(plan_size<T>(patch.vertex_end - patch.vertex_begin,
                                                     patch.colour_end - patch.colour_begin,
                                                     with_edges ? edges_of(prepared, patch) : 0));
      }
    }
    most = std::max(most, sum);
  }
  return most;
}

template <class T>
std::size_t largest_plan(const PreparedCloth<T>& prepared) {
  int most = 0;
  for (const Schedule::Patch& patch : prepared.patches) {
    most = std::max(most, plan_size<T>(patch.vertex_end - patch.vertex_begin,
                                       patch.colour_end - patch.colour_begin, 0));
  }
  return static_cast<std::size_t>(most);
}

template <class T, FrameKind kKind>
FrameKernel<T> kernel_of(CudaBarrier barrier) {
  return barrier == CudaBarrier::Block     ? frame_kernel_of<T, kKind, CudaBarrier::Block>()
         : barrier == CudaBarrier::Cluster ? frame_kernel_of<T, kKind, CudaBarrier::Cluster>()
                                           : frame_kernel_of<T, kKind, CudaBarrier::Grid>();
}

/// `few`: see FrameKind.
template <class T>
FrameKernel<T> kernel_of(const CudaFrameParts& parts, bool few, CudaBarrier barrier) {
  if (few && barrier == CudaBarrier::Grid) {
    return parts.self ? frame_kernel_of<T, FrameKind::SelfOfFew, CudaBarrier::Grid>()
                      : frame_kernel_of<T, FrameKind::FullOfFew, CudaBarrier::Grid>();
  }
  return parts.self   ? kernel_of<T, FrameKind::Self>(barrier)
         : parts.full ? kernel_of<T, FrameKind::Full>(barrier)
                      : kernel_of<T, FrameKind::Plain>(barrier);
}

/// The steps of an iteration after its sweep: `add(step, substep, iteration, pass)` for each.
template <class T, class Add>
void add_after_sweep(const CudaFrame<T>& frame, int s, int iteration, const Add& add) {
  for (int pass = 0; pass < kFeaturePasses && frame.features.face_count > 0; ++pass) {
    add(FrameStep::PushFeatures, s, iteration, pass);
    add(FrameStep::TakeFeatures, s, iteration, pass);
  }
  if (frame.tether_anchor != nullptr || frame.body.face_count > 0) {
    add(FrameStep::Hold, s, iteration, 0);
  }
  if (frame.body.face_count > 0) {
    add(FrameStep::Touch, s, iteration, 0);
  }
}

}  // namespace

/// Blocks per scene and how they wait: as few barriers of the cheapest kind as fill the device.
template <class T>
CudaLaunch<T>::CudaLaunch(const PreparedCloth<T>& prepared, const XpbdOptions& options,
                          std::vector<CudaSceneRule<T>> scenes, const CudaFrameParts& parts)
    : scenes_(std::move(scenes)), parts_(parts) {
  const int scene_count = static_cast<int>(scenes_.size());
  if (options.sweep == "jacobi") {
    jacobi_ = std::make_unique<CudaJacobi<T>>(prepared, options.jacobi_radius, scene_count);
  }
  int device = 0;
  int multiprocessors = 0;
  ATELIER_CUDA_CHECK(cudaGetDevice(&device));
  ATELIER_CUDA_CHECK(
      cudaDeviceGetAttribute(&multiprocessors, cudaDevAttrMultiProcessorCount, device));
  const int patches = prepared.phases[0].patch_end - prepared.phases[0].patch_begin;
  const bool one_each = jacobi_ == nullptr && scene_count == 1 && patches <= multiprocessors &&
                        options.cuda_blocks == 0 &&
                        (options.cuda_barrier == "auto" || options.cuda_barrier == "grid" ||
                         (options.cuda_barrier == "cluster" && patches <= kLargestCluster));
  // Contacts are shared out over all blocks: those without a patch help.
  const bool helpers =
      (parts_.self || parts_.body) && one_each && options.cuda_barrier != "cluster";
  few_ = helpers && prepared.count <= multiprocessors * kFewThreads;
  int capacity = 0;
  ATELIER_CUDA_CHECK(
      cudaDeviceGetAttribute(&capacity, cudaDevAttrMaxSharedMemoryPerBlockOptin, device));
  const std::array<const void*, 4> kernels = {
      reinterpret_cast<const void*>(kernel_of<T>(parts_, few_, CudaBarrier::Block)),
      reinterpret_cast<const void*>(kernel_of<T>(parts_, few_, CudaBarrier::Cluster)),
      reinterpret_cast<const void*>(kernel_of<T>(parts_, few_, CudaBarrier::Grid)),
      reinterpret_cast<const void*>(frame_step_kernel_of<T>())};
  // On-chip memory that contacts take is not there for plans.
  const int optin = capacity;
  bool clusters = true;
  for (const void* kernel : kernels) {
    cudaFuncAttributes attributes{};
    ATELIER_CUDA_CHECK(cudaFuncGetAttributes(&attributes, kernel));
    clusters = clusters && has_cluster_barrier(attributes);
    const int left = optin - static_cast<int>(attributes.sharedSizeBytes);
    ATELIER_CUDA_CHECK(
        cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, left));
    const bool stepwise = jacobi_ != nullptr || options.cuda_barrier == "graph";
    if (stepwise || kernel != kernels.back()) {
      capacity = std::min(capacity, left);
    }
  }
  if (options.cuda_barrier == "cluster" && !clusters) {
    throw EnvironmentError("CUDA",
                           "no clusters of blocks on this device, or none in this build "
                           "for it (compute capability 9.0); cuda_barrier auto does without");
  }
  const std::size_t base = BlockWork<T>::room(prepared.max_patch_particles, parts_.keeps_starts);
  // On chip beside the particles: the plans of all patches that a block works on, with their
  // edges where they fit, else of one at a time.
  const int planned = helpers ? multiprocessors : patches;
  const std::size_t with_edges = base + plan_bytes(prepared, planned, true);
  const std::size_t without = base + plan_bytes(prepared, planned, false);
  resident_ = one_each && without <= static_cast<std::size_t>(capacity) &&
              prepared.phases.size() <= kMostResidentPhases;
  records_on_chip_ = resident_ && with_edges <= static_cast<std::size_t>(capacity);
  shared_bytes_ = records_on_chip_ ? with_edges
                  : resident_      ? without
                                   : base + largest_plan(prepared);
  ATELIER_CHECK(shared_bytes_ <= static_cast<std::size_t>(capacity),
                "a patch does not fit on chip");
  // A thread for every edge of a colour; where there are more patches than multiprocessors,
  // two smaller blocks each hide one another's waits. Contacts take a warp a particle.
  int widest = 1;
  for (std::size_t k = 0; k + 1 < prepared.colours.size(); ++k) {
    widest = std::max(widest, prepared.colours[k + 1].edge_begin - prepared.colours[k].edge_begin);
  }
  const bool crowded = static_cast<long>(patches) * scene_count > multiprocessors;
  const int max_threads = few_ ? kFewThreads : crowded ? kFrameThreads / 2 : kFrameThreads;
  threads_ = static_cast<unsigned>(
      !parts_.body ? std::clamp((widest + 31) / 32 * 32, 128, max_threads) : max_threads);
  int resident = 0;
  ATELIER_CUDA_CHECK(cudaOccupancyMaxActiveBlocksPerMultiprocessor(
      &resident, kernel_of<T>(parts_, few_, CudaBarrier::Grid), static_cast<int>(threads_),
      shared_bytes_));
  const int share = std::max(1, resident * multiprocessors / scene_count);
  std::string barrier = options.cuda_barrier;
  if (helpers || (barrier == "graph" && parts_.self)) {
    barrier = "grid";
  }
  if (barrier == "auto") {
    const int wanted = std::min(patches, share);
    barrier = wanted <= 1                                                  ? "block"
              : clusters && (wanted <= kLargestCluster || scene_count > 1) ? "cluster"
                                                                           : "grid";
  }
  const int most = barrier == "block"     ? 1
                   : barrier == "cluster" ? kLargestCluster
                   : barrier == "grid"    ? share
                                          : patches;
  blocks_ =
      helpers ? std::min(planned, share)
              : std::min({options.cuda_blocks > 0 ? options.cuda_blocks : patches, most, patches});
  if (barrier == "cluster") {
    // Sizes of clusters are powers of two, and fewer than asked for where they do not fit.
    int size = 1;
    while (2 * size <= blocks_) {
      size *= 2;
    }
    blocks_ = size;
  }
  barrier_ = barrier;
  resident_ = resident_ && blocks_ == planned;
  records_on_chip_ = records_on_chip_ && resident_;
  grid_ = static_cast<unsigned>(scene_count * blocks_);
  ATELIER_CUDA_CHECK(cudaStreamCreate(&capture_));
}

template <class T>
CudaLaunch<T>::~CudaLaunch() {
  if (graph_ != nullptr) {
    cudaGraphExecDestroy(graph_);
  }
  cudaStreamDestroy(capture_);
}

template <class T>
void CudaLaunch<T>::describe(CudaFrame<T>& frame) const {
  frame.resident = resident_ ? 1 : 0;
  frame.records_on_chip = records_on_chip_ ? 1 : 0;
  frame.keeps_starts = parts_.keeps_starts ? 1 : 0;
}

template <class T>
void CudaLaunch<T>::run(const CudaFrame<T>& frame) {
  if (jacobi_ != nullptr) {
    run_jacobi(frame);
    return;
  }
  if (barrier_ == "graph") {
    run_graph(frame);
    return;
  }
  cudaLaunchConfig_t config{};
  config.gridDim = dim3(grid_);
  config.blockDim = dim3(threads_);
  config.dynamicSmemBytes = shared_bytes_;
  cudaLaunchAttribute attribute{};
  config.attrs = &attribute;
  CudaBarrier barrier = CudaBarrier::Block;
  if (barrier_ == "cluster") {
    barrier = CudaBarrier::Cluster;
    config.numAttrs = 1;
    attribute.id = cudaLaunchAttributeClusterDimension;
    attribute.val.clusterDim.x = static_cast<unsigned>(blocks_);
    attribute.val.clusterDim.y = 1;
    attribute.val.clusterDim.z = 1;
    if (blocks_ > 8) {
      ATELIER_CUDA_CHECK(cudaFuncSetAttribute(kernel_of<T>(parts_, few_, barrier),
                                              cudaFuncAttributeNonPortableClusterSizeAllowed, 1));
    }
  } else if (barrier_ == "grid") {
    barrier = CudaBarrier::Grid;
    config.numAttrs = 1;
    attribute.id = cudaLaunchAttributeCooperative;
    attribute.val.cooperative = 1;
  }
  ATELIER_CUDA_CHECK(
      cudaLaunchKernelEx(&config, kernel_of<T>(parts_, few_, barrier), frame, blocks_));
}

template <class T>
void CudaLaunch<T>::run_jacobi(const CudaFrame<T>& frame) {
  const auto add = [&](FrameStep step, int s, int iteration, int p) {
    frame_step_kernel_of<T>()<<<grid_, threads_, shared_bytes_>>>(frame, blocks_, step, s,
                                                                  iteration, p);
    ATELIER_CUDA_LAUNCHED(frame_step_kernel);
  };
  for (int s = frame.first_substep; s < frame.last_substep; ++s) {
    add(FrameStep::Begin, s, 0, 0);
    for (int iteration = 0; iteration < frame.iterations; ++iteration) {
      jacobi_->sweep(frame, scenes_, iteration);
      add_after_sweep(frame, s, iteration, add);
    }
  }
  add(FrameStep::Finish, 0, 0, 0);
}

template <class T>
void CudaLaunch<T>::run_graph(const CudaFrame<T>& frame) {
  std::vector<unsigned char> arguments(sizeof(frame));
  std::memcpy(arguments.data(), static_cast<const void*>(&frame), sizeof(frame));
  if (graph_ == nullptr || graph_arguments_ != arguments) {
    if (graph_ != nullptr) {
      ATELIER_CUDA_CHECK(cudaGraphExecDestroy(graph_));
      graph_ = nullptr;
    }
    const auto add = [&](FrameStep step, int s, int iteration, int p) {
      frame_step_kernel_of<T>()<<<grid_, threads_, shared_bytes_, capture_>>>(frame, blocks_, step,
                                                                              s, iteration, p);
      ATELIER_CUDA_LAUNCHED(frame_step_kernel);
    };
    const auto add_all = [&] {
      for (int s = frame.first_substep; s < frame.last_substep; ++s) {
        for (int iteration = 0; iteration < frame.iterations; ++iteration) {
          for (int p = 0; p < frame.phase_count; ++p) {
            add(FrameStep::Phase, s, iteration, p);
          }
          add_after_sweep(frame, s, iteration, add);
        }
      }
      add(FrameStep::Finish, 0, 0, 0);
    };
    cudaGraph_t graph = nullptr;
    ATELIER_CUDA_CHECK(cudaStreamBeginCapture(capture_, cudaStreamCaptureModeThreadLocal));
    try {
      add_all();
    } catch (...) {  // the stream records no longer
      if (cudaStreamEndCapture(capture_, &graph) == cudaSuccess) {
        static_cast<void>(cudaGraphDestroy(graph));
      }
      static_cast<void>(cudaGetLastError());
      throw;
    }
    ATELIER_CUDA_CHECK(cudaStreamEndCapture(capture_, &graph));
    cudaGraphExec_t made = nullptr;
    const cudaError_t status = cudaGraphInstantiate(&made, graph, 0);
    static_cast<void>(cudaGraphDestroy(graph));
    ATELIER_CUDA_CHECK(status);
    graph_ = made;
    graph_arguments_ = std::move(arguments);
  }
  ATELIER_CUDA_CHECK(cudaGraphLaunch(graph_, cudaStreamLegacy));
}

template class CudaLaunch<float>;
template class CudaLaunch<double>;

}  // namespace atelier
