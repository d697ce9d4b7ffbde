#pragma once

#include "simulation/xpbd/cuda_barrier.cuh"
#include "simulation/xpbd/cuda_scene.cuh"

namespace atelier {

constexpr int kFrameThreads = 512;
constexpr int kFewThreads = 256;

/// Phases of a schedule at most where its plans stay on chip.
constexpr int kMostResidentPhases = 16;

/// Features of a frame: undamped springs and hinges alone, all but contact of the cloth with
/// itself, or all; fewer registers where there is less. Of a cloth with few particles, which has a
/// whole device: blocks with half of the threads and all the registers that these take.
enum class FrameKind { Plain, Full, Self, FullOfFew, SelfOfFew };
constexpr bool has_self(FrameKind kind) {
  return kind == FrameKind::Self || kind == FrameKind::SelfOfFew;
}
constexpr bool has_few(FrameKind kind) {
  return kind == FrameKind::FullOfFew || kind == FrameKind::SelfOfFew;
}
/// Threads of a block at most.
constexpr int frame_threads(FrameKind kind) {
  return has_few(kind) ? kFewThreads : kFrameThreads;
}

/// One frame of every scene: a persistent launch of `blocks` blocks per scene, `kernel(frame,
/// blocks)`. Each kind and precision is compiled in a file of its own (cuda_frame_*.cu).
template <class T>
using FrameKernel = void (*)(CudaFrame<T> frame, int blocks);
template <class T, FrameKind kKind, CudaBarrier kBarrier>
FrameKernel<T> frame_kernel_of();

/// One step per launch: for a CUDA graph, where the graph's edges are the barriers, and
/// for sweeps of another kind. Not with contact of the cloth with itself, whose passes are counted
/// on the device.
enum class FrameStep { Begin, Phase, PushFeatures, TakeFeatures, Hold, Touch, Finish };
template <class T>
using FrameStepKernel = void (*)(CudaFrame<T> frame, int blocks, FrameStep step, int s,
                                 int iteration, int p);
template <class T>
FrameStepKernel<T> frame_step_kernel_of();

}  // namespace atelier
