#pragma once

namespace atelier {

/// Peak signal-to-noise ratio, dB, of values in [0,1] whose difference has this mean square, >= 0:
/// -10 log10 of it, at most 90, which is less than one step of 8 bits in 15,000 values. Of what is
/// no number (0/0: of no values) no number.
double psnr_of(double mean_square);

}  // namespace atelier
