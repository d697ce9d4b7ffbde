#pragma once

#include <string>

namespace atelier {

/// How good a trained network is, compared with the static texture that it starts as.
enum class LearningOutcome {
  Sufficient,
  Doubtful,  ///< 0.5 dB or more below it
  Diverged,  ///< 3 dB or more below it, or no number: there is no result
};

/// Judges a training.
/// @param psnr         dB, over the last steps (mean_psnr_after)
/// @param static_psnr  dB, of the static texture (StaticFit::psnr)
LearningOutcome learning_outcome(double psnr, double static_psnr);

/// Message about a training that is not sufficient, with a remedy.
std::string poor_outcome_text(double psnr, double static_psnr);

}  // namespace atelier
