#pragma once

#include <climits>

#include <cooperative_groups.h>

#include "simulation/cuda_scene.cuh"

namespace atelier {

constexpr int kFrameThreads = 512;

/// Positions that other blocks write: read from the cache that all of them share.
__device__ inline Vec4<float> load_shared_cache(const Vec4<float>* p) {
  const float4 v = __ldcg(reinterpret_cast<const float4*>(p));
  return {v.x, v.y, v.z, v.w};
}
__device__ inline Vec4<double> load_shared_cache(const Vec4<double>* p) {
  const double2 a = __ldcg(reinterpret_cast<const double2*>(p));
  const double2 b = __ldcg(reinterpret_cast<const double2*>(p) + 1);
  return {a.x, a.y, b.x, b.y};
}
__device__ inline void store_shared_cache(Vec4<float>* p, const Vec4<float>& v) {
  __stcg(reinterpret_cast<float4*>(p), make_float4(v.x, v.y, v.z, v.w));
}
__device__ inline void store_shared_cache(Vec4<double>* p, const Vec4<double>& v) {
  __stcg(reinterpret_cast<double2*>(p), make_double2(v.x, v.y));
  __stcg(reinterpret_cast<double2*>(p) + 1, make_double2(v.z, v.w));
}

/// Waits until every block of the scene has come here; what they wrote before is visible after.
template <CudaBarrier kBarrier>
__device__ inline void scene_barrier(unsigned* arrived, unsigned& goal, unsigned blocks) {
  if constexpr (kBarrier == CudaBarrier::Block) {
    __syncthreads();
  } else if constexpr (kBarrier == CudaBarrier::Cluster) {
#if __CUDA_ARCH__ >= 900
    cooperative_groups::this_cluster().sync();
#endif
  } else {
    __syncthreads();
    goal += blocks;
    if (threadIdx.x == 0) {
      __threadfence();
      atomicAdd(arrived, 1u);
      unsigned seen = 0;
      do {
        asm volatile("ld.acquire.gpu.global.u32 %0, [%1];" : "=r"(seen) : "l"(arrived) : "memory");
      } while (seen < goal);
    }
    __syncthreads();
  }
}

/// Constraints of a patch, colour after colour. `records` are on chip; record i of the schedule is
/// at place i - first.
template <class T>
__device__ inline void sweep_patch(const CudaFrame<T>& frame, int colour_count,
                                   const PreparedColour* colours,
                                   const ConstraintRecord<T>* records, int first, Vec4<T>* x,
                                   const Vec4<T>* start, T* lambda, T* strain_lambda,
                                   const SubstepScale<T>& scale, bool first_iteration) {
  const int tid = static_cast<int>(threadIdx.x);
  for (int k = 0; k < colour_count; ++k) {
    const PreparedColour colour = colours[k];
    for (int i = colour.begin[0] + tid; i < colour.begin[3]; i += static_cast<int>(blockDim.x)) {
      const ConstraintRecord<T> record = records[i - first];
      if (i < colour.begin[2]) {
        const T before = first_iteration ? T(0) : lambda[i];
        const T change = i < colour.begin[1]
                             ? project_hinge_record(record, x, start, before, scale)
                             : project_spring_record(record, x, start, before, scale);
        if (lambda != nullptr) {
          lambda[i] = before + change;
        }
      } else {
        const int s = colour.strain_begin + i - colour.begin[2];
        T values[3] = {T(0), T(0), T(0)};
        if (!first_iteration) {
          for (int c = 0; c < 3; ++c) {
            values[c] = strain_lambda[3 * s + c];
          }
        }
        project_strain_record(record, frame.strains[s], x, start, values, scale);
        if (strain_lambda != nullptr) {
          for (int c = 0; c < 3; ++c) {
            strain_lambda[3 * s + c] = values[c];
          }
        }
      }
    }
    __syncthreads();
  }
}

/// What a block has to know of one patch, laid out on chip: header, records, colours, particles.
struct PlanHeader {
  int vertex_begin, vertex_count, colour_count, first_record;
  int record_count, bytes, unused0, unused1;
};
template <class T>
int plan_size(int vertices, int colours, int records) {
  const std::size_t bytes = sizeof(PlanHeader) + records * sizeof(ConstraintRecord<T>) +
                            colours * sizeof(PreparedColour) + vertices * sizeof(int);
  return static_cast<int>((bytes + 31) / 32 * 32);
}
template <class T>
struct Plan {
  PlanHeader* header;
  ConstraintRecord<T>* records;
  PreparedColour* colours;
  int* particles;

