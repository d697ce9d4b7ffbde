#pragma once

#include <cstdint>
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
/// there. What a kill or a full disk has left of a row, whatever follows a row that is none, and
/// rows of steps that are done again are cut off.
std::string resumed_training_log(std::string_view log, std::int64_t iteration);

}  // namespace atelier
