#pragma once

#include "simulation/xpbd/cuda_barrier.cuh"
#include "simulation/xpbd/cuda_scene.cuh"

namespace atelier {

constexpr int kFrameThreads = 512;

/// Features of a frame: undamped springs and hinges alone, all but contact of the cloth with
/// itself, or all. Fewer registers where there is less.
enum class FrameKind { Plain, Full, Self };

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
