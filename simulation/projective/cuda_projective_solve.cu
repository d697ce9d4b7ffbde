#include "simulation/projective/anderson_math.h"
#include "simulation/projective/cuda_chain.cuh"
#include "simulation/projective/cuda_projective.cuh"
#include "simulation/xpbd/cuda_barrier.cuh"
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

/// Adds up `kCount` sums over the threads of a warp, each of which ends with one of them, whose
/// number is added to `index`; half of what a thread still has goes to a partner in each step. 24
/// sums are with the threads whose number does not end with the bits 11.
template <int kCount, int kStep = 16>
__device__ inline float share_sums(float* sum, int lane, int& index) {
  if constexpr (kStep == 0) {
    return sum[0];
  } else {
    constexpr int kHalf = (kCount + 1) / 2;
    const bool upper = (lane & kStep) != 0;
#pragma unroll
    for (int d = 0; d < kHalf; ++d) {
      const float high = d + kHalf < kCount ? sum[d + kHalf] : 0.0f;
      const float sent = upper ? sum[d] : high;
      sum[d] = (upper ? high : sum[d]) + __shfl_xor_sync(kWholeWarp, sent, kStep);
    }
    index += upper ? kHalf : 0;
    return share_sums<kHalf, kStep / 2>(sum, lane, index);
  }
}

/// Numbers of W that a thread reads at once, 16 bytes.
template <class T>
constexpr int kWide = 16 / static_cast<int>(sizeof(T));

__device__ inline uint4 read_wide(const void* from) {
  return __ldcg(static_cast<const uint4*>(from));
}
__device__ inline void unpack(const uint4& wide, float (&to)[kWide<float>]) {
  to[0] = __uint_as_float(wide.x);
  to[1] = __uint_as_float(wide.y);
  to[2] = __uint_as_float(wide.z);
  to[3] = __uint_as_float(wide.w);
}
__device__ inline void unpack(const uint4& wide, float (&to)[kWide<__half>]) {
  const unsigned words[4] = {wide.x, wide.y, wide.z, wide.w};
#pragma unroll
  for (int k = 0; k < 4; ++k) {
    const float2 pair = __half22float2(reinterpret_cast<const __half2&>(words[k]));
    to[2 * k] = pair.x;
    to[2 * k + 1] = pair.y;
  }
}
template <class T>
__device__ inline const T* values_of(const InverseView& w) {
  if constexpr (sizeof(T) == sizeof(float)) {
    return w.values;
  } else {
    return w.halves;
  }
}

