#include "appearance/learnt.h"

#include <cstdio>

namespace atelier {

Learnt learnt(double psnr, double fixed) {
  constexpr double kDoubtful = 0.5;  // dB below
  constexpr double kRefused = 3;
  if (!(psnr > fixed - kRefused)) {  // no number, too
    return Learnt::Diverged;
  }
  return psnr < fixed - kDoubtful ? Learnt::Doubtful : Learnt::Enough;
}

std::string little_learnt_text(double psnr, double fixed) {
  char text[200];
  std::snprintf(text, sizeof(text),
                "the training ends at %.1f dB, below the %.1f dB of the static texture; a smaller "
                "--learning-rate may help",
                psnr, fixed);
  return text;
}

}  // namespace atelier
