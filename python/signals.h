#pragma once

#include <chrono>
#include <functional>

#include <pybind11/pybind11.h>

#include "core/loop_check.h"

namespace atelier::python {

/// Asks Python now and then whether a signal came (Ctrl-C), from a thread that does not hold the
/// interpreter's lock.
class SignalWatch {
 public:
  /// Throws what the handler of a signal raised, such as KeyboardInterrupt. Twenty times a second
  /// at most it takes the lock; else it costs a look at the clock.
  void check() {
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < std::chrono::milliseconds(50)) {
      return;
    }
    last_ = now;
    const pybind11::gil_scoped_acquire lock;
    if (PyErr_CheckSignals() != 0) {
      throw pybind11::error_already_set();
    }
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// Guard of a call that takes long (pybind11::call_guard): other threads of Python run meanwhile,
/// and a signal ends it at the next chunk of a loop.
class LongCall {
 public:
  LongCall() : check_([this] { watch_.check(); }), loops_(check_) {}

 private:
  pybind11::gil_scoped_release released_;
  SignalWatch watch_;
  std::function<void()> check_;
  LoopCheck loops_;
};

}  // namespace atelier::python
