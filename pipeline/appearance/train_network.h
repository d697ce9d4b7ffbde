#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "appearance/train_options.h"
#include "core/store/stage.h"

namespace atelier {

/// Files of a training: what it reads, and what it leaves for the next run.
struct TrainingFiles {
  std::filesystem::path data;        ///< AppearanceData
  std::filesystem::path model;       ///< written at the end
  std::filesystem::path log;         ///< CSV, a row for each step
  std::filesystem::path checkpoint;  ///< the training goes on where it stands
};

struct Trained {
  std::optional<double> psnr;  ///< dB, mean over the last steps; nothing: their rows are lost
  double seconds = 0;          ///< of the steps of this run: a resumed one has fewer
  double steps = 0;            ///< of this run
  bool done = false;           ///< false: the run was told to stop
};

/// Trains a surface's network in the program `atelier-appearance`, with progress. Throws
/// NotConverged where it diverges, EnvironmentError where the program is not there.
/// @param options  resolved
/// @param views    in the data
Trained train_network(StageRun& run, const std::string& name, const TrainOptions& options,
                      int views, const TrainingFiles& files);

/// Warns of a network that is no better than the best static texture. One that has diverged is no
/// result, as `atelier-appearance` says, too: throws NotConverged.
/// @param psnr   dB, of its last steps, where they are known
/// @param fixed  dB, of that texture
void require_learnt(StageRun& run, const std::string& name, std::optional<double> psnr,
                    double fixed);

}  // namespace atelier