  __device__ Plan(unsigned char* at, int colour_count, int record_count)
      : header(reinterpret_cast<PlanHeader*>(at)),
        records(reinterpret_cast<ConstraintRecord<T>*>(at + sizeof(PlanHeader))),
        colours(reinterpret_cast<PreparedColour*>(records + record_count)),
        particles(reinterpret_cast<int*>(colours + colour_count)) {}
  __device__ explicit Plan(unsigned char* at)
      : Plan(at, reinterpret_cast<PlanHeader*>(at)->colour_count,
             reinterpret_cast<PlanHeader*>(at)->record_count) {}
};

/// Brings the plan of a patch on chip: all threads of the block, who wait for each other
/// afterwards.
template <class T>
__device__ inline void load_plan(const CudaFrame<T>& frame, const Schedule::Patch& patch,
                                 unsigned char* at) {
  const int tid = static_cast<int>(threadIdx.x);
  const int threads = static_cast<int>(blockDim.x);
  const int colour_count = patch.colour_end - patch.colour_begin;
  const int vertex_count = patch.vertex_end - patch.vertex_begin;
  const int first = colour_count > 0 ? frame.colours[patch.colour_begin].begin[0] : 0;
  const int last = colour_count > 0 ? frame.colours[patch.colour_end - 1].begin[3] : 0;
  const Plan<T> plan(at, colour_count, last - first);
  if (tid == 0) {
    const int bytes =
        static_cast<int>(reinterpret_cast<unsigned char*>(plan.particles + vertex_count) - at);
    *plan.header = {patch.vertex_begin,
                    vertex_count,
                    colour_count,
                    first,
                    last - first,
                    (bytes + 31) / 32 * 32,
                    0,
                    0};
  }
  constexpr int kWords = static_cast<int>(sizeof(ConstraintRecord<T>) / sizeof(uint4));
  const uint4* const from = reinterpret_cast<const uint4*>(frame.records + first);
  uint4* const to = reinterpret_cast<uint4*>(plan.records);
#pragma unroll 8
  for (int i = tid; i < (last - first) * kWords; i += threads) {
    to[i] = __ldg(from + i);
  }
  for (int i = tid; i < colour_count; i += threads) {
    plan.colours[i] = frame.colours[patch.colour_begin + i];
  }
  for (int i = tid; i < vertex_count; i += threads) {
    plan.particles[i] = frame.patch_particles[patch.vertex_begin + i];
  }
  __syncthreads();
}

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

/// What one block works with: its scene, its share of the patches, its on-chip memory.
template <class T>
struct BlockWork {
  const CudaFrame<T>& frame;
  CudaSceneRule<T> rule;
  SubstepScale<T> scale;
  int scene, block, blocks, offset;
  T* lambda;
  T* strain_lambda;
  Vec4<T>* x;
  Vec4<T>* start;
  unsigned char* plan_room;
  int* touching;  ///< places in the patch of particles that may touch the body
  int* touching_count;

  __device__ BlockWork(const CudaFrame<T>& f, int blocks_per_scene, unsigned char* memory)
      : frame(f),
        scene(static_cast<int>(blockIdx.x) / blocks_per_scene),
        block(static_cast<int>(blockIdx.x) % blocks_per_scene),
        blocks(blocks_per_scene) {
    offset = scene * f.count;
    rule = f.rules[scene];
    scale = {T(1) / (f.h * f.h), f.gamma, rule.spring_softness, rule.hinge_softness};
    const std::int64_t first = scene;
    lambda = f.lambda != nullptr ? f.lambda + first * f.record_count : nullptr;
    strain_lambda =
        f.strain_lambda != nullptr ? f.strain_lambda + first * 3 * f.strain_count : nullptr;
    x = reinterpret_cast<Vec4<T>*>(memory);
    start = x + f.max_patch_particles;
    touching = reinterpret_cast<int*>(start + f.max_patch_particles);
    touching_count = touching + f.max_patch_particles;
    plan_room = reinterpret_cast<unsigned char*>(start + f.max_patch_particles) +
                (sizeof(int) * static_cast<std::size_t>(f.max_patch_particles + 2) + 31) / 32 * 32;
  }

