#pragma once

#include <functional>

#include "appearance/network/network.h"
#include "appearance/train_options.h"
#include "appearance/training.h"

namespace atelier {

/// One that has not begun. Throws as initial_model does.
Training start_training(const AppearanceData& data, const TrainOptions& options);

/// Throws DataError unless the training was of this architecture, these options and these data.
void require_same_training(const Training& training, const AppearanceData& data,
                           const TrainOptions& options, const std::string& file = "");

/// Who watches. All may be empty.
struct TrainHooks {
  std::function<void(std::int64_t iteration, const NetworkLoss& loss, double learning_rate)> step;
  std::function<void(const Training& training)> checkpoint;  ///< TrainOptions::checkpoint_every
  std::function<bool()> stop;                                ///< true: after this step
};

struct TrainResult {
  Training training;     ///< as far as it came
  bool finite = true;    ///< false: the loss was no number, and it stands at the last checkpoint
  bool stopped = false;  ///< by `stop`
};

/// Trains until `iterations`: batches of views in an order that the seed decides, AdamW, the loss
/// of NetworkLoss. On the CPU the same data and options give the same bits on one kind of machine
/// and number of threads, also when it was stopped and went on.
TrainResult train(Training training, const AppearanceData& data, const TrainOptions& options,
                  Device device, const TrainHooks& hooks = {});

}  // namespace atelier
