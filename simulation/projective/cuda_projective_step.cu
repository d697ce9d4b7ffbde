#include <cooperative_groups.h>

#include "simulation/projective/cuda_chain.cuh"
#include "simulation/projective/cuda_projective.cuh"
#include "simulation/xpbd/sweep_math.h"

namespace atelier {
namespace {

using Lane = Vec4<double>;

/// Threads that add up the rows of a particle.
constexpr int kRowTeam = 8;

__device__ inline int thread_index() {
  return static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
}

__global__ void begin_kernel(const __grid_constant__ ProjectiveFrame f, int s) {
  const int i = thread_index();
  if (i == 0) {
    f.memory[0].count = 0;
    f.memory[0].newest = 0;
    f.memory[0].first = 1;
    f.memory[0].least = 0;
  }
  if (i >= f.count) {
    return;
  }
  const Lane x = f.x[i];
  Vec3d velocity = xyz(f.velocity[i]);
  const bool is_free = f.place[i] >= 0;
  if (!is_free) {
    const double share = 1.0 / (f.substeps - s);
    velocity = (share / f.h) * (xyz(f.target[i]) - xyz(x));
    f.velocity[i] = with_w(velocity, 0.0);
  }
  const Vec3d acceleration = f.air != nullptr ? f.gravity + xyz(f.air[i]) : f.gravity;
  f.wish[i] = with_w(is_free ? velocity + f.h * acceleration : velocity, 0.0);
  f.v[i] = with_w(velocity, 0.0);
  f.at[i] = with_w(xyz(x) + f.h * velocity, 0.0);
  f.bounds[i].holds = 0;
  f.impulses[i] = Lane{};
  if (f.across != nullptr) {
    f.across[i].holds = 0;
    f.across_impulses[i] = Lane{};
  }
  if (f.self_origin != nullptr) {
    if (!is_free) {
      f.touches.reached[0][i] = f.touches.reached[1][i] = with_w(velocity, 0.0);
    }
    // Before the body moves old overlaps out: that may not pass other cloth either.
    f.self_origin[i] = x;
    f.self_carry[i] = Lane{};
  }
}

__device__ inline Vec3d row_force(const ElasticView& e, int r, const Lane* at, const Lane* v) {
  const ElasticRow row = e.rows[r];
  if (r < e.bend_begin) {
    return spring_force(row, e.spring_rest[r], e.longest, e.damping, at, v);
  }
  if (r < e.yarn_begin) {
    return bend_force(row, e.bend_rest[r - e.bend_begin], e.damping, at, v);
  }
  const bool second = (r - e.yarn_begin) % 2 == 1;
  const ElasticRow other = e.rows[second ? r - 1 : r + 1];
  const auto both = [&](const Lane* of) {
    return second ? Yarns{row_value(other, of), row_value(row, of)}
                  : Yarns{row_value(row, of), row_value(other, of)};
  };
  const Yarns forces = yarn_forces(e.yarn_moduli[(r - e.yarn_begin) / 2], e.longest, both(at),
                                   e.damping, e.damping > 0 ? both(v) : Yarns{});
  return second ? forces.v : forces.u;
}

using RowTeam = cooperative_groups::thread_block_tile<kRowTeam>;
__device__ inline RowTeam row_team() {
  return cooperative_groups::tiled_partition<kRowTeam>(cooperative_groups::this_thread_block());
}

/// In every thread of a team: the sum over its threads.
__device__ inline Vec3d sum_in_team(const RowTeam& team, Vec3d sum) {
  for (int step = kRowTeam / 2; step > 0; step /= 2) {
    sum +=
        Vec3d{team.shfl_xor(sum.x, step), team.shfl_xor(sum.y, step), team.shfl_xor(sum.z, step)};
  }
  return sum;
}

/// The same of one that two parts of the body pinch, each of which has its own impulse.
__device__ __noinline__ Vec3d impulses_of_pinch(const ProjectiveFrame& f, int i, Vec3d v) {
  const double mass = f.mass[i];
  const bool gentle = f.gentle[i] != 0;
  Vec3d first = xyz(f.impulses[i]);
  Vec3d second = xyz(f.across_impulses[i]);
  if (gentle) {
    first = bound_impulse(f.bounds[i], first, mass, xyz(f.v[i]), f.friction);
    second = bound_impulse(f.across[i], second, mass, xyz(f.v[i]), f.friction);
  } else {
    const auto held = [&](const VelocityBound& bound, Vec3d other) {
      return bound_impulse(bound, {}, mass, v + (1 / mass) * other, f.friction);
    };
    first = held(f.bounds[i], second);
    for (int turn = 0; turn < kBodyTurns; ++turn) {
      second = held(f.across[i], first);
      first = held(f.bounds[i], second);
    }
  }
  f.impulses[i] = with_w(first, 0.0);
  f.across_impulses[i] = with_w(second, 0.0);
  return first + second;
}

/// The impulse of the body on free particle `i`, whose velocity without it is `v`. One that is held
/// gently has its own for the iteration (`renews`: in the first sweep of one). `kPinched`: there
/// may be second contacts; what they need slows the kernels down where there are none.
template <bool kPinched>
__device__ inline Vec3d impulse_of_body(const ProjectiveFrame& f, int i, Vec3d v, bool renews) {
  const VelocityBound bound = f.bounds[i];
  if (bound.holds == 0) {
    return {};
  }
  const bool gentle = f.gentle[i] != 0;
  bool pinched = false;
  if constexpr (kPinched) {
    pinched = f.across[i].holds != 0;
  }
  if (gentle && !renews) {
    return xyz(f.impulses[i]) + (pinched ? xyz(f.across_impulses[i]) : Vec3d{});
  }
  if constexpr (kPinched) {
    if (pinched) {
      return impulses_of_pinch(f, i, v);
    }
  }
  const Vec3d impulse = bound_impulse(bound, gentle ? xyz(f.impulses[i]) : Vec3d{}, f.mass[i],
                                      gentle ? xyz(f.v[i]) : v, f.friction);
  f.impulses[i] = with_w(impulse, 0.0);
  return impulse;
}

/// The right hand side of an iteration for free particle `i`: the momentum between the velocity
/// that it leaves the step with and the iteration's.
__device__ inline void set_right(const ProjectiveFrame& f, int i, Vec3d reached) {
  const Vec3d right = f.mass[i] * (reached - xyz(f.v[i]));
  f.right[f.place[i]] = {static_cast<float>(right.x), static_cast<float>(right.y),
                         static_cast<float>(right.z), 0.0f};
}

/// The right hand side of iteration `k`, with impulses of contact: those of the body, and those of
/// other cloth as they are. A team of threads a particle.
template <bool kPinched>
__global__ void forces_kernel(const __grid_constant__ ProjectiveFrame f, int k) {
  const RowTeam team = row_team();
  const int i = thread_index() / kRowTeam;
  const int place = i < f.count ? f.place[i] : -1;
  if (place < 0) {
    return;
  }
  Vec3d sum{};
  const int begin = f.elastic.begin[i];
  const int end = f.elastic.begin[i + 1];
  wait_for_kernels_before();
  for (int e = begin + static_cast<int>(team.thread_rank()); e < end; e += kRowTeam) {
    sum += f.elastic.weight[e] * row_force(f.elastic, f.elastic.row[e], f.at, f.v);
  }
  sum = sum_in_team(team, sum);
  const TouchesView& t = f.touches;
  const int touches = t.touches != nullptr ? t.degree[i] : 0;
  Vec3d of_cloth{};
  if (touches > 0) {
    const Lane* const impulses = t.impulses[k * kTouchSweeps % 2];
    for (int e = static_cast<int>(team.thread_rank()); e < touches; e += kRowTeam) {
      const int entry = t.entries[t.begin[i] + e];
      of_cloth += t.touches[entry / 4].bound.weight[entry % 4] * xyz(impulses[entry / 4]);
    }
    of_cloth = sum_in_team(team, of_cloth);
  }
  if (team.thread_rank() != 0) {
    return;
  }
  const double share = 1 / f.mass[i];
  const Vec3d alone = xyz(f.wish[i]) + (f.h * share) * sum;
  const Vec3d held = alone + share * of_cloth;
  const Vec3d reached = held + share * impulse_of_body<kPinched>(f, i, held, true);
  if (touches > 0) {
    t.alone[i] = with_w(alone, 0.0);
    t.reached[0][i] = with_w(reached, 0.0);
  }
  set_right(f, i, reached);
}

/// Sweep `j` of iteration `k` over contacts between pieces of cloth: every one anew, all at once;
/// then the body. A team of threads a particle, each of which works out all of its own contacts.
template <bool kPinched>
__global__ void hold_kernel(const __grid_constant__ ProjectiveFrame f, int k, int j) {
  const RowTeam team = row_team();
  const TouchesView& t = f.touches;
  const int i = thread_index() / kRowTeam;
  wait_for_kernels_before();
  const int touches = i < f.count ? t.degree[i] : 0;
  if (touches == 0) {
    return;
  }
  const int turn = k * kTouchSweeps + j;
  const Lane* const before = t.impulses[turn % 2];
  const Lane* const reached = t.reached[j % 2];
  Vec3d of_cloth{};
  for (int e = static_cast<int>(team.thread_rank()); e < touches; e += kRowTeam) {
    const int entry = t.entries[t.begin[i] + e];
    const ClothTouch touch = t.touches[entry / 4];
    const Vec3d relative = relative_velocity(touch.bound, [&](int p) { return xyz(reached[p]); });
    const Vec3d impulse =
        touch_impulse(touch.bound, xyz(before[entry / 4]), touch.mass, relative, t.friction);
    if (entry % 4 == touch.owner) {
      t.impulses[(turn + 1) % 2][entry / 4] = with_w(impulse, 0.0);
    }
    of_cloth += touch.bound.weight[entry % 4] * impulse;
  }
  of_cloth = sum_in_team(team, of_cloth);
  if (team.thread_rank() != 0) {
    return;
  }
  const double share = 1 / f.mass[i];
  const Vec3d held = xyz(t.alone[i]) + share * of_cloth;
  const Vec3d next = held + share * impulse_of_body<kPinched>(f, i, held, false);
  t.reached[(j + 1) % 2][i] = with_w(next, 0.0);
  set_right(f, i, next);
}

/// Particles go where the iterations have led them; tethers hold them.
__global__ void leave_kernel(const __grid_constant__ ProjectiveFrame f) {
  const int i = thread_index();
  if (i >= f.count) {
    return;
  }
  const Lane x = f.x[i];
  f.velocity[i] = f.v[i];
  f.origin[i] = x;
  f.start[i] = x;
  if (f.touched != nullptr) {
    if (!(squared_norm(xyz(f.impulses[i])) > 0)) {  // of two contacts one pushes: that counts
      f.impulses[i] = f.across_impulses[i];
    }
    f.touched[i] = squared_norm(xyz(f.impulses[i])) > 0 ? 1 : 0;
  }
  Lane next = with_w(xyz(f.at[i]), x.w);
  const int anchor = f.tether_anchor != nullptr ? f.tether_anchor[i] : -1;
  if (anchor >= 0) {  // fixed: it goes where its velocity leads it
    project_tether(next, xyz(f.at[anchor]), f.tether_length[i]);
  }
  f.x[i] = next;
}

/// Velocities: those of the iterations, or of the motion where that is another.
__global__ void finish_kernel(const __grid_constant__ ProjectiveFrame f) {
  const int i = thread_index();
  if (i >= f.count) {
    return;
  }
  const Vec3d x = xyz(f.x[i]);
  const Vec3d start = xyz(f.start[i]);
  const Vec3d at = xyz(f.at[i]);
  const Vec3d origin = xyz(f.origin[i]);
  const auto same = [](Vec3d a, Vec3d b) { return a.x == b.x && a.y == b.y && a.z == b.z; };
  Vec3d velocity = xyz(f.velocity[i]);
  if (!same(x, at) || !same(start, origin)) {
    velocity = (1 / f.h) * (x - start);
  }
  if (f.place[i] >= 0) {
    velocity = f.keep * velocity;
  }
  f.velocity[i] = with_w(velocity, 0.0);
  if (!(isfinite(x.x) && isfinite(x.y) && isfinite(x.z))) {
    atomicMin(f.bad, i);
  }
}

}  // namespace

void launch_projective_begin(const ProjectiveFrame& frame, int s, cudaStream_t stream) {
  begin_kernel<<<cuda_blocks(frame.count), kCudaBlock, 0, stream>>>(frame, s);
  ATELIER_CUDA_LAUNCHED(begin_kernel);
}

void launch_projective_forces(const ProjectiveFrame& frame, int k, bool pinched,
                              cudaStream_t stream) {
  launch_in_chain(pinched ? forces_kernel<true> : forces_kernel<false>,
                  cuda_blocks(frame.count, kCudaBlock / kRowTeam), kCudaBlock, stream, frame, k);
}

void launch_projective_hold(const ProjectiveFrame& frame, int k, int j, bool pinched,
                            cudaStream_t stream) {
  launch_in_chain(pinched ? hold_kernel<true> : hold_kernel<false>,
                  cuda_blocks(frame.count, kCudaBlock / kRowTeam), kCudaBlock, stream, frame, k, j);
}

void launch_projective_leave(const ProjectiveFrame& frame, cudaStream_t stream) {
  leave_kernel<<<cuda_blocks(frame.count), kCudaBlock, 0, stream>>>(frame);
  ATELIER_CUDA_LAUNCHED(leave_kernel);
}

void launch_projective_finish(const ProjectiveFrame& frame, cudaStream_t stream) {
  finish_kernel<<<cuda_blocks(frame.count), kCudaBlock, 0, stream>>>(frame);
  ATELIER_CUDA_LAUNCHED(finish_kernel);
}

}  // namespace atelier
