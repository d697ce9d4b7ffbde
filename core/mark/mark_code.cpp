#include "core/mark/mark_code.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "core/error.h"
#include "core/mark/cyclic_checksum.h"

namespace atelier {
namespace {

constexpr int kMemory = kMarkTailBits;
constexpr unsigned kStates = 1u << kMemory;
constexpr int kSteps = kMarkCodeBits / kMarkRate;
// The four generators of rate 1/4 with the largest free distance for this length, and one more of
// those of rate 1/3 (Proakis, Digital Communications, tables 8.2-2 and 8.2-3).
constexpr std::array<unsigned, kMarkRate> kGenerators = {0463, 0535, 0733, 0745, 0557};

/// Of the 8 bytes of a number, the lowest first; of zeros it is not 0.
std::uint32_t checksum_of(std::uint64_t bits) {
  std::array<char, sizeof bits> bytes;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<char>(bits >> (8 * i) & 0xFF);
  }
  return cyclic_checksum({bytes.data(), bytes.size()});
}

/// The code bits of one step, of every window of bits: bit g is generator g's.
constexpr std::array<std::uint8_t, 2 * kStates> kOutputs = [] {
  std::array<std::uint8_t, 2 * kStates> outputs{};
  for (unsigned window = 0; window < outputs.size(); ++window) {
    for (std::size_t g = 0; g < kGenerators.size(); ++g) {
      const int parity = std::popcount(window & kGenerators[g]) & 1;
      outputs[window] = static_cast<std::uint8_t>(outputs[window] | parity << g);
    }
  }
  return outputs;
}();

}  // namespace

std::vector<std::uint8_t> mark_code(std::uint64_t bits) {
  const std::uint32_t checksum = checksum_of(bits);
  std::vector<std::uint8_t> code;
  code.reserve(kMarkCodeBits);
  unsigned window = 0;  // the newest bit is the highest
  for (int i = 0; i < kSteps; ++i) {
    const unsigned bit = i < kMarkBits ? static_cast<unsigned>(bits >> i & 1)
                         : i < kMarkBits + kMarkChecksumBits
                             ? static_cast<unsigned>(checksum >> (i - kMarkBits) & 1)
                             : 0u;
    window = window >> 1 | bit << kMemory;
    const unsigned outputs = kOutputs[window];
    for (int g = 0; g < kMarkRate; ++g) {
      code.push_back(static_cast<std::uint8_t>(outputs >> g & 1));
    }
  }
  return code;
}

DecodedMark decode_mark(std::span<const float> soft) {
  ATELIER_CHECK(std::ssize(soft) == kMarkCodeBits, "a mark has a code of 520 bits");
  constexpr float kNever = -std::numeric_limits<float>::infinity();
  std::array<float, kStates> score;
  score.fill(kNever);
  score[0] = 0;
  // The bit that a state lost by the step into it: 0 or 1.
  std::vector<std::array<std::uint8_t, kStates>> lost(kSteps);
  for (int i = 0; i < kSteps; ++i) {
    std::array<float, 1u << kMarkRate> fit{};
    for (unsigned outputs = 0; outputs < fit.size(); ++outputs) {
      for (int g = 0; g < kMarkRate; ++g) {
        const float value = soft[static_cast<std::size_t>(i * kMarkRate + g)];
        fit[outputs] += (outputs >> g & 1) != 0 ? -value : value;
      }
    }
    std::array<float, kStates> next;
    for (unsigned state = 0; state < kStates; ++state) {
      const bool is_tail = i >= kSteps - kMarkTailBits;
      if (is_tail && state >> (kMemory - 1) != 0) {
        next[state] = kNever;
        continue;
      }
      // A window is a state and the bit that leaves it, which is its lowest.
      const auto reached = [&](unsigned bit) {
        const unsigned window = state << 1 | bit;
        return score[window & (kStates - 1)] + fit[kOutputs[window]];
      };
      const float zero = reached(0);
      const float one = reached(1);
      lost[static_cast<std::size_t>(i)][state] = one > zero ? 1 : 0;
      next[state] = std::max(zero, one);
    }
    score = next;
  }
  DecodedMark mark;
  std::uint32_t checksum = 0;
  unsigned state = 0;
  for (int i = kSteps - 1; i >= 0; --i) {
    const unsigned bit = state >> (kMemory - 1);
    if (i < kMarkBits) {
      mark.bits |= static_cast<std::uint64_t>(bit) << i;
    } else if (i < kMarkBits + kMarkChecksumBits) {
      checksum |= bit << (i - kMarkBits);
    }
    state = (state << 1 | lost[static_cast<std::size_t>(i)][state]) & (kStates - 1);
  }
  mark.difference = checksum ^ checksum_of(mark.bits);
  return mark;
}

}  // namespace atelier