/// Rows of W times the right hand side; a thread takes 16 bytes of each row at a time.
template <class T>
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
  wait_for_kernels_before();
  const T* const values = values_of<T>(w) + item.offset;
  const Vec4<float>* const right = f.right + item.column;
  float sum[kSums] = {};
  const int step = kWide<T> * (by_block ? kSolveThreads : 32);
  for (int c = kWide<T> * (by_block ? static_cast<int>(threadIdx.x) : lane); c < item.columns;
       c += step) {
    Vec4<float> b[kWide<T>];
#pragma unroll
    for (int k = 0; k < kWide<T>; ++k) {
      b[k] = right[c + k];
    }
#pragma unroll
    for (int r = 0; r < kRowsAnItem; ++r) {
      const std::int64_t row = static_cast<std::int64_t>(min(r, item.rows - 1)) * item.stride;
      float of_row[kWide<T>];
      unpack(read_wide(values + row + c), of_row);
#pragma unroll
      for (int k = 0; k < kWide<T>; ++k) {
        sum[3 * r] += of_row[k] * b[k].x;
        sum[3 * r + 1] += of_row[k] * b[k].y;
        sum[3 * r + 2] += of_row[k] * b[k].z;
      }
    }
  }
  static_assert(kSums == 24);
  int index = 0;
  float own = share_sums<kSums>(sum, lane, index);
  bool holds = lane % 4 != 3;
  if (by_block) {
    if (holds) {
      of_warps[warp][index] = own;
    }
    __syncthreads();
    index = lane;
    holds = warp == 0 && lane < kSums;
    own = 0;
    for (int k = 0; k < kSolveWarps && holds; ++k) {
      own += of_warps[k][index];
    }
  }
  if (holds && index < 3 * item.rows) {
    const int row = item.row + index / 3;
    Vec4<float>& to = f.partial[static_cast<std::int64_t>(item.chunk) * f.unknowns + row];
    (&to.x)[index % 3] = w.scale[row] * own;
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

/// The change of an unknown, which every warp of a block has, and what it needs of iterations
/// before; read before the change is known.
struct TileMemory {
  AndersonPlan plan;
  Vec3d last_change;
  Vec3d of_change;  ///< the difference of the warp's number
};
__device__ inline TileMemory tile_memory(const ProjectiveFrame& f, const AndersonMemory& memory,
                                         int unknown, bool has) {
  const int warp = static_cast<int>(threadIdx.x) / 32;
  TileMemory out{anderson_plan(memory, f.window), {}, {}};
  if (out.plan.takes && has) {
    out.last_change = xyz(f.last_change[unknown]);
    if (warp < out.plan.count && warp != out.plan.slot) {
      out.of_change = xyz(f.of_change[static_cast<std::int64_t>(warp) * f.unknowns + unknown]);
    }
  }
  return out;
}

/// The difference of an unknown to the last iteration, and products of it and the change with those
/// of iterations before, over a tile: a warp has all of its unknowns and some of the products.
__device__ inline void take_difference(const ProjectiveFrame& f, const TileMemory& memory,
                                       int unknown, bool has, Vec3d change) {
  const int warp = static_cast<int>(threadIdx.x) / 32;
  const int lane = static_cast<int>(threadIdx.x) % 32;
  const auto note = [&](int dot_index, double value) {
    const double all = sum_in_warp(has ? value : 0.0);
    if (lane == 0) {
      f.dots[static_cast<std::int64_t>(dot_index) * f.inverse.tiles_count + blockIdx.x] = all;
    }
  };
  const AndersonPlan plan = memory.plan;
  const Vec3d difference = change - memory.last_change;
  if (warp == kSolveWarps - 1) {
    note(0, squared_norm(change));
    if (has) {
      f.change[unknown] = with_w(change, 0.0);
    }
    if (has && plan.takes) {
      const Vec3d next = xyz(f.v[f.particle[unknown]]) + change;
      const std::int64_t to = static_cast<std::int64_t>(plan.slot) * f.unknowns + unknown;
      f.of_change[to] = with_w(difference, 0.0);
      f.of_next[to] = with_w(next - xyz(f.last_next[unknown]), 0.0);
    }
  }
  for (int k = warp; k < plan.count; k += kSolveWarps) {
    Vec3d other = memory.of_change;
    if (k == plan.slot) {
      other = difference;
    } else if (k != warp && has) {
      other = xyz(f.of_change[static_cast<std::int64_t>(k) * f.unknowns + unknown]);
    }
    note(1 + k, dot(difference, other));
    note(1 + f.window + k, dot(change, other));
  }
}

/// Rows of a tile that a block holds at once; a few threads take one, 16 bytes each.
constexpr int kRowsAtOnce = 1024;
constexpr int kSteps = 4;  ///< whose numbers are read together

/// What a row of a tile is multiplied by, and where it lies.
struct alignas(16) RowInHand {
  float x, y, z;
  int eight;
};

/// W^T times that: the change of the velocities. A block has a tile of columns; its rows, one list
/// for all parts, are shared out among the threads, who wait for memory together.
template <class T>
__global__ void __launch_bounds__(kSolveThreads, 3)
    columns_kernel(const __grid_constant__ ProjectiveFrame f, int k) {
  constexpr int kTeam = kColumnsATile / kWide<T>;  // threads that take a row
  constexpr int kRowsAStep = kSolveThreads / kTeam;
  constexpr int kSums = 3 * kWide<T>;
  __shared__ RowInHand in_hand[kRowsAtOnce];
  __shared__ uchar2 eights_of[kRowsAtOnce];
  __shared__ float of_warps[kSolveWarps][kColumnsATile][3];
  __shared__ double changes[kColumnsATile][3];
  const InverseView& w = f.inverse;
  const ColumnsTile tile = w.tiles[blockIdx.x];
  const int thread = static_cast<int>(threadIdx.x);
  const int warp = thread / 32;
  const int lane = thread % 32;
  const int member = thread % kTeam;
  const int eight = member * kWide<T> / 8;
  const bool has = lane < tile.columns;
  const int unknown = tile.column + (has ? lane : 0);
  wait_for_kernels_before();
  const TileMemory memory = tile_memory(f, f.memory[k % 2], unknown, has);
  const T* const values = values_of<T>(w) + member * kWide<T>;
  float sum[kSums] = {};  // [axis][column]
  for (int first = tile.rows_begin; first < tile.rows_end; first += kRowsAtOnce) {
    const int rows = min(tile.rows_end - first, kRowsAtOnce);
    constexpr int kRound = kRowsAStep * kSteps;
    const int filled = (rows + kRound - 1) / kRound * kRound;
    __syncthreads();
    for (int r = thread; r < filled; r += kSolveThreads) {
      RowInHand row{0, 0, 0, 0};
      uchar2 eights = make_uchar2(0, 0);
      if (r < rows) {
        const TileRow of = w.tile_rows[first + r];
        Vec3f all{};
        for (int c = 0; c < of.chunks; ++c) {
          all += xyz(f.partial[static_cast<std::int64_t>(c) * f.unknowns + of.row]);
        }
        all = w.scale[of.row] * all;
        row = {all.x, all.y, all.z, of.eight};
        eights = make_uchar2(of.low, of.high);
      }
      in_hand[r] = row;
      eights_of[r] = eights;
    }
    __syncthreads();
    for (int r = thread / kTeam; r < filled; r += kRound) {
      uint4 wide[kSteps];
#pragma unroll
      for (int step = 0; step < kSteps; ++step) {
        const uchar2 eights = eights_of[r + step * kRowsAStep];
        wide[step] = make_uint4(0, 0, 0, 0);
        if (eight >= eights.x && eight < eights.y) {
          wide[step] = read_wide(
              values + 8 * static_cast<std::int64_t>(in_hand[r + step * kRowsAStep].eight));
        }
      }
#pragma unroll
      for (int step = 0; step < kSteps; ++step) {
        const RowInHand row = in_hand[r + step * kRowsAStep];
        float value[kWide<T>];
        unpack(wide[step], value);
        const float y[3] = {row.x, row.y, row.z};
#pragma unroll
        for (int axis = 0; axis < 3; ++axis) {
#pragma unroll
          for (int c = 0; c < kWide<T>; ++c) {
            sum[kWide<T> * axis + c] += value[c] * y[axis];
          }
        }
      }
    }
  }
#pragma unroll
  for (int d = 0; d < kSums; ++d) {
#pragma unroll
    for (int other = kTeam; other < 32; other *= 2) {
      sum[d] += __shfl_xor_sync(kWholeWarp, sum[d], other);
    }
    if (lane < kTeam) {
      of_warps[warp][kWide<T> * member + d % kWide<T>][d / kWide<T>] = sum[d];
    }
  }
  __syncthreads();
  if (thread < 3 * kColumnsATile) {
    double all = 0;
    for (int g = 0; g < kSolveWarps; ++g) {
      all += of_warps[g][thread / 3][thread % 3];
    }
    changes[thread / 3][thread % 3] = all;
  }
  __syncthreads();
  take_difference(f, memory, unknown, has, {changes[lane][0], changes[lane][1], changes[lane][2]});
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

/// Small blocks: there are few unknowns, and each multiprocessor reads some of them.
constexpr int kNextThreads = 128;
constexpr int kNextWarps = kNextThreads / 32;
constexpr int kAhead = 5;  ///< differences that are read before it is known what is taken of them

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
  for (int e = thread; e < n * n; e += kNextThreads) {
    const bool fresh = e / n == plan.slot || e % n == plan.slot;
    decision.matrix[e] = fresh ? 0 : memory.products[e / n][e % n];
  }
  constexpr int kTogether = 3;  // sums whose numbers a warp reads together
  for (int first = thread / 32; first < 1 + 2 * n; first += kTogether * kNextWarps) {
    double sum[kTogether] = {};
#pragma unroll 5
    for (int t = lane; t < tiles; t += 32) {
#pragma unroll
      for (int j = 0; j < kTogether; ++j) {
        const int d = first + j * kNextWarps;
        if (d < 1 + 2 * n) {
          const int index = d <= n ? d : d - n + f.window;
          sum[j] += f.dots[static_cast<std::int64_t>(index) * tiles + t];
        }
      }
    }
#pragma unroll
    for (int j = 0; j < kTogether; ++j) {
      const double all = sum_in_warp(sum[j]);
      if (lane == 0 && first + j * kNextWarps < 1 + 2 * n) {
        decision.dots[first + j * kNextWarps] = all;
      }
    }
  }
  __syncthreads();
  const double size = decision.dots[0];
  const bool usable = anderson_usable(size, f.unknowns);
  const bool first = !plan.takes || !usable || anderson_grew(size, memory.least);
  for (int e = thread; e < n * n; e += kNextThreads) {
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
__global__ void __launch_bounds__(kNextThreads)
    next_kernel(const __grid_constant__ ProjectiveFrame f, int k) {
  __shared__ AndersonDecision decision;
  const int unknown = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  const bool has = unknown < f.unknowns;
  const int i = has ? f.particle[unknown] : 0;
  wait_for_kernels_before();
  const int known = anderson_plan(f.memory[k % 2], f.window).count;
  const auto of_next = [&](int d) {
    return xyz(f.of_next[static_cast<std::int64_t>(d) * f.unknowns + unknown]);
  };
  Vec3d x{};
  Vec3d v{};
  Vec3d ahead[kAhead] = {};
  if (has) {
    const Vec3d change = xyz(f.change[unknown]);
#pragma unroll
    for (int d = 0; d < kAhead; ++d) {
      if (d < known) {
        ahead[d] = of_next(d);
      }
    }
    x = xyz(f.x[i]);
    v = xyz(f.v[i]) + change;
    f.last_change[unknown] = with_w(change, 0.0);
    f.last_next[unknown] = with_w(v, 0.0);
  }
  int count = 0;
  if (f.window > 0) {
    decide(f, f.memory[k % 2], f.memory[(k + 1) % 2], decision);
    __syncthreads();
    count = decision.count;
  }
  if (!has) {
    return;
  }
#pragma unroll
  for (int d = 0; d < kAhead; ++d) {
    if (d < count) {
      v -= decision.shares[d] * ahead[d];
    }
  }
  for (int d = kAhead; d < count; ++d) {
    v -= decision.shares[d] * of_next(d);
  }
  f.v[i] = with_w(v, 0.0);
  f.at[i] = with_w(x + f.h * v, 0.0);
}

}  // namespace

void launch_projective_rows(const ProjectiveFrame& frame, cudaStream_t stream) {
  const int short_items = frame.inverse.items_count - frame.inverse.long_items;
  const unsigned blocks =
      static_cast<unsigned>(frame.inverse.long_items) + cuda_blocks(short_items, kSolveWarps);
  launch_in_chain(frame.inverse.halves != nullptr ? rows_kernel<__half> : rows_kernel<float>,
                  blocks, kSolveThreads, stream, frame);
}

void launch_projective_columns(const ProjectiveFrame& frame, int k, cudaStream_t stream) {
  launch_in_chain(frame.inverse.halves != nullptr ? columns_kernel<__half> : columns_kernel<float>,
                  static_cast<unsigned>(frame.inverse.tiles_count), kSolveThreads, stream, frame,
                  k);
}

void launch_projective_next(const ProjectiveFrame& frame, int k, cudaStream_t stream) {
  launch_in_chain(next_kernel, cuda_blocks(frame.unknowns, kNextThreads), kNextThreads, stream,
                  frame, k);
}

}  // namespace atelier
