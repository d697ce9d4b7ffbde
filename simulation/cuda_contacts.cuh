#pragma once

#include <climits>

#include "simulation/cuda_block.cuh"

namespace atelier {

constexpr unsigned kWholeWarp = 0xFFFFFFFFu;

template <class T>
__device__ inline T least_in_warp(T value) {
#pragma unroll
  for (int distance = 16; distance > 0; distance /= 2) {
    value = min_of(value, __shfl_xor_sync(kWholeWarp, value, distance));
  }
  return value;
}

template <class T>
__device__ inline Vec3<T> from_lane(Vec3<T> v, int lane) {
  return {__shfl_sync(kWholeWarp, v.x, lane), __shfl_sync(kWholeWarp, v.y, lane),
          __shfl_sync(kWholeWarp, v.z, lane)};
}

/// The offer of the lane for which `mine` holds (of several that of the lowest face), known to all
/// lanes.
template <class T>
__device__ inline FaceOffer<T> offer_in_warp(const FaceOffer<T>& offer, bool mine, T reach) {
  const unsigned lanes = __ballot_sync(kWholeWarp, mine);
  if (lanes == 0) {
    return no_offer(reach);
  }
  int lane = __ffs(static_cast<int>(lanes)) - 1;
  if ((lanes & (lanes - 1)) != 0) {
    int face = mine ? offer.face : INT_MAX;
#pragma unroll
    for (int distance = 16; distance > 0; distance /= 2) {
      face = min(face, __shfl_xor_sync(kWholeWarp, face, distance));
    }
    lane = __ffs(static_cast<int>(__ballot_sync(kWholeWarp, mine && offer.face == face))) - 1;
  }
  FaceOffer<T> out;
  out.face = __shfl_sync(kWholeWarp, offer.face, lane);
  out.squared_distance = __shfl_sync(kWholeWarp, offer.squared_distance, lane);
  out.side = __shfl_sync(kWholeWarp, offer.side, lane);
  out.barycentric = from_lane(offer.barycentric, lane);
  out.time = __shfl_sync(kWholeWarp, offer.time, lane);
  out.hit = from_lane(offer.hit, lane);
  return out;
}

/// Contact of one particle by a whole warp, a candidate a lane. Same choice as on the CPU.
template <class T>
__device__ inline bool contact_by_warp(Vec4<T>& x, Vec4<T>& start, Vec4<T>& held,
                                       const BodyView<T>& body, T t0, T t1,
                                       const BodyContactRule<T>& rule, int face) {
  for (int pass = 0; pass < 2; ++pass) {
    FaceOffer<T> offer = no_offer(T(1e15));
    if (face >= 0) {
      offer = offer_of(body, face, xyz(start), xyz(x), t0, t1, pass == 0);
    }
    FaceChoice<T> choice;
    const T first = least_in_warp(offer.time);
    choice.first = offer_in_warp(offer, first <= T(1) && offer.time == first, rule.reach);
    const T least = least_in_warp(min_of(offer.squared_distance, rule.reach * rule.reach));
    const bool near = offer.face >= 0 && offer.squared_distance <= as_near(least);
    const T side = near ? fabs(offer.side) : T(-1);
    const T most = -least_in_warp(-side);
    choice.nearest = offer_in_warp(offer, near && side == most, rule.reach);
    if (pass == 0) {
      if (!touch_choice(x, start, held, body, t0, t1, rule, choice)) {
        return false;
      }
    } else {
      touch_again(x, start, held, body, t0, t1, rule, choice.nearest);
    }
  }
  return true;
}

template <class T>
__device__ inline BodySearch search_of(const CudaFrame<T>& frame, int i, const Vec4<T>& xi, T t1) {
  return body_search(frame.outlook[i], xyz(xi), xyz(frame.frame_start[i]),
                     frame.frame_time * xyz(frame.frame_velocity[i]), t1);
}

/// Body contacts of the particles on chip at the end of an iteration of substep `s`: each thread
/// finds out whether its particle may touch, then every warp works on one particle at a time.
/// Not inlined: the sweeps around it then keep their registers.
template <class T>
__device__ __noinline__ void touch_body(const CudaFrame<T>& frame, int blocks,
                                        unsigned char* memory, int vertex_begin, int vertex_end,
                                        int s) {
  if (frame.body.face_count == 0) {
    return;
  }
  const BlockWork<T> work(frame, blocks, memory);
  Vec4<T>* const x = work.x;
  Vec4<T>* const start = work.start;
  int* const touching = work.touching;
  int* const touching_count = work.touching_count;
  const int tid = static_cast<int>(threadIdx.x);
  const int threads = static_cast<int>(blockDim.x);
  const int count = vertex_end - vertex_begin;
  const int first = work.offset + vertex_begin;
  if (tid == 0) {
    touching_count[0] = 0;  // by candidates, from the front of the list
    touching_count[1] = 0;  // by the tree, from its back
  }
  __syncthreads();
  BodyContactRule<T> contact_rule = frame.body_rule;
  contact_rule.friction = work.rule.friction;
  const T t0 = static_cast<T>(s) / static_cast<T>(frame.substeps);
  const T t1 = static_cast<T>(s + 1) / static_cast<T>(frame.substeps);
  for (int v = tid; v < count; v += threads) {
    // Who touched before the pairs and was not pushed since touches as before.
    if (frame.self.sums != nullptr && frame.self.moved[first + v] == 0) {
      continue;
    }
    frame.touched[first + v] = 0;
    if (!(x[v].w > T(0))) {
      continue;
    }
    const BodySearch search = search_of(frame, first + v, x[v], t1);
    // In any order: particles do not see each other here.
    if (search == BodySearch::Candidates) {
      touching[atomicAdd(touching_count, 1)] = v;
    } else if (search != BodySearch::Nothing) {
      touching[frame.max_patch_particles - 1 - atomicAdd(touching_count + 1, 1)] = v;
    }
  }
  __syncthreads();
  const int lane = tid % 32;
  const auto held_of = [&](int i) { return frame.held != nullptr ? frame.held[i] : Vec4<T>{}; };
  const auto keep = [&](int v, const Vec4<T>& xi, const Vec4<T>& si, const Vec4<T>& held,
                        bool touched) {
    x[v] = xi;
    start[v] = si;
    if (frame.held != nullptr) {
      frame.held[first + v] = held;
    }
    frame.touched[first + v] = touched ? 1 : 0;
  };
  const int by_candidates = touching_count[0];
  const int by_tree = touching_count[1];
  for (int k = tid; k < by_tree; k += threads) {
    const int v = touching[frame.max_patch_particles - 1 - k];
    Vec4<T> xi = x[v];
    Vec4<T> si = start[v];
    Vec4<T> held = held_of(first + v);
    const bool touched =
        contact_by_tree(xi, si, held, frame.body, t0, t1, contact_rule, frame.outlook[first + v],
                        search_of(frame, first + v, xi, t1));
    keep(v, xi, si, held, touched);
  }
  __syncwarp();
  for (int k = tid / 32; k < by_candidates; k += threads / 32) {
    const int v = touching[k];
    const int i = first + v;
    Vec4<T> xi = x[v];
    Vec4<T> si = start[v];
    Vec4<T> held = held_of(i);
    const int face = lane < frame.outlook[i].count
                         ? frame.candidates[static_cast<std::int64_t>(i) * kBodyCandidates + lane]
                         : -1;
    const bool touched = contact_by_warp(xi, si, held, frame.body, t0, t1, contact_rule, face);
    __syncwarp();
    if (lane == 0) {
      keep(v, xi, si, held, touched);
    }
  }
  __syncthreads();
}

}  // namespace atelier
