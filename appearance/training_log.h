#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace atelier {

/// How one step of a training went.
struct TrainingStep {
  std::int64_t iteration = 0;  ///< from 1
  double loss = 0;             ///< mean squared difference in sRGB
  double psnr = 0;             ///< dB
  double learning_rate = 0;
};

/// The log of a training is CSV: this header, then a row for each step, in their order.
std::string training_log_header();
std::string training_log_row(const TrainingStep& step);

/// The log with which a training goes on after `iteration` steps: the header and the rows up to
/// there. The rest of a row that a kill or a full disk has left, whatever follows a row that is
/// none, and rows of steps that are done again are cut off.
std::string resumed_training_log(std::string_view log, std::int64_t iteration);

/// The step after which a training is judged: its last twentieth, and no fewer steps than see all
/// views once: a single one may be of a camera that is worse than the others.
std::int64_t judged_after(int iterations, int views, int batch);

/// Mean PSNR of a log's steps after `step`; nothing where it has none of them, as after a power
/// loss that took rows that a checkpoint has.
std::optional<double> mean_psnr_after(std::string_view log, std::int64_t step);

}  // namespace atelier
