#include "appearance/network/train.h"

#include <chrono>
#include <cmath>
#include <optional>

#include "appearance/content_digest.h"
#include "core/error.h"

namespace atelier {
namespace {

/// Digest of a training's data, 64 digits: all that a file of it holds.
std::string digest_of(const AppearanceData& data) {
  const Archive archive = archive_of(data);
  return content_digest(archive.datasets, archive.texts);
}

bool all_finite(const std::map<std::string, Tensor>& tensors) {
  for (const auto& [name, tensor] : tensors) {
    for (const float value : values_of<float>(tensor)) {
      if (!std::isfinite(value)) {
        return false;
      }
    }
  }
  return true;
}

/// When to save: every so many steps, or (0) as often as saving, which for a large network takes as
/// long as a hundred steps of a GPU, stays below a twentieth of the time.
class SaveTimes {
 public:
  /// @param at_once  steps from one that may be asked for to the next
  SaveTimes(int every, std::int64_t at_once) : every_(every), at_once_(at_once) {}
  /// Whether it may be time, which clocks do not change: processes agree on it.
  bool may(std::int64_t step) const {
    constexpr int kMinEvery = 100;
    const std::int64_t every = every_ > 0 ? every_ : kMinEvery;
    return step / every > (step - at_once_) / every;
  }
  bool due() const { return every_ > 0 || Clock::now() - last_ >= 20 * took_; }
  /// Calls what saves.
  template <class Save>
  void save(const Save& save_now) {
    const auto begin = Clock::now();
    save_now();
    last_ = Clock::now();
    took_ = last_ - begin;
  }

 private:
  using Clock = std::chrono::steady_clock;
  int every_;
  std::int64_t at_once_;
  Clock::time_point last_ = Clock::now();
  Clock::duration took_{};
};

int parts_of(const AppearanceData& data) {
  return data.body ? static_cast<int>(data.body->parts.parents.size()) : 0;
}

}  // namespace

Training start_training(const AppearanceData& data, const TrainOptions& options) {
  Training training;
  training.model = initial_model(data, network_options(options, parts_of(data)),
                                 static_cast<std::uint64_t>(options.seed), options.smoothness);
  training.options = training_text(options);
  training.data = digest_of(data);
  return training;
}

void require_same_training(const Training& training, const AppearanceData& data,
                           const TrainOptions& options, const std::string& file) {
  require_architecture(training.model, network_options(options, parts_of(data)), file);
  if (training.options != training_text(options)) {
    throw DataError(file, "options", training.options.substr(0, 400),
                    training_text(options) + ", or another checkpoint");
  }
  if (training.data != digest_of(data)) {
    throw DataError(file, "data", "a training on other data",
                    "its own data, or another checkpoint");
  }
}

TrainResult train(Training training, const AppearanceData& data, const TrainOptions& options,
                  Device device, const TrainHooks& hooks, Peers* peers) {
  const TrainOptions known = resolved(options);
  TrainResult result;
  result.training = std::move(training);
  AppearanceNetwork network(result.training.model, device, known.half);
  network.learn_from(data, known.code.losses);
  if (result.training.iteration > 0) {
    network.resume(result.training.moments, result.training.updates);
  }
  if (peers != nullptr) {
    network.join(*peers);
  }
  const bool first = peers == nullptr || peers->rank() == 0;
  const std::int64_t at_once = peers == nullptr ? 1 : peers->size();  // steps of an update
  // The schedule of one process with batches as large as those of all.
  TrainOptions paced = known;
  paced.iterations = static_cast<int>((known.iterations + at_once - 1) / at_once);
  /// The network's state into the result; false if it is not all numbers.
  const auto keep = [&](std::int64_t iteration) {
    std::map<std::string, Tensor> parameters = network.parameters();
    if (!all_finite(parameters)) {
      return false;
    }
    result.training.model.parameters = std::move(parameters);
    result.training.moments = network.moments();
    result.training.iteration = iteration;
    result.training.updates = network.steps();
    return true;
  };
  // A GPU works on while the next steps are asked for, and only then says how these went.
  const std::int64_t asked_ahead = device == Device::Cuda ? 20 : 1;
  const auto view_count = static_cast<int>(data.views.size());
  std::vector<double> rates;
  SaveTimes saves(known.checkpoint_every, at_once);
  std::int64_t i = result.training.iteration;
  for (std::int64_t said = i; i < known.iterations && !result.stopped;) {
    std::vector<int> batch;
    batch.reserve(static_cast<std::size_t>(known.batch * at_once));
    for (std::int64_t k = 0; k < known.batch * at_once; ++k) {
      batch.push_back(training_view(known.seed, view_count, i * known.batch + k));
    }
    AdamStep step;
    step.learning_rate = learning_rate_at(paced, static_cast<int>(i / at_once));
    step.weight_decay = known.weight_decay;
    step.seed = static_cast<std::uint64_t>(known.seed);
    step.divergence = divergence_share_at(paced, static_cast<int>(i / at_once));
    network.step(batch, step);
    rates.push_back(step.learning_rate);
    i = std::min<std::int64_t>(i + at_once, known.iterations);
    const bool may_save = saves.may(i);
    if (!may_save && i / at_once % asked_ahead != 0 && i < known.iterations) {
      continue;
    }
    std::size_t taken = 0;
    for (const NetworkLoss& loss : network.losses()) {
      result.finite = result.finite && std::isfinite(loss.value);
      if (hooks.step && first && said < i) {
        hooks.step(++said, loss, rates[taken / static_cast<std::size_t>(at_once)]);
      }
      ++taken;
    }
    rates.clear();
    const bool stop = hooks.stop && hooks.stop();
    result.stopped = peers == nullptr ? stop : peers->any(stop);
    if (result.finite && first && (result.stopped || (may_save && saves.due()))) {
      saves.save([&] {
        result.finite = keep(i);
        if (result.finite && hooks.checkpoint) {
          hooks.checkpoint(result.training);
        }
      });
    }
    if (!result.finite) {
      return result;
    }
  }
  if (!result.stopped) {
    network.center_codes();
  }
  result.finite = keep(i);
  return result;
}

}  // namespace atelier
