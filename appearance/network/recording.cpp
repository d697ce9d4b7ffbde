#include "appearance/network/recording.h"

#include <torch/torch.h>
#if ATELIER_TORCH_CUDA
#include <ATen/cuda/CUDAGraph.h>
#include <c10/cuda/CUDACachingAllocator.h>
#include <c10/cuda/CUDAGuard.h>
#include <c10/cuda/CUDAStream.h>
#endif

#include "core/error.h"

namespace atelier {

#if ATELIER_TORCH_CUDA

struct Recording::State {
  at::cuda::CUDAGraph graph;
};

bool Recording::possible() {
  return torch::cuda::is_available();
}

void Recording::record(const std::function<void()>& warm_up, const std::function<void()>& work) {
  state_.reset();
  auto state = std::make_unique<State>();
  torch::cuda::synchronize();
  {
    // The default stream cannot be recorded.
    const c10::cuda::CUDAStreamGuard stream(c10::cuda::getStreamFromPool());
    constexpr int kTimes = 3;
    for (int i = 0; i < kTimes; ++i) {
      warm_up();
    }
    torch::cuda::synchronize();
    c10::cuda::CUDACachingAllocator::emptyCache();
    state->graph.capture_begin();
    work();
    state->graph.capture_end();
  }
  torch::cuda::synchronize();
  state_ = std::move(state);
}

void Recording::repeat() {
  ATELIER_CHECK(state_, "nothing was recorded");
  state_->graph.replay();
}

#else

struct Recording::State {};

bool Recording::possible() {
  return false;
}

void Recording::record(const std::function<void()>&, const std::function<void()>&) {
  throw LogicError("this libtorch has no CUDA half to record with");
}

void Recording::repeat() {
  throw LogicError("nothing was recorded");
}

#endif

Recording::Recording() = default;
Recording::~Recording() = default;
Recording::Recording(Recording&&) noexcept = default;
Recording& Recording::operator=(Recording&&) noexcept = default;

bool Recording::empty() const {
  return state_ == nullptr;
}

}  // namespace atelier
