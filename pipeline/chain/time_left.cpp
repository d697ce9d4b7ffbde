#include "pipeline/chain/time_left.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include "core/parallel.h"

namespace atelier {
namespace {

/// Arithmetic that the compiler cannot leave out: the logistic map, whose next value needs the one
/// before.
double logistic_map(int steps) {
  double x = 0.3;
  for (int i = 0; i < steps; ++i) {
    x = 3.9 * x * (1 - x);
  }
  return x;
}

constexpr int kSteps = 1 << 23;
/// s of these steps on the machine of the costs, one core of it alone.
constexpr double kMeasuredSeconds = 0.0113;

}  // namespace

double run_pace(std::span<const StageTime> stages) {
  constexpr double kBrief = 5;          // s
  constexpr double kAsExpected = 0.25;  // weight
  double sum = 0;
  double weights = kAsExpected;
  for (const StageTime& one : stages) {
    if (one.expected > 0 && one.taken > 0) {
      const double weight = one.expected / (one.expected + kBrief);
      sum += weight * std::log(one.taken / one.expected);
      weights += weight;
    }
  }
  return std::clamp(std::exp(sum / weights), 0.1, 10.0);
}

double machine_pace() {
  const auto threads = static_cast<Index>(std::max(1, thread_count()));
  std::vector<double> values(static_cast<std::size_t>(threads));
  const auto begin = std::chrono::steady_clock::now();
  parallel_for(threads, 1, [&](Index i, Index /*end*/) {
    values[static_cast<std::size_t>(i)] = logistic_map(kSteps + static_cast<int>(i));
  });
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const bool real = std::all_of(values.begin(), values.end(), [](double x) { return x >= 0; });
  return real ? std::clamp(seconds / kMeasuredSeconds, 0.25, 8.0) : 1;
}

}  // namespace atelier
