#pragma once

#include <string>

namespace atelier {

/// Result of a training.
enum class Learnt {
  Enough,
  Doubtful,  ///< half a decibel and more below the texture that does not change
  Diverged,  ///< 3 dB and more: no result
};

/// A network starts as the texture that does not change. One that ends below it has diverged.
/// @param psnr   dB, over the last steps (mean_psnr_after)
/// @param fixed  dB, of that texture (StaticFit::psnr)
Learnt learnt(double psnr, double fixed);

/// Message about a training that did not learn enough, with what to do.
std::string little_learnt_text(double psnr, double fixed);

}  // namespace atelier