  /// Position of particle `i` after the mean push of the cloth's contacts with itself.
  __device__ Vec4<T> pushed(int i, const Vec4<T>& xi) const {
    if (frame.sums == nullptr) {
      return xi;
    }
    int4* const sum = reinterpret_cast<int4*>(frame.sums + i);
    const int4 v = __ldcg(sum);
    if (v.w == 0) {
      return xi;
    }
    __stcg(sum, make_int4(0, 0, 0, 0));
    return with_w(xyz(xi) + mean_push<T>(PushSum{v.x, v.y, v.z, v.w}), xi.w);
  }

  /// Contacts of the cloth with itself: every pair adds what it wants of its particles.
  __device__ void push_pairs(bool last) const {
    SelfView<T> cloth = frame.self;
    cloth.surface.start += offset;
    cloth.surface.end += offset;
    cloth.tangled += offset;
    const int* const touched = frame.body.face_count > 0 ? frame.touched + offset : nullptr;
    const auto load = [&](int i) {
      return supported(load_shared_cache(frame.x + offset + i),
                       touched != nullptr && __ldcg(touched + i) != 0);
    };
    const auto load_start = [&](int i) { return load_shared_cache(frame.start + offset + i); };
    const auto add = [&](int i, Vec3<T> push) {
      PushSum* const sum = frame.sums + offset + i;
      atomicAdd(&sum->x, to_units(push.x));
      atomicAdd(&sum->y, to_units(push.y));
      atomicAdd(&sum->z, to_units(push.z));
      atomicAdd(&sum->count, 1);
    };
    const int edges = cloth.edge_count;
    const std::int64_t first_edge = static_cast<std::int64_t>(scene) * edges;
    int active = 0;
    for (int k = block * static_cast<int>(blockDim.x) + static_cast<int>(threadIdx.x);
         k < frame.count + edges; k += blocks * static_cast<int>(blockDim.x)) {
      if (k < frame.count) {
        const std::int64_t at = offset + static_cast<std::int64_t>(k);
        const int count = frame.face_pair_count[at];
        for (int c = 0; c < count; ++c) {
          active += push_vertex_face(cloth, k, frame.face_pairs[at * kSelfCandidates + c],
                                     frame.self_rule, load, load_start, add);
        }
      } else {
        const int e = k - frame.count;
        const std::int64_t at = first_edge + e;
        const int2 count = frame.edge_pair_count[at];
        for (int c = 0; c < count.x; ++c) {
          active += push_edge_edge(cloth, e, frame.edge_pairs[at * kSelfCandidates + c],
                                   frame.self_rule, load, load_start, add);
        }
        for (int c = 0; c < count.y; ++c) {
          active += pull_out(cloth, e, frame.crossings[at * kSelfCrossings + c], frame.self_rule,
                             load, add);
        }
      }
    }
    if (last && active > 0) {
      atomicAdd(frame.self_counts + 4 * scene, active);
    }
  }

  /// Patches of phase 0 that this block owns: loads their particles on chip, calls `work(patch)`.
  template <class Work>
  __device__ void owned_patches(const Work& work) const {
    const Schedule::Phase range = frame.phases[0];
    for (int k = range.patch_begin + block; k < range.patch_end; k += blocks) {
      const Schedule::Patch patch = frame.patches[k];
      for (int v = patch.vertex_begin + static_cast<int>(threadIdx.x); v < patch.vertex_end;
           v += static_cast<int>(blockDim.x)) {
        x[v - patch.vertex_begin] = pushed(offset + v, load_shared_cache(frame.x + offset + v));
        start[v - patch.vertex_begin] = load_shared_cache(frame.start + offset + v);
      }
      work(patch);
      __syncthreads();
    }
  }

