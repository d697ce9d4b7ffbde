#include "simulation/projective/anderson_math.h"
#include "simulation/projective/cuda_projective.cuh"
#include "simulation/xpbd/cuda_boxes.cuh"

namespace atelier {
namespace {

constexpr int kSolveThreads = 256;
constexpr int kSolveWarps = kSolveThreads / 32;
constexpr int kSums = 3 * kRowsAnItem;

/// In every thread of a warp: the sum over its threads, always in the same order.
template <class T>
__device__ inline T sum_in_warp(T value) {
  for (int step = 16; step > 0; step /= 2) {
    value += __shfl_xor_sync(kWholeWarp, value, step);
  }
  return value;
}

/// Adds to `sum` what four columns of a row do.
__device__ inline void add_products(const Vec4<float>& w, const Vec4<float> (&b)[4], float* sum) {
  sum[0] += w.x * b[0].x + w.y * b[1].x + w.z * b[2].x + w.w * b[3].x;
  sum[1] += w.x * b[0].y + w.y * b[1].y + w.z * b[2].y + w.w * b[3].y;
  sum[2] += w.x * b[0].z + w.y * b[1].z + w.z * b[2].z + w.w * b[3].z;
}

/// Rows of W times the right hand side; a thread takes four columns at a time.
__global__ void __launch_bounds__(kSolveThreads)
    rows_kernel(const __grid_constant__ ProjectiveFrame f) {
  __shared__ float of_warps[kSolveWarps][kSums];
  const InverseView& w = f.inverse;
  const int warp = static_cast<int>(threadIdx.x) / 32;
  const int lane = static_cast<int>(threadIdx.x) % 32;
  const int block = static_cast<int>(blockIdx.x);
  const bool by_block = block < w.long_items;
  const int at = by_block ? block : w.long_items + (block - w.long_items) * kSolveWarps + warp;
  if (at >= w.items_count) {
    return;
  }
  const RowsItem item = w.items[at];
  const float* const values = w.values + item.offset;
  const Vec4<float>* const right = f.right + item.column;
  float sum[kSums] = {};
  const int step = 4 * (by_block ? kSolveThreads : 32);
  for (int c = 4 * (by_block ? static_cast<int>(threadIdx.x) : lane); c < item.columns; c += step) {
    const Vec4<float> b[4] = {right[c], right[c + 1], right[c + 2], right[c + 3]};
#pragma unroll
    for (int r = 0; r < kRowsAnItem; ++r) {
      const std::int64_t row = static_cast<std::int64_t>(min(r, item.rows - 1)) * item.stride;
      add_products(*reinterpret_cast<const Vec4<float>*>(values + row + c), b, sum + 3 * r);
    }
  }
  float own = 0;  // what thread d of the warp takes: sum d
#pragma unroll
  for (int d = 0; d < kSums; ++d) {
    const float all = sum_in_warp(sum[d]);
    own = lane == d ? all : own;
  }
  if (by_block) {
    if (lane < kSums) {
      of_warps[warp][lane] = own;
    }
    __syncthreads();
    if (warp == 0 && lane < kSums) {
      own = 0;
      for (int k = 0; k < kSolveWarps; ++k) {
        own += of_warps[k][lane];
      }
    }
  }
  if ((!by_block || warp == 0) && lane < 3 * item.rows) {
    Vec4<float>* const to = f.partial + static_cast<std::int64_t>(item.chunk) * f.unknowns + item.row;
    (&to[lane / 3].x)[lane % 3] = own;
  }
}

/// What the next iteration does with its change, given what is remembered.
struct AndersonPlan {
  bool takes;  ///< a difference to the last change
  int slot;    ///< for it
  int count;   ///< of differences then
};
__device__ inline AndersonPlan anderson_plan(const AndersonMemory& memory, int window) {
  if (window == 0 || memory.first != 0) {
    return {false, 0, 0};
  }
  return {true, memory.count == 0 ? 0 : (memory.newest + 1) % window,
          min(memory.count + 1, window)};
}

/// The difference of one unknown to the last iteration, and products of it and the change with
/// those of iterations before, of a warp's unknowns. All of the warp's threads come here; `has`: it
/// has an unknown.
__device__ inline void take_difference(const ProjectiveFrame& f, const AndersonMemory& memory,
                                       int tile, int unknown, bool has, Vec3d change) {
  const int lane = static_cast<int>(threadIdx.x) % 32;
  const auto note = [&](int dot_index, double value) {
    const double all = sum_in_warp(has ? value : 0.0);
    if (lane == 0) {
      f.dots[static_cast<std::int64_t>(dot_index) * f.inverse.tiles_count + tile] = all;
    }
  };
  note(0, squared_norm(change));
  const AndersonPlan plan = anderson_plan(memory, f.window);
  if (!plan.takes) {
    return;
  }
  Vec3d difference{};
  if (has) {
    difference = change - xyz(f.last_change[unknown]);
    const Vec3d next = xyz(f.v[f.particle[unknown]]) + change;
    const std::int64_t to = static_cast<std::int64_t>(plan.slot) * f.unknowns + unknown;
    f.of_change[to] = with_w(difference, 0.0);
    f.of_next[to] = with_w(next - xyz(f.last_next[unknown]), 0.0);
  }
  for (int k = 0; k < plan.count; ++k) {
    Vec3d other = difference;
    if (has && k != plan.slot) {
      other = xyz(f.of_change[static_cast<std::int64_t>(k) * f.unknowns + unknown]);
    }
    note(1 + k, dot(difference, other));
    note(1 + f.window + k, dot(change, other));
  }
}

/// W^T times that: the change of the velocities. A block has a tile of columns, whose rows its warps
/// share.
__global__ void __launch_bounds__(kSolveThreads)
    columns_kernel(const __grid_constant__ ProjectiveFrame f, int k) {
  __shared__ float y[kSolveThreads][3];
  __shared__ float of_warps[kSolveWarps][kColumnsATile][3];
  const InverseView& w = f.inverse;
  const ColumnsTile tile = w.tiles[blockIdx.x];
  const int thread = static_cast<int>(threadIdx.x);
  const int warp = thread / 32;
  const int lane = thread % 32;
  const bool has = lane < tile.columns;
  const int column = tile.column + (has ? lane : 0);
  Vec3f sum{};
  for (int p = tile.path_begin; p < tile.path_end; ++p) {
    const PathPart part = w.paths[p];
    for (int first = 0; first < part.rows; first += kSolveThreads) {
      const int rows = min(part.rows - first, kSolveThreads);
      __syncthreads();
      if (thread < rows) {
        Vec3f all{};
        for (int c = 0; c < part.chunks; ++c) {
          all += xyz(f.partial[static_cast<std::int64_t>(c) * f.unknowns + part.row + first + thread]);
        }
        y[thread][0] = all.x;
        y[thread][1] = all.y;
        y[thread][2] = all.z;
      }
      __syncthreads();
      const float* const values = w.values + part.offset +
                                  static_cast<std::int64_t>(first) * part.stride +
                                  (column - part.column);
#pragma unroll 8
      for (int r = warp; r < rows; r += kSolveWarps) {
        const float value = values[static_cast<std::int64_t>(r) * part.stride];
        sum += value * Vec3f{y[r][0], y[r][1], y[r][2]};
      }
    }
  }
  of_warps[warp][lane][0] = sum.x;
  of_warps[warp][lane][1] = sum.y;
  of_warps[warp][lane][2] = sum.z;
  __syncthreads();
  if (warp != 0) {
    return;
  }
  Vec3d change{};
  for (int g = 0; g < kSolveWarps && has; ++g) {
    change += Vec3d{of_warps[g][lane][0], of_warps[g][lane][1], of_warps[g][lane][2]};
  }
  if (has) {
    f.change[column] = with_w(change, 0.0);
  }
  take_difference(f, f.memory[k % 2], static_cast<int>(blockIdx.x), column, has, change);
}

/// The threads of a warp, each with a row.
struct WarpInRows {
  template <class Work>
  __device__ void rows(int n, const Work& work) const {
    const int lane = static_cast<int>(threadIdx.x) % 32;
    __syncwarp();
    if (lane < n) {
      work(lane);
    }
    __syncwarp();
  }
};

/// What an iteration decides, the same in every block.
struct AndersonDecision {
  double dots[1 + 2 * AndersonMemory::kMost];
  double matrix[AndersonMemory::kMost * AndersonMemory::kMost];
  double shares[AndersonMemory::kMost];  ///< of differences, which are taken off
  int count;
};

/// By all threads of a block, from the dots of all tiles. The first block keeps in `to` what
/// the next iteration asks for.
__device__ inline void decide(const ProjectiveFrame& f, const AndersonMemory& memory,
                              AndersonMemory& to, AndersonDecision& decision) {
  const int thread = static_cast<int>(threadIdx.x);
  const int lane = thread % 32;
  const AndersonPlan plan = anderson_plan(memory, f.window);
  const int n = plan.count;
  const int tiles = f.inverse.tiles_count;
  for (int e = thread; e < n * n; e += kSolveThreads) {
    const bool fresh = e / n == plan.slot || e % n == plan.slot;
    decision.matrix[e] = fresh ? 0 : memory.products[e / n][e % n];
  }
  for (int d = thread / 32; d < 1 + 2 * n; d += kSolveWarps) {
    const int index = d <= n ? d : d - n + f.window;
    double sum = 0;
#pragma unroll 4
    for (int t = lane; t < tiles; t += 32) {
      sum += f.dots[static_cast<std::int64_t>(index) * tiles + t];
    }
    sum = sum_in_warp(sum);
    if (lane == 0) {
      decision.dots[d] = sum;
    }
  }
  __syncthreads();
  const double size = decision.dots[0];
  const bool usable = anderson_usable(size, f.unknowns);
  const bool first = !plan.takes || !usable || anderson_grew(size, memory.least);
  for (int e = thread; e < n * n; e += kSolveThreads) {
    const int a = e / n;
    const int b = e % n;
    if (a == plan.slot || b == plan.slot) {
      decision.matrix[e] = decision.dots[1 + (a == plan.slot ? b : a)];
    }
    if (blockIdx.x == 0) {
      to.products[a][b] = decision.matrix[e];
    }
    decision.matrix[e] *= a == b ? kAndersonRidge : 1;
  }
  __syncthreads();
  if (thread >= 32) {
    return;
  }
  if (lane < n) {
    decision.shares[lane] = decision.dots[1 + n + lane];
  }
  __syncwarp();
  const bool solved = !first && solve_symmetric(decision.matrix, decision.shares, n, WarpInRows{});
  if (lane == 0) {
    decision.count = solved ? n : 0;
    if (blockIdx.x == 0) {
      to.least = first || size < memory.least ? size : memory.least;
      to.count = decision.count;
      to.newest = first ? memory.newest : plan.slot;
      to.first = usable ? 0 : 1;
    }
  }
}

/// The next iteration: what the change makes of this one, less shares of the differences.
__global__ void __launch_bounds__(kSolveThreads)
    next_kernel(const __grid_constant__ ProjectiveFrame f, int k) {
  __shared__ AndersonDecision decision;
  if (f.window > 0) {
    decide(f, f.memory[k % 2], f.memory[(k + 1) % 2], decision);
    __syncthreads();
  }
  const int unknown = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (unknown >= f.unknowns) {
    return;
  }
  const int i = f.particle[unknown];
  const Vec3d change = xyz(f.change[unknown]);
  Vec3d v = xyz(f.v[i]) + change;
  f.last_change[unknown] = with_w(change, 0.0);
  f.last_next[unknown] = with_w(v, 0.0);
  for (int d = 0; d < (f.window > 0 ? decision.count : 0); ++d) {
    v -= decision.shares[d] * xyz(f.of_next[static_cast<std::int64_t>(d) * f.unknowns + unknown]);
  }
  f.v[i] = with_w(v, 0.0);
  f.at[i] = with_w(xyz(f.x[i]) + f.h * v, 0.0);
}

}  // namespace

void launch_projective_rows(const ProjectiveFrame& frame, cudaStream_t stream) {
  const int short_items = frame.inverse.items_count - frame.inverse.long_items;
  const unsigned blocks =
      static_cast<unsigned>(frame.inverse.long_items) + cuda_blocks(short_items, kSolveWarps);
  rows_kernel<<<blocks, kSolveThreads, 0, stream>>>(frame);
  ATELIER_CUDA_LAUNCHED(rows_kernel);
}

void launch_projective_columns(const ProjectiveFrame& frame, int k, cudaStream_t stream) {
  columns_kernel<<<static_cast<unsigned>(frame.inverse.tiles_count), kSolveThreads, 0, stream>>>(
      frame, k);
  ATELIER_CUDA_LAUNCHED(columns_kernel);
}

void launch_projective_next(const ProjectiveFrame& frame, int k, cudaStream_t stream) {
  next_kernel<<<cuda_blocks(frame.unknowns, kSolveThreads), kSolveThreads, 0, stream>>>(frame, k);
  ATELIER_CUDA_LAUNCHED(next_kernel);
}

}  // namespace atelier
