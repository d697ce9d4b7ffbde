#pragma once

#include <optional>
#include <utility>

#include "core/cuda_buffer.cuh"
#include "core/vec.h"

namespace atelier {

/// An event of the device's clock.
class FrameClock {
 public:
  FrameClock() { ATELIER_CUDA_CHECK(cudaEventCreate(&event_)); }
  ~FrameClock() { static_cast<void>(cudaEventDestroy(event_)); }
  FrameClock(const FrameClock&) = delete;
  FrameClock& operator=(const FrameClock&) = delete;

  void record() { ATELIER_CUDA_CHECK(cudaEventRecord(event_)); }
  /// ms from `before` to this one; waits until it is over.
  double since(const FrameClock& before) const {
    float ms = 0;
    ATELIER_CUDA_CHECK(cudaEventSynchronize(event_));
    ATELIER_CUDA_CHECK(cudaEventElapsedTime(&ms, before.event_, event_));
    return static_cast<double>(ms);
  }

 private:
  cudaEvent_t event_ = nullptr;
};

/// Launches of a frame. A second frame of the same arguments records them, later ones replay that.
class FrameReplay {
 public:
  /// What may differ between the arguments of two frames.
  struct Key {
    Vec3d gravity;
    bool body, air;
    int room;

    bool operator==(const Key& b) const {
      return gravity.x == b.gravity.x && gravity.y == b.gravity.y && gravity.z == b.gravity.z &&
             body == b.body && air == b.air && room == b.room;
    }
  };

  FrameReplay() { ATELIER_CUDA_CHECK(cudaStreamCreate(&recorder_)); }
  ~FrameReplay() {
    forget();
    static_cast<void>(cudaStreamDestroy(recorder_));
  }
  FrameReplay(const FrameReplay&) = delete;
  FrameReplay& operator=(const FrameReplay&) = delete;

  /// `launch(stream)` launches everything.
  template <class Launch>
  void run(const Key& key, const Launch& launch) {
    if (!key_ || !(*key_ == key)) {
      forget();
      launch(cudaStreamLegacy);
      key_ = key;  // kernels are loaded by now
      return;
    }
    if (graph_ == nullptr) {
      record(launch);
    }
    ATELIER_CUDA_CHECK(cudaGraphLaunch(graph_, cudaStreamLegacy));
  }

 private:
  void forget() {
    if (graph_ != nullptr) {
      static_cast<void>(cudaGraphExecDestroy(std::exchange(graph_, nullptr)));
    }
    key_.reset();
  }

  template <class Launch>
  void record(const Launch& launch) {
    cudaGraph_t graph = nullptr;
    ATELIER_CUDA_CHECK(cudaStreamBeginCapture(recorder_, cudaStreamCaptureModeThreadLocal));
    try {
      launch(recorder_);
    } catch (...) {  // the stream records no longer
      if (cudaStreamEndCapture(recorder_, &graph) == cudaSuccess) {
        static_cast<void>(cudaGraphDestroy(graph));
      }
      static_cast<void>(cudaGetLastError());
      throw;
    }
    ATELIER_CUDA_CHECK(cudaStreamEndCapture(recorder_, &graph));
    const cudaError_t status = cudaGraphInstantiate(&graph_, graph, 0);
    static_cast<void>(cudaGraphDestroy(graph));
    ATELIER_CUDA_CHECK(status);
  }

  std::optional<Key> key_;
  cudaGraphExec_t graph_ = nullptr;
  cudaStream_t recorder_ = nullptr;
};

}  // namespace atelier