  /// Body contacts of the particles on chip at the end of an iteration of substep `s`: each thread
  /// finds out whether its particle may touch, then every warp works on one particle at a time.
  __device__ void contacts(const Schedule::Patch& patch, int s) const {
    if (frame.body.face_count == 0) {
      return;
    }
    const int tid = static_cast<int>(threadIdx.x);
    const int threads = static_cast<int>(blockDim.x);
    const int count = patch.vertex_end - patch.vertex_begin;
    const int first = offset + patch.vertex_begin;
    if (tid == 0) {
      touching_count[0] = 0;  // by candidates, from the front of the list
      touching_count[1] = 0;  // by the tree, from its back
    }
    __syncthreads();
    BodyContactRule<T> contact_rule = frame.body_rule;
    contact_rule.friction = rule.friction;
    const T t0 = static_cast<T>(s) / static_cast<T>(frame.substeps);
    const T t1 = static_cast<T>(s + 1) / static_cast<T>(frame.substeps);
    for (int v = tid; v < count; v += threads) {
      frame.touched[first + v] = 0;
      if (!(x[v].w > T(0))) {
        continue;
      }
      const BodySearch search = search_of(first + v, x[v], t1);
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
      const bool deep = search_of(first + v, xi, t1) == BodySearch::DeepTree;
      const bool touched = contact_by_tree(xi, si, held, frame.body, t0, t1, contact_rule, deep);
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

  __device__ BodySearch search_of(int i, const Vec4<T>& xi, T t1) const {
    return body_search(frame.outlook[i], xyz(xi), xyz(frame.frame_start[i]),
                       frame.frame_time * xyz(frame.frame_velocity[i]), t1);
  }

  /// Velocity of the particle at place `v` after substep `s`.
  __device__ Vec3<T> finished_velocity(int i, int v) const {
    Vec3<T> vi = xyz(frame.velocity[i]);
    update_velocity(x[v], start[v], vi, frame.h, frame.keep);
    if (!(isfinite(x[v].x) && isfinite(x[v].y) && isfinite(x[v].z))) {
      atomicMin(frame.bad, i);
    }
    return vi;
  }

  /// Ends the last substep (if there was one) and begins substep `s` for the particles on chip.
  __device__ void begin(const Schedule::Patch& patch, int s) const {
    const T share = T(1) / static_cast<T>(frame.substeps - s);
    const int count = patch.vertex_end - patch.vertex_begin;
    for (int v = static_cast<int>(threadIdx.x); v < count; v += static_cast<int>(blockDim.x)) {
      const int i = offset + patch.vertex_begin + v;
      Vec3<T> vi = s > frame.first_substep ? finished_velocity(i, v) : xyz(frame.velocity[i]);
      Vec3<T> acceleration = frame.gravity;
      if (frame.air != nullptr) {
        acceleration += xyz(frame.air[i]);
      }
      Vec4<T> xi = x[v];
      Vec4<T> si = xi;
      const Vec3<T> target = xi.w > T(0) ? Vec3<T>{} : xyz(frame.target[i]);
      predict(xi, si, vi, acceleration, target, share, frame.h);
      x[v] = xi;
      start[v] = si;
      store_shared_cache(frame.start + i, si);
      frame.velocity[i] = with_w(vi, T(0));
      if (frame.held != nullptr) {
        frame.held[i] = Vec4<T>{};
      }
    }
  }

  /// Brings everything that the block works on on chip, in the order in which it comes.
  __device__ void load_all_plans() const {
    unsigned char* at = plan_room;
    for (int p = 0; p < frame.phase_count; ++p) {
      const Schedule::Phase range = frame.phases[p];
      for (int k = range.patch_begin + block; k < range.patch_end; k += blocks) {
        load_plan(frame, frame.patches[k], at);
        at += reinterpret_cast<PlanHeader*>(at)->bytes;
      }
    }
  }

  /// One phase of one iteration; `at` walks over the resident plans. In the first phase of the
  /// first iteration the owner also ends the last substep and begins this one.
  __device__ void phase(int s, int iteration, int p, unsigned char*& at) const {
    const int tid = static_cast<int>(threadIdx.x);
    const int threads = static_cast<int>(blockDim.x);
    const bool damped = frame.gamma > T(0);
    const bool begins = p == 0 && iteration == 0;
    const bool ends = begins && s > frame.first_substep;
    const Schedule::Phase range = frame.phases[p];
    for (int k = range.patch_begin + block; k < range.patch_end; k += blocks) {
      if (frame.resident == 0) {
        at = plan_room;
        load_plan(frame, frame.patches[k], at);
      }
      const Plan<T> plan(at);
      const PlanHeader header = *plan.header;
      for (int v = tid; v < header.vertex_count; v += threads) {
        const int i = offset + plan.particles[v];
        const Vec4<T> xi = load_shared_cache(frame.x + i);
        x[v] = ends ? pushed(i, xi) : xi;
        if (ends || (damped && !begins)) {  // a frame begins without a start
          start[v] = load_shared_cache(frame.start + i);
        }
      }
      if (begins) {
        const Schedule::Patch patch{header.vertex_begin, header.vertex_begin + header.vertex_count,
                                    0, 0};
        if (ends) {
          contacts(patch, s - 1);
        }
        begin(patch, s);
      }
      __syncthreads();
      sweep_patch(frame, header.colour_count, plan.colours, plan.records, header.first_record, x,
                  start, lambda, strain_lambda, scale, iteration == 0);
      for (int v = tid; v < header.vertex_count; v += threads) {
        store_shared_cache(frame.x + offset + plan.particles[v], x[v]);
      }
      __syncthreads();
      at += header.bytes;
    }
  }

  /// Tethers; anchors are fixed, so nobody moves them here.
  __device__ void tethers() const {
    owned_patches([&](const Schedule::Patch& patch) {
      for (int v = patch.vertex_begin + static_cast<int>(threadIdx.x); v < patch.vertex_end;
           v += static_cast<int>(blockDim.x)) {
        const int anchor = frame.tether_anchor[v];
        if (anchor >= 0) {
          Vec4<T> xi = x[v - patch.vertex_begin];
          project_tether(xi, xyz(load_shared_cache(frame.x + offset + anchor)),
                         frame.tether_length[v]);
          store_shared_cache(frame.x + offset + v, xi);
        }
      }
    });
  }

  /// Body contact between iterations; after the last one it is part of begin and finish.
  __device__ void touch(int s) const {
    owned_patches([&](const Schedule::Patch& patch) {
      contacts(patch, s);
      const int count = patch.vertex_end - patch.vertex_begin;
      for (int v = static_cast<int>(threadIdx.x); v < count; v += static_cast<int>(blockDim.x)) {
        store_shared_cache(frame.x + offset + patch.vertex_begin + v, x[v]);
        store_shared_cache(frame.start + offset + patch.vertex_begin + v, start[v]);
      }
    });
  }

  __device__ void finish() const {
    owned_patches([&](const Schedule::Patch& patch) {
      contacts(patch, frame.last_substep - 1);
      const int count = patch.vertex_end - patch.vertex_begin;
      for (int v = static_cast<int>(threadIdx.x); v < count; v += static_cast<int>(blockDim.x)) {
        const int i = offset + patch.vertex_begin + v;
        const Vec3<T> vi = finished_velocity(i, v);
        frame.x[i] = x[v];
        frame.velocity[i] = with_w(vi, T(0));
      }
    });
  }
};

/// One frame of every scene: a persistent launch of `blocks` blocks per scene.
template <class T, CudaBarrier kBarrier>
__global__ void __launch_bounds__(kFrameThreads, 1)
    frame_kernel(const __grid_constant__ CudaFrame<T> frame, int blocks) {
  extern __shared__ __align__(32) unsigned char memory[];
  const BlockWork<T> work(frame, blocks, memory);
  unsigned goal = 0;
  const auto wait = [&] {
    scene_barrier<kBarrier>(frame.arrived + work.scene, goal, static_cast<unsigned>(blocks));
  };
  if (frame.resident != 0) {
    work.load_all_plans();
  }
  for (int s = frame.first_substep; s < frame.last_substep; ++s) {
    for (int iteration = 0; iteration < frame.iterations; ++iteration) {
      unsigned char* at = work.plan_room;
      for (int p = 0; p < frame.phase_count; ++p) {
        work.phase(s, iteration, p, at);
        wait();
      }
      if (frame.tether_anchor != nullptr) {
        work.tethers();
        wait();
      }
      if (frame.sums != nullptr) {
        if (frame.body.face_count > 0) {
          work.touch(s);  // what lies on the body has to be known before cloth pushes cloth
          wait();
        }
        work.push_pairs(s + 1 == frame.substeps && iteration + 1 == frame.iterations);
        wait();
      }
      if (iteration + 1 < frame.iterations &&
          (frame.body.face_count > 0 || frame.sums != nullptr)) {
        work.touch(s);
        wait();
      }
    }
  }
  work.finish();
}

/// The same, one step per launch: for a CUDA graph, where the graph's edges are the barriers.
enum class FrameStep { Phase, Tethers, Pairs, Touch, Finish };

template <class T>
__global__ void __launch_bounds__(kFrameThreads, 1)
    frame_step_kernel(const __grid_constant__ CudaFrame<T> frame, int blocks, FrameStep step, int s,
                      int iteration, int p) {
  extern __shared__ __align__(32) unsigned char memory[];
  const BlockWork<T> work(frame, blocks, memory);
  switch (step) {
    case FrameStep::Phase: {
      unsigned char* at = work.plan_room;
      work.phase(s, iteration, p, at);
      break;
    }
    case FrameStep::Tethers:
      work.tethers();
      break;
    case FrameStep::Pairs:
      work.push_pairs(s + 1 == frame.substeps && iteration + 1 == frame.iterations);
      break;
    case FrameStep::Touch:
      work.touch(s);
      break;
    case FrameStep::Finish:
      work.finish();
      break;
  }
}

}  // namespace atelier
