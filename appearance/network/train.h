#pragma once

#include <functional>

#include "appearance/network/network.h"
#include "appearance/network/peers.h"
#include "appearance/train_options.h"
#include "appearance/training.h"

namespace atelier {

/// The state of a training before its first step. Throws as initial_model does.
Training start_training(const AppearanceData& data, const TrainOptions& options);

/// Throws DataError unless the training has this architecture, these options and these data.
void require_same_training(const Training& training, const AppearanceData& data,
                           const TrainOptions& options, const std::string& file = "");

/// Callbacks of a training. All may be empty.
struct TrainHooks {
  std::function<void(std::int64_t iteration, const NetworkLoss& loss, double learning_rate)> step;
  std::function<void(const Training& training)> checkpoint;  ///< TrainOptions::checkpoint_every
  std::function<bool()> stop;                                ///< true: stop after this step
};

struct TrainResult {
  Training training;     ///< its last state
  bool finite = true;    ///< false: the loss was not finite; `training` is the last checkpoint
  bool stopped = false;  ///< by `stop`
};

/// Trains until `iterations`, by AdamW on the loss of NetworkLoss, with batches of views in an
/// order determined by the seed. On the CPU, results are the same to the bit for the same data,
/// options, kind of machine and number of threads, also when a training is interrupted and resumed.
///
/// P processes take P steps at once, each a batch, and update the parameters once by all of them:
/// the weights are those of one process with P times the batch and a P-th of the iterations, but
/// for rounding. Checkpoints go on with any number of processes. The hooks are called in the first
/// process alone, but for `stop`, which any may say.
TrainResult train(Training training, const AppearanceData& data, const TrainOptions& options,
                  Device device, const TrainHooks& hooks = {}, Peers* peers = nullptr);

}  // namespace atelier
