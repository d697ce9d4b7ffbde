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
  if (f.self_origin != nullptr) {
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

/// The right hand side of an iteration: what momentum lacks, with the impulse of contact. A team of
/// threads a particle.
__global__ void forces_kernel(const __grid_constant__ ProjectiveFrame f) {
  namespace cg = cooperative_groups;
  const cg::thread_block_tile<kRowTeam> team =
      cg::tiled_partition<kRowTeam>(cg::this_thread_block());
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
  for (int step = kRowTeam / 2; step > 0; step /= 2) {
    sum +=
        Vec3d{team.shfl_xor(sum.x, step), team.shfl_xor(sum.y, step), team.shfl_xor(sum.z, step)};
  }
  if (team.thread_rank() != 0) {
    return;
  }
  const double mass = f.mass[i];
  const Vec3d momentum = mass * xyz(f.wish[i]) + f.h * sum;
  Vec3d right = momentum - mass * xyz(f.v[i]);
  const VelocityBound bound = f.bounds[i];
  if (bound.holds != 0) {
    const bool gentle = f.gentle[i] != 0;
    const Vec3d impulse = bound_impulse(bound, gentle ? xyz(f.impulses[i]) : Vec3d{}, mass,
                                        gentle ? xyz(f.v[i]) : (1 / mass) * momentum, f.friction);
    f.impulses[i] = with_w(impulse, 0.0);
    right += impulse;
  }
  f.right[place] = {static_cast<float>(right.x), static_cast<float>(right.y),
                    static_cast<float>(right.z), 0.0f};
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

void launch_projective_forces(const ProjectiveFrame& frame, cudaStream_t stream) {
  launch_in_chain(forces_kernel, cuda_blocks(frame.count, kCudaBlock / kRowTeam), kCudaBlock,
                  stream, frame);
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
