#pragma once

#include <functional>

namespace atelier {

/// While it lives, loops that its thread starts (core/parallel.h) call `check` on that thread
/// before a chunk. What it throws ends the loop as an exception of the chunk does: for programs
/// that have to stop wherever they are, such as an interpreter on Ctrl-C. `check` must outlive it.
class LoopCheck {
 public:
  explicit LoopCheck(const std::function<void()>& check);
  ~LoopCheck();
  LoopCheck(const LoopCheck&) = delete;
  LoopCheck& operator=(const LoopCheck&) = delete;

 private:
  const std::function<void()>* outer_;
};

}  // namespace atelier
