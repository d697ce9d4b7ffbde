#pragma once

#include <functional>
#include <memory>

namespace atelier {

/// Work on a GPU that is recorded once and repeated by one launch (a CUDA graph), where asking
/// for its thousand small kernels one by one takes the processor longer than the GPU needs for
/// them. Repeated work reads and writes the memory that it was recorded on, and asks for none.
class Recording {
 public:
  Recording();
  ~Recording();
  Recording(Recording&&) noexcept;
  Recording& operator=(Recording&&) noexcept;

  /// Whether libtorch has a GPU here that records.
  static bool possible();

  bool empty() const;
  /// Records `work`, which runs `warm_up` before: libtorch and cuDNN choose their ways, and
  /// take memory, at the first calls. Nothing of `work` itself is done.
  void record(const std::function<void()>& warm_up, const std::function<void()>& work);
  /// Does it, in the order of what else the device was asked for. Does not wait.
  void repeat();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace atelier
