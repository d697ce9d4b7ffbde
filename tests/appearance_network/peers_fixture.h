#pragma once

#include <atomic>
#include <exception>
#include <string>
#include <thread>
#include <vector>

#include "appearance/network/train.h"
#include "core/io/temporary_folder.h"

namespace atelier::fixtures {

/// The results of processes that train together; here threads, which have nothing else in common.
inline std::vector<TrainResult> train_together(const Training& training, const AppearanceData& data,
                                               const TrainOptions& options,
                                               const std::vector<TrainHooks>& hooks) {
  const TemporaryFolder folder;
  const std::string rendezvous = (folder.path / "rendezvous").string();
  const int count = static_cast<int>(hooks.size());
  std::vector<TrainResult> results(hooks.size());
  std::vector<std::exception_ptr> errors(hooks.size());
  std::vector<std::thread> threads;
  for (int rank = 0; rank < count; ++rank) {
    threads.emplace_back([&, rank, at = static_cast<std::size_t>(rank)] {
      try {
        Peers peers({rank, count, rank, rendezvous}, Device::Cpu, [](const std::string&) {});
        results[at] = train(training, data, options, Device::Cpu, hooks[at], &peers);
        peers.finish();
      } catch (...) {
        errors[at] = std::current_exception();
      }
    });
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
  for (const std::exception_ptr& error : errors) {
    if (error) {
      std::rethrow_exception(error);
    }
  }
  return results;
}

/// The largest difference between the parameters of two models.
inline double largest_difference(const AppearanceModel& a, const AppearanceModel& b) {
  double most = a.parameters.size() == b.parameters.size() ? 0 : 1e9;
  for (const auto& [name, tensor] : a.parameters) {
    const auto left = values_of<float>(tensor);
    const auto right = values_of<float>(b.parameters.at(name));
    for (std::size_t i = 0; i < left.size(); ++i) {
      most = std::max(most, std::abs(static_cast<double>(left[i]) - right[i]));
    }
  }
  return most;
}

}  // namespace atelier::fixtures
