#pragma once

#include <array>
#include <filesystem>

#include "appearance/prepare.h"
#include "appearance/train_options.h"
#include "capture/layouts/open_dataset.h"
#include "core/store/stage.h"

namespace atelier {

struct AppearanceStageOptions {
  TrainOptions train;
  PrepareAppearanceOptions prepare;
  DatasetOptions capture;
  bool body = false;  ///< also the body under the clothes, with the same kind of network
};
OptionTable describe(AppearanceStageOptions& options);

/// Refuses what no network can have on that device. Throws UsageError.
void require_trainable(const AppearanceStageOptions& options, Device device);

/// Refuses what the run would refuse of the capture as the options have it read: cameras that it
/// has not, or none that is left. Throws DataError.
void require_cameras(const AppearanceStageOptions& options, const std::filesystem::path& capture);

inline constexpr std::array kAppearanceMetrics = {
    StageMetric{"surfaces", ""},        StageMetric{"frames", ""},
    StageMetric{"views", ""},           StageMetric{"pixels", ""},
    StageMetric{"iterations", ""},      StageMetric{"training_psnr_db", "dB"},
    StageMetric{"seconds_a_step", "s"},
};

/// Images, registered garments and bodies -> for each garment (and the body) <name>/
/// model.safetensors (the network), <name>/training.csv (loss and PSNR of every step) and
/// <name>/data.h5 (what it learnt from: `atelier-appearance train` takes it elsewhere), and
/// pictures.png, some of the images beside what the networks draw. Held-out cameras and frames
/// are never opened.
void run_appearance(StageRun& run);

/// The same on the ground-truth garments and body of a synthetic capture, which no other stage has
/// touched: what `appearance` could reach.
void run_oracle(StageRun& run);

}  // namespace atelier
