#pragma once

#include <string>

#include "core/image.h"
#include "core/options.h"

namespace atelier {

/// Appearance of a cloth at close range.
enum class FabricKind {
  Plain,     ///< one colour with the faintest mottle: the hard case for stereo and registration
  Woven,     ///< slubby yarns both ways, a few per cent lighter and darker, as of linen or chambray
  Print,     ///< flowers and leaves, 3 to 6 cm, printed on the woven cloth; below a printed top the
             ///< legs of an outfit are woven
  AllPrint,  ///< the same on every garment of an outfit
  Coded,     ///< a dense print of coloured cells of which no two 3 x 3 neighbourhoods agree, after
             ///< Halimi et al., "Pattern-based cloth registration and sparse-view animation" (2022)
};

struct FabricOptions {
  FabricKind kind = FabricKind::Print;
  int resolution = 2048;     ///< texels a side, 16 to 16384; 1 mm or finer for close views
  double hue = 0.6;          ///< of the base colour, turns in [0, 1): 0 red, 0.33 green
  double saturation = 0.45;  ///< of the base colour, [0, 1]
  double lightness = 0.32;   ///< reflectance of the base colour, [0.02, 0.9]
  double cell = 0.012;       ///< m, width of a cell of the coded print, 0.002 to 0.1
  double print_scale = 1;    ///< of the printed figures, 0.1 to 10
};
OptionTable describe(FabricOptions& options);

/// The albedo of a cloth laid flat: a square image, linear RGB, whose side is `size` metres; row 0
/// is the top (v = 1), y up is the warp. The same seed gives the same image at any thread count.
/// Throws LogicError for options out of range.
Image fabric_image(double size, const FabricOptions& options, std::uint64_t seed);

/// Smooth noise of mean 0 and about unit range at a point: one octave of gradientless value noise
/// with quintic interpolation on the integer lattice, hashed by Philox (our choice).
double value_noise(double x, double y, double z, std::uint64_t seed);

}  // namespace atelier
