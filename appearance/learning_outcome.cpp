#include "appearance/learning_outcome.h"

#include <cstdio>

namespace atelier {

LearningOutcome learning_outcome(double psnr, double static_psnr) {
  constexpr double kDoubtful = 0.5;  // dB below
  constexpr double kRefused = 3;
  if (!(psnr > static_psnr - kRefused)) {  // no number, too
    return LearningOutcome::Diverged;
  }
  return psnr < static_psnr - kDoubtful ? LearningOutcome::Doubtful : LearningOutcome::Sufficient;
}

std::string poor_outcome_text(double psnr, double static_psnr) {
  char text[200];
  std::snprintf(text, sizeof(text),
                "the training ends at %.1f dB, below the %.1f dB of the static texture; a smaller "
                "--learning-rate may help",
                psnr, static_psnr);
  return text;
}

}  // namespace atelier
