#pragma once

#include "simulation/xpbd/cuda_contacts.cuh"
#include "simulation/xpbd/cuda_response_sums.cuh"

namespace atelier {

/// Number of a pass of features in the frame, from 1.
template <class T>
__device__ inline int feature_pass(const CudaFrame<T>& frame, int s, int iteration, int pass) {
  return (s * frame.iterations + iteration) * kFeaturePasses + pass + 1;
}

/// True for a pass that has something to do: the first, or one after a pass that pressed.
template <class T>
__device__ inline bool features_push(const CudaFrame<T>& frame, int blocks, int s, int iteration,
                                     int pass) {
  const int scene = static_cast<int>(blockIdx.x) / blocks;
  return frame.features.face_count > 0 && *frame.features.any != 0 &&
         (pass == 0 ||
          __ldcg(frame.features.pressed + scene) == feature_pass(frame, s, iteration, pass - 1));
}

/// One pass of pushes: a warp for each triangle of the cloth that may meet a feature, as there is
/// much to look at: its threads see which faces of the body may push, and then ask the body for
/// each of these together. A thread for each triangle that left its flight, where mostly nothing
/// is. `room`: of this thread's warp.
template <class T>
__device__ __noinline__ void push_features(const CudaFrame<T>& frame, int blocks, int s,
                                           int iteration, int pass, TeamRoom<32>& room) {
  namespace cg = cooperative_groups;
  const CudaFeatureFrame<T>& f = frame.features;
  const int scene = static_cast<int>(blockIdx.x) / blocks;
  const int offset = scene * frame.count;
  const T t0 = static_cast<T>(s) / static_cast<T>(frame.substeps);
  const T t1 = static_cast<T>(s + 1) / static_cast<T>(frame.substeps);
  FeatureStep<T> step{frame.body, f.features, f.cloth, f.rule, t0, t1};
  step.rule.push.friction = frame.rules[scene].friction;
  if (pass > 0) {  // old overlaps are worked at once a substep
    step.rule.push.old_overlap = T(0);
  }
  const auto load = [&](int i) { return load_shared_cache(frame.x + offset + i); };
  const auto load_start = [&](int i) { return load_shared_cache(frame.start + offset + i); };
  const auto motion = motion_of(load, load_start);
  const PushedFaces<T> faces{f.edge_of, f.length};
  const auto add = [&](int i, Vec3<T> fresh, Vec3<T> calm, int level) {
    add_response(f.sums + offset + i, fresh, calm, level);
  };
  const auto left = [&](int k) {
    const int i = offset + k;
    return left_outlook(xyz(load(k)), xyz(frame.frame_start[i]),
                        frame.frame_time * xyz(frame.frame_velocity[i]), frame.outlook[i].slack,
                        t1);
  };
  const int threads = blocks * static_cast<int>(blockDim.x);
  for (int k = scene_thread(blocks); k < frame.count && pass == 0; k += threads) {
    __stcg(f.pushed + offset + k, 0);
  }
  BodyView<T> sharp = frame.body;
  sharp.nodes = f.features.nodes;
  bool presses = false;
  const auto push = [&](int face, int body_face, const auto& to, const auto& team) {
    const PairState state = push_off_face(step, faces, face, body_face, motion, to, team);
    presses = presses || state == PairState::Presses;
  };
  const auto visit = [&](int face, const auto& team, const auto& work) {
    const FaceIndices v = f.cloth.surface.faces[face];
    const Box<T> box = united(box_at(v, load), box_at(v, load_start));
    team.visit(sharp, inflated(box, step.rule.within), work);
  };
  const std::int64_t before = static_cast<std::int64_t>(scene) * f.face_count;
  const int* const near = f.near + before;
  const cg::thread_block_tile<32> tile = cg::tiled_partition<32>(cg::this_thread_block());
  const TeamInBody<32, false> warp{tile, room};
  const TeamInBody<32, true> team{tile, room};
  const auto by_first = [&](int i, Vec3<T> fresh, Vec3<T> calm, int level) {
    if (team.rank() == 0) {
      add(i, fresh, calm, level);
    }
  };
  for (int k = scene_thread(blocks) / 32; k < f.near_count[scene]; k += threads / 32) {
    const int face = f.near_faces[before + k];
    int found = 0;
    visit(face, warp, [&](int body_face) {
      const auto none = [](int, Vec3<T>, Vec3<T>, int) {};
      if (push_off_face(step, faces, face, body_face, motion, none, ReachesUnasked{}) ==
          PairState::Apart) {
        return;
      }
      const int at = warp.place(found);
      if (at < TeamRoom<32>::kFound) {
        room.found[at] = body_face;
      } else {
        push(face, body_face, add, AloneInTree{});
      }
    });
    found = min(warp.length(found), TeamRoom<32>::kFound);
    for (int n = 0; n < found; ++n) {
      push(face, room.found[n], by_first, team);
    }
    tile.sync();
  }
  for (int face = scene_thread(blocks); face < f.face_count; face += threads) {
    const FaceIndices v = f.cloth.surface.faces[face];
    if (near[face] == 0 && (left(v.a) || left(v.b) || left(v.c))) {
      visit(face, AloneInTree{}, [&](int body_face) { push(face, body_face, add, AloneInTree{}); });
    }
  }
  if (presses) {
    atomicMax(f.pressed + scene, feature_pass(frame, s, iteration, pass));
  }
}

/// Gives every particle what features want of it.
template <class T>
__device__ __noinline__ void take_features(const CudaFrame<T>& frame, int blocks) {
  const int offset = static_cast<int>(blockIdx.x) / blocks * frame.count;
  for (int k = scene_thread(blocks); k < frame.count; k += blocks * static_cast<int>(blockDim.x)) {
    const int i = offset + k;
    ResponseSum* const sum = frame.features.sums + i;
    if (__ldcg(&sum->used) == 0) {
      continue;
    }
    SelfParticle<T> p{load_shared_cache(frame.x + i), load_shared_cache(frame.start + i), {}};
    take_response(load_sum(sum), p.start, p);
    store_shared_cache(frame.x + i, p.x);
    store_shared_cache(frame.start + i, p.start);
    __stcg(frame.features.pushed + i, 1);
    clear_sum(sum, 0);
  }
}

/// All passes of features after a sweep; `wait` for the scene's other blocks.
template <class T, class Wait>
__device__ inline void push_off_features(const CudaFrame<T>& frame, int blocks, int s,
                                         int iteration, TeamRoom<32>& room, const Wait& wait) {
  for (int pass = 0; pass < kFeaturePasses && features_push(frame, blocks, s, iteration, pass);
       ++pass) {
    push_features(frame, blocks, s, iteration, pass, room);
    wait();
    take_features(frame, blocks);
    // Who is late reads `pressed` of this pass: the next one raises it after this barrier alone.
    wait();
  }
}

}  // namespace atelier
