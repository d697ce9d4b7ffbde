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
  explicit SaveTimes(int every) : every_(every) {}
  bool due(std::int64_t step) const {
    constexpr int kMinEvery = 100;
    return every_ > 0 ? step % every_ == 0
                      : step % kMinEvery == 0 && Clock::now() - last_ >= 20 * took_;
  }
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
                  Device device, const TrainHooks& hooks) {
  const TrainOptions known = resolved(options);
  TrainResult result;
  result.training = std::move(training);
  AppearanceNetwork network(result.training.model, device, known.half);
  network.learn_from(data, known.code.losses);
  if (result.training.iteration > 0) {
    network.resume(result.training.moments, result.training.iteration);
  }
  /// The network's state into the result; false if it is not all numbers.
  const auto keep = [&] {
    std::map<std::string, Tensor> parameters = network.parameters();
    if (!all_finite(parameters)) {
      return false;
    }
    result.training.model.parameters = std::move(parameters);
    result.training.moments = network.moments();
    result.training.iteration = network.steps();
    return true;
  };
  // A GPU works on while the next steps are asked for, and only then says how these went.
  const std::int64_t at_once = device == Device::Cuda ? 20 : 1;
  const auto view_count = static_cast<int>(data.views.size());
  std::vector<double> rates;
  SaveTimes saves(known.checkpoint_every);
  for (std::int64_t i = result.training.iteration; i < known.iterations && !result.stopped;) {
    std::vector<int> batch;
    batch.reserve(static_cast<std::size_t>(known.batch));
    for (int k = 0; k < known.batch; ++k) {
      batch.push_back(training_view(known.seed, view_count, i * known.batch + k));
    }
    AdamStep step;
    step.learning_rate = learning_rate_at(known, static_cast<int>(i));
    step.weight_decay = known.weight_decay;
    step.seed = static_cast<std::uint64_t>(known.seed);
    step.divergence = divergence_share_at(known, static_cast<int>(i));
    network.step(batch, step);
    rates.push_back(step.learning_rate);
    ++i;
    const bool save = saves.due(i);
    if (!save && i % at_once != 0 && i < known.iterations) {
      continue;
    }
    std::int64_t done = i - static_cast<std::int64_t>(rates.size());
    for (const NetworkLoss& loss : network.losses()) {
      result.finite = result.finite && std::isfinite(loss.value);
      if (hooks.step) {
        hooks.step(done + 1, loss, rates[rates.size() - static_cast<std::size_t>(i - done)]);
      }
      ++done;
    }
    rates.clear();
    result.stopped = hooks.stop && hooks.stop();
    if (result.finite && (save || result.stopped)) {
      saves.save([&] {
        result.finite = keep();
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
  result.finite = keep();
  return result;
}

}  // namespace atelier
