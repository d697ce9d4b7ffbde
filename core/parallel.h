#pragma once

#include <algorithm>
#include <functional>
#include <vector>

#include "core/types.h"

namespace atelier {

/// Calls `body(begin, end)` over [0, n) in chunks of `grain`, on several threads. Chunks do not
/// depend on the number of threads. The first exception (by chunk order) is rethrown.
void parallel_for(Index n, Index grain, const std::function<void(Index begin, Index end)>& body);

/// Sum of `chunk(begin, end)` over [0, n) in chunks of `grain`, added in order of the chunks: the
/// same bits on any number of threads.
template <class T, class Chunk>
T parallel_sum(Index n, Index grain, T zero, const Chunk& chunk) {
  const Index chunks = n <= 0 ? 0 : (n + grain - 1) / grain;
  std::vector<T> parts(static_cast<std::size_t>(chunks), zero);
  parallel_for(chunks, 1, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      parts[static_cast<std::size_t>(i)] = chunk(i * grain, std::min(n, (i + 1) * grain));
    }
  });
  T sum = zero;
  for (const T& part : parts) {
    sum = sum + part;
  }
  return sum;
}

/// Number of threads that loops use from now on; 0: as many as the machine has.
void set_thread_count(int count);

/// Number of threads that loops use.
int thread_count();

}  // namespace atelier
