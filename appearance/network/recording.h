#pragma once

#include <functional>
#include <memory>

namespace atelier {

/// A CUDA graph: work on a GPU that is recorded once and repeated by one launch, where launching
/// its thousand small kernels one by one takes longer than running them. Repeated work reads and
/// writes the memory that it was recorded on, and allocates none.
class Recording {
 public:
  Recording();
  ~Recording();
  Recording(Recording&&) noexcept;
  Recording& operator=(Recording&&) noexcept;

  /// Whether libtorch has a GPU that supports recording.
  static bool possible();

  bool empty() const;
  /// Runs `warm_up`, since libtorch and cuDNN choose algorithms and allocate memory at their first
  /// calls, and then records `work` without running it.
  void record(const std::function<void()>& warm_up, const std::function<void()>& work);
  /// Launches the recorded work, in order with other work of the device. Does not wait.
  void repeat();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace atelier
