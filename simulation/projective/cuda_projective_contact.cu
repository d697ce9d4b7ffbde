#include "simulation/projective/cuda_chain.cuh"
#include "simulation/projective/cuda_projective.cuh"
#include "simulation/xpbd/cuda_team.cuh"

namespace atelier {
namespace {

constexpr int kContactThreads = 64;

/// The threads of a warp that ask the body for one particle together.
struct ContactWarp {
  cooperative_groups::thread_block_tile<32> tile;
  TeamInBody<32, true> team;
  TeamOfChoice few;  ///< for candidates; each part of the warp does the same
};

__device__ inline FreeFlight<double> flight_of(const ProjectiveFrame& f, int i) {
  return {xyz(f.frame_start[i]), f.frame_time * xyz(f.frame_velocity[i])};
}

__device__ inline BodySubstep<double> substep_of(const ProjectiveFrame& f, int s,
                                                 const BodyContactRule<double>& rule) {
  return {f.body, rule, static_cast<double>(s) / f.substeps,
          static_cast<double>(s + 1) / f.substeps};
}

/// Calls `work(i, warp)` with particle `i` of this warp, if there is one and it is free.
template <class Work>
__device__ inline void for_free_particle(const ProjectiveFrame& f, const Work& work) {
  namespace cg = cooperative_groups;
  __shared__ TeamRoom<32> memory[kContactThreads / 32];
  const cg::thread_block_tile<32> tile = cg::tiled_partition<32>(cg::this_thread_block());
  const cg::thread_block_tile<kTeam> few = cg::tiled_partition<kTeam>(tile);
  const int i = static_cast<int>((blockIdx.x * blockDim.x + threadIdx.x) / 32);
  if (i < f.count && f.place[i] >= 0) {
    work(i, ContactWarp{tile, {tile, memory[threadIdx.x / 32]}, {few}});
  }
}

/// Bounds on velocities for substep `s`: who would meet the body as it flies by itself.
__global__ void __launch_bounds__(kContactThreads)
    find_kernel(const __grid_constant__ ProjectiveFrame f, int s) {
  for_free_particle(f, [&](int i, const ContactWarp& warp) {
    Vec4<double> x = f.x[i];
    BodyOutlook<double> outlook = f.outlook[i];
    const BodySubstep<double> step = substep_of(f, s, f.rules.wide);
    const Passage<double> way{xyz(x), xyz(x) + f.h * xyz(f.wish[i]), step.t0, step.t1};
    const FreeFlight<double> flight = flight_of(f, i);
    const BodySearch search = body_search(outlook, way.p1, flight, step.t1);
    if (search == BodySearch::Nothing) {
      return;
    }
    const int* const candidates = f.candidates + static_cast<std::int64_t>(i) * kBodyCandidates;
    const auto of_candidates = [&](const Passage<double>& w) {
      return warp.few.choose(f.body, candidates, outlook.count, w, f.rules.wide.reach, true);
    };
    const FaceChoice<double> choice =
        choose_on_way(f.body, outlook, way, search, f.rules.wide, of_candidates, warp.team);
    const VelocityBound bound = bound_of_choice(f.body, choice, way, f.rules, f.h, x);
    if (bound.holds == 0 && search == BodySearch::Candidates) {
      look_out_again(outlook, choice.nearest, way.p1, flight, step.t1, f.rules.wide);
    }
    warp.tile.sync();  // all have read
    if (warp.tile.thread_rank() != 0) {
      return;
    }
    if (bound.holds != 0) {
      f.bounds[i] = bound;
      f.x[i] = x;
      f.at[i] = with_w(xyz(x) + f.h * xyz(f.v[i]), 0.0);
    } else if (search == BodySearch::Candidates) {
      f.outlook[i].gap = outlook.gap;
      f.outlook[i].from = outlook.from;
    }
  });
}

/// Second contacts in substep `s` before iteration `k`, which with them begins another equation.
__global__ void __launch_bounds__(kContactThreads)
    across_kernel(const __grid_constant__ ProjectiveFrame f, int s, int k) {
  wait_for_kernels_before();
  for_free_particle(f, [&](int i, const ContactWarp& warp) {
    if (f.bounds[i].holds == 0 || f.across[i].holds != 0) {
      return;
    }
    const BodySubstep<double> step = substep_of(f, s, f.rules.wide);
    Vec4<double> x = f.x[i];
    const Vec3d v = xyz(f.v[i]);
    const Passage<double> way{xyz(x), xyz(x) + f.h * v, step.t0, step.t1};
    if (!is_looked_at_again(way, f.rules)) {
      return;
    }
    const FaceChoice<double> choice = choose_on_way(f.body, f.outlook[i], way, BodySearch::Tree,
                                                    f.rules.wide, NoCandidates{}, warp.team);
    const VelocityBound bound = bound_of_choice(f.body, choice, way, f.rules, f.h, x);
    if (warp.tile.thread_rank() != 0 || !lies_across(bound, f.bounds[i], v)) {
      return;
    }
    f.across[i] = bound;
    // Whoever comes here writes the same.
    AndersonMemory& memory = f.memory[k % 2];
    memory.count = 0;
    memory.newest = 0;
    memory.first = 1;
    memory.least = 0;
    *f.pinched = s + 1;
  });
}

/// What passed through the body in substep `s`, or ended in it, is moved out.
__global__ void __launch_bounds__(kContactThreads)
    guard_kernel(const __grid_constant__ ProjectiveFrame f, int s) {
  for_free_particle(f, [&](int i, const ContactWarp& warp) {
    BodyParticle<double> p{f.x[i], f.start[i], {}, {}};
    BodyOutlook<double> outlook = f.outlook[i];
    const BodySubstep<double> step = substep_of(f, s, f.rules.guard);
    const FreeFlight<double> flight = flight_of(f, i);
    const BodySearch search = body_search(outlook, xyz(p.x), flight, step.t1);
    bool touches = false;
    if (search == BodySearch::Candidates) {
      const int* const candidates = f.candidates + static_cast<std::int64_t>(i) * kBodyCandidates;
      const int count = outlook.count;
      touches = contact_by_candidates(
          p, step, outlook, flight, [&](const Passage<double>& way, bool swept) {
            return warp.few.choose(f.body, candidates, count, way, step.rule.reach, swept);
          });
    } else if (search != BodySearch::Nothing) {
      touches = contact_by_tree(p, step, outlook, search, warp.team);
    }
    warp.tile.sync();  // all have read
    if (touches && warp.tile.thread_rank() == 0) {
      f.x[i] = p.x;
      f.start[i] = p.start;
      f.touched[i] = 1;
    }
  });
}

}  // namespace

void launch_projective_find(const ProjectiveFrame& frame, int s, cudaStream_t stream) {
  find_kernel<<<cuda_blocks(frame.count, kContactThreads / 32), kContactThreads, 0, stream>>>(frame,
                                                                                              s);
  ATELIER_CUDA_LAUNCHED(find_kernel);
}

void launch_projective_across(const ProjectiveFrame& frame, int s, int k, cudaStream_t stream) {
  launch_in_chain(across_kernel, cuda_blocks(frame.count, kContactThreads / 32), kContactThreads,
                  stream, frame, s, k);
}

void launch_projective_guard(const ProjectiveFrame& frame, int s, cudaStream_t stream) {
  guard_kernel<<<cuda_blocks(frame.count, kContactThreads / 32), kContactThreads, 0, stream>>>(
      frame, s);
  ATELIER_CUDA_LAUNCHED(guard_kernel);
}

}  // namespace atelier
