#include "core/parallel.h"

#include <algorithm>
#include <exception>
#include <memory>
#include <mutex>
#include <utility>

#include "core/error.h"
#include "core/loop_check.h"

#ifdef ATELIER_HAS_TBB
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#endif
#ifdef ATELIER_TELL_TSAN
#include <sanitizer/tsan_interface.h>
#endif

namespace atelier {
namespace {

// Of a thread: workers of a loop have none.
thread_local const std::function<void()>* loop_check = nullptr;

}  // namespace

LoopCheck::LoopCheck(const std::function<void()>& check)
    : outer_(std::exchange(loop_check, &check)) {}

LoopCheck::~LoopCheck() {
  loop_check = outer_;
}

#ifdef ATELIER_HAS_TBB
namespace {

// The one piece of process-wide state in core: how many threads loops may use. Results do not
// depend on it.
struct ThreadLimit {
  std::mutex mutex;
  std::unique_ptr<tbb::global_control> control;
};

ThreadLimit& thread_limit() {
  static ThreadLimit limit;
  return limit;
}

/// Tells ThreadSanitizer what a loop promises: each chunk comes after what was before the loop, and
/// before what comes after it. oneTBB's library is built without the sanitizer, which therefore
/// does not see how it hands work over, and would find a race wherever a loop reads or writes. For
/// the same reason this file, into which oneTBB's headers are compiled, is not instrumented: the
/// loops' bodies are.
class LoopOrder {
#ifdef ATELIER_TELL_TSAN
 public:
  LoopOrder() {
    __tsan_release(&before_);
  }
  void begin_chunk() {
    __tsan_acquire(&before_);
  }
  void end_chunk() {
    __tsan_release(&after_);
  }
  void end_loop() {
    __tsan_acquire(&after_);
  }

 private:
  char before_ = 0;
  char after_ = 0;
#else
 public:
  void begin_chunk() {}
  void end_chunk() {}
  void end_loop() {}
#endif
};

}  // namespace
#endif

void parallel_for(Index n, Index grain, const std::function<void(Index, Index)>& body) {
  ATELIER_CHECK(grain > 0, "parallel_for needs a positive grain");
  if (n <= 0) {
    return;
  }
  const Index chunks = (n + grain - 1) / grain;
  const auto run = [&](Index chunk) {
    if (loop_check != nullptr) {
      (*loop_check)();
    }
    body(chunk * grain, std::min(n, (chunk + 1) * grain));
  };
#ifdef ATELIER_HAS_TBB
  if (chunks > 1) {
    std::mutex mutex;
    Index failed_chunk = chunks;
    std::exception_ptr failure;
    LoopOrder order;
    tbb::parallel_for(Index{0}, chunks, [&](Index chunk) {
      order.begin_chunk();
      bool needed = true;
      {
        const std::lock_guard<std::mutex> lock(mutex);
        needed = chunk <= failed_chunk;
      }
      try {
        if (needed) {
          run(chunk);
        }
      } catch (...) {  // handed over to the caller: the first by chunk order
        const std::lock_guard<std::mutex> lock(mutex);
        if (chunk < failed_chunk) {
          failed_chunk = chunk;
          failure = std::current_exception();
        }
      }
      order.end_chunk();
    });
    order.end_loop();
    if (failure) {
      std::rethrow_exception(failure);
    }
    return;
  }
#endif
  for (Index chunk = 0; chunk < chunks; ++chunk) {
    run(chunk);
  }
}

void set_thread_count(int count) {
  ATELIER_CHECK(count >= 0, "set_thread_count needs 0 (all) or a positive count");
#ifdef ATELIER_HAS_TBB
  ThreadLimit& limit = thread_limit();
  const std::lock_guard<std::mutex> lock(limit.mutex);
  limit.control.reset();
  if (count > 0) {
    limit.control = std::make_unique<tbb::global_control>(
        tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(count));
  }
#endif
}

int thread_count() {
#ifdef ATELIER_HAS_TBB
  const auto allowed =
      tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  return static_cast<int>(allowed);
#else
  return 1;
#endif
}

}  // namespace atelier
