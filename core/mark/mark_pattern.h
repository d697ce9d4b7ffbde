#pragma once

#include <complex>
#include <cstdint>
#include <vector>

namespace atelier {

/// The pattern of a mark repeats every so many pixels of the image that is marked.
inline constexpr int kMarkTile = 192;

/// Waves a tile, at least and at most: periods of 38 to 8.7 pixels. A third of the size keeps them,
/// JPEG spends bits on them, and lower ones would drown in what the image shows.
inline constexpr double kMarkLowest = 5;
inline constexpr double kMarkHighest = 22;
inline constexpr int kMarkWaves = 23;  ///< along x: 0 .. 22; along y: -22 .. 22

/// One wave of the pattern: `u` waves a tile along x, `v` along y, with its phase by the key.
struct MarkCarrier {
  int u = 0;
  int v = 0;
  std::complex<float> phase;  ///< of size 1
};

/// The waves of a key: those that say where the pattern lies, and one for each bit of the code,
/// which turns its sign.
struct MarkCarriers {
  std::vector<MarkCarrier> pilots;
  std::vector<MarkCarrier> code;  ///< kMarkCodeBits
};

/// Those of the key that every build of this program has. It is public: a mark says what an image
/// is, it keeps nobody from making or removing one.
const MarkCarriers& mark_carriers();

/// Tile of a mark [kMarkTile, kMarkTile], rows from the top, with mean square 1.
std::vector<float> mark_tile(std::uint64_t bits);

}  // namespace atelier
