#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace atelier {

/// Bits that stand in an image for the 64 of a mark: these and a checksum of 32, spread by a
/// convolutional code of rate 1/5 (constraint length 9, ended by zeros).
inline constexpr int kMarkBits = 64;
inline constexpr int kMarkChecksumBits = 32;
inline constexpr int kMarkTailBits = 8;
inline constexpr int kMarkRate = 5;
inline constexpr int kMarkCodeBits = (kMarkBits + kMarkChecksumBits + kMarkTailBits) * kMarkRate;

/// The code of 64 bits: kMarkCodeBits values of 0 and 1.
std::vector<std::uint8_t> mark_code(std::uint64_t bits);

/// The bits whose code fits soft values best (Viterbi), and whether their checksum is theirs. Of
/// values that have nothing to do with a code it is so once in 2^32.
/// @param soft  kMarkCodeBits; positive: rather 0. Throws LogicError for another number.
struct DecodedMark {
  std::uint64_t bits = 0;
  std::uint32_t difference = 0;  ///< of the checksum from that of the bits; 0: it is theirs
};
DecodedMark decode_mark(std::span<const float> soft);

}  // namespace atelier
