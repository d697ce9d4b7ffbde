#include "simulation/projective/cuda_projective.cuh"
#include "simulation/projective/projective_keeps.h"
#include "simulation/xpbd/cuda_self_substep.cuh"

namespace atelier {
namespace {

using Work = SelfWork<double>;

/// Where cloth would go in substep `s` without contact; no contacts yet.
__device__ inline void begin_touches(const Work& work, const ProjectiveFrame& f, int s,
                                     SelfClock& clock) {
  ++clock.serial;
  begin_pairs(clock, *work.counts, s == 0);
  const TouchesView& t = f.touches;
  if (work.thread == 0) {
    t.counts[0] = 0;
    t.counts[1] = 0;
  }
  for (int i = work.thread; i < f.count; i += work.threads) {
    note_stirred(work, i, s, 0, s == 0);
    const Vec3d end = xyz(f.x[i]) + f.h * xyz(f.wish[i]);
    store_shared_cache(work.x + i, with_w(end, f.x[i].w));
    work.watch(i, end, clock);
    t.degree[i] = 0;
    t.filled[i] = 0;
  }
}

/// The corners of a touch that can move and have a part in it: `work(k, i)` with each of these
/// particles.
template <class Each>
__device__ inline void for_moving(const ProjectiveFrame& f, const TouchedCloth& touch,
                                  const Each& work) {
  for (int k = 0; k < 4; ++k) {
    if (touch.weight[k] != 0 && f.place[touch.particle[k]] >= 0) {
      work(k, touch.particle[k]);
    }
  }
}

/// Lists the pairs that may touch, and counts those of each particle.
__device__ inline void list_touches(const Work& work, const ProjectiveFrame& f) {
  const TouchesView& t = f.touches;
  const auto end = [&](int i) { return work.load(i); };
  const auto begin = [&](int i) { return work.load_origin(i); };
  const int pairs = min(__ldcg(&work.counts->face_pairs), t.room);
  for (int k = work.thread; k < pairs; k += work.threads) {
    const SelfPair<double> pair = work.face_pairs[k];
    TouchedCloth touch;
    if (work.found_again(pair, false) ||
        !touch_of_pair(work.cloth, pair, motion_of(end, begin), f.h, touch)) {
      continue;
    }
    int moving = 0;
    for_moving(f, touch, [&](int, int i) {
      atomicAdd(t.degree + i, 1);
      ++moving;
    });
    if (moving > 0) {
      const int slot = atomicAdd(t.counts, 1);
      t.touches[slot].bound = touch;
      t.impulses[0][slot] = Vec4<double>{};
    }
  }
}

/// Room among the entries for those of each particle.
__device__ inline void give_places(const Work& work, const ProjectiveFrame& f) {
  const TouchesView& t = f.touches;
  for (int i = work.thread; i < f.count; i += work.threads) {
    const int degree = __ldcg(t.degree + i);
    if (degree > 0) {
      t.begin[i] = atomicAdd(t.counts + 1, degree);
    }
  }
}

/// Enters each touch with its particles, and what it sees of their masses.
__device__ inline void enter_touches(const Work& work, const ProjectiveFrame& f) {
  const TouchesView& t = f.touches;
  const int count = __ldcg(t.counts);
  for (int c = work.thread; c < count; c += work.threads) {
    ClothTouch& touch = t.touches[c];
    double yields = 0;
    int owner = -1;
    for_moving(f, touch.bound, [&](int k, int i) {
      const double w = touch.bound.weight[k];
      yields += w * w * __ldcg(t.degree + i) / f.mass[i];
      t.entries[t.begin[i] + atomicAdd(t.filled + i, 1)] = 4 * c + k;
      owner = owner < 0 ? k : owner;
    });
    touch.mass = 1 / yields;
    touch.owner = owner;
  }
}

/// True for the touch of an entry that comes before another's, by their particles.
__device__ inline bool enters_before(const TouchesView& t, int a, int b) {
  const int* const p = t.touches[a / 4].bound.particle;
  const int* const q = t.touches[b / 4].bound.particle;
  for (int k = 0; k < 4; ++k) {
    if (p[k] != q[k]) {
      return p[k] < q[k];
    }
  }
  return false;
}

/// Entries came in any order: sums over them would not have the same bits.
__device__ inline void sort_entries(const Work& work, const ProjectiveFrame& f) {
  const TouchesView& t = f.touches;
  for (int i = work.thread; i < f.count; i += work.threads) {
    const int degree = __ldcg(t.degree + i);
    int* const own = t.entries + (degree > 0 ? t.begin[i] : 0);
    for (int n = 1; n < degree; ++n) {
      const int entry = own[n];
      int at = n;
      for (; at > 0 && enters_before(t, entry, own[at - 1]); --at) {
        own[at] = own[at - 1];
      }
      own[at] = entry;
    }
  }
}

/// What may touch in a substep; cooperative. The clock goes from one launch to the next.
__global__ void __launch_bounds__(kFrameThreads, 1)
    touches_kernel(const __grid_constant__ CudaFrame<double> flight,
                   const __grid_constant__ ProjectiveFrame f, int blocks, int s,
                   SelfClock* clock_memory) {
  constexpr CudaBarrier kBarrier = CudaBarrier::Grid;
  unsigned goal = 0;
  const auto wait = [&] {
    scene_barrier<kBarrier>(flight.arrived, goal, static_cast<unsigned>(blocks));
  };
  SelfClock clock;
  if (s > 0) {
    clock = *clock_memory;
  }
  const Work work(flight, blocks);
  begin_touches(work, f, s, clock);
  wait();
  renew_pairs<double, kBarrier>(work, blocks, s, clock, flight.arrived, goal);
  list_touches(work, f);
  wait();
  give_places(work, f);
  wait();
  enter_touches(work, f);
  wait();
  sort_entries(work, f);
  if (blockIdx.x == 0 && threadIdx.x == 0) {  // the others read it long before
    *clock_memory = clock;
  }
  leave_scene<kBarrier>(flight.arrived, static_cast<unsigned>(blocks));
}

/// Contacts of a substep after its iterations; cooperative.
__global__ void __launch_bounds__(kFrameThreads, 1)
    self_kernel(const __grid_constant__ CudaFrame<double> frame, int blocks, int s,
                SelfClock* clock_memory) {
  constexpr CudaBarrier kBarrier = CudaBarrier::Grid;
  unsigned goal = 0;
  SelfClock clock = *clock_memory;
  // Not the first look at pairs in this substep.
  touch_before_pairs<double, kBarrier>(frame, blocks, s, 1, clock, frame.arrived, goal);
  push_apart_all<double, kBarrier>(frame, blocks, s, s + 1 == frame.substeps, clock, frame.arrived,
                                   goal);
  keep_all_back<double, kBarrier, ProjectiveKeeps>(frame, blocks, s, clock, frame.arrived, goal);
  if (blockIdx.x == 0 && threadIdx.x == 0) {  // the others read it long before
    *clock_memory = clock;
  }
  leave_scene<kBarrier>(frame.arrived, static_cast<unsigned>(blocks));
}

/// Launches `kernel(arguments..., blocks, s, clock)` with a block for each multiprocessor.
template <class Kernel, class... Arguments>
void launch_for_all(Kernel kernel, int s, SelfClock* clock, cudaStream_t stream,
                    const Arguments&... arguments) {
  int device = 0;
  int blocks = 0;
  int resident = 0;
  ATELIER_CUDA_CHECK(cudaGetDevice(&device));
  ATELIER_CUDA_CHECK(cudaDeviceGetAttribute(&blocks, cudaDevAttrMultiProcessorCount, device));
  ATELIER_CUDA_CHECK(
      cudaOccupancyMaxActiveBlocksPerMultiprocessor(&resident, kernel, kFrameThreads, 0));
  ATELIER_CHECK(resident > 0, "contacts do not fit on a multiprocessor");
  cudaLaunchConfig_t config{};
  config.gridDim = dim3(static_cast<unsigned>(blocks));
  config.blockDim = dim3(kFrameThreads);
  config.stream = stream;
  cudaLaunchAttribute attribute{};
  attribute.id = cudaLaunchAttributeCooperative;
  attribute.val.cooperative = 1;
  config.attrs = &attribute;
  config.numAttrs = 1;
  ATELIER_CUDA_CHECK(cudaLaunchKernelEx(&config, kernel, arguments..., blocks, s, clock));
}

}  // namespace

void launch_projective_touches(const CudaFrame<double>& flight, const ProjectiveFrame& frame, int s,
                               SelfClock* clock, cudaStream_t stream) {
  launch_for_all(touches_kernel, s, clock, stream, flight, frame);
}

void launch_projective_self(const CudaFrame<double>& frame, int s, SelfClock* clock,
                            cudaStream_t stream) {
  launch_for_all(self_kernel, s, clock, stream, frame);
}

std::size_t projective_clock_size() {
  return sizeof(SelfClock);
}

}  // namespace atelier
