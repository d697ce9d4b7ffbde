#pragma once

#include <cstdint>

#include "core/host_device.h"

namespace atelier {

/// Four 32-bit words.
struct RandomWords {
  std::uint32_t word[4];
};

/// Counter-based random numbers: Philox4x32-10 (Salmon et al., "Parallel random numbers: as easy as
/// 1, 2, 3", SC 2011). The same (seed, stream, counter) gives the same words on every device, in
/// any order, so that loops stay deterministic on any number of threads.
ATELIER_HOST_DEVICE inline RandomWords random_words(std::uint64_t seed, std::uint64_t stream,
                                                    std::uint64_t counter) {
  std::uint32_t c[4] = {
      static_cast<std::uint32_t>(counter), static_cast<std::uint32_t>(counter >> 32),
      static_cast<std::uint32_t>(stream), static_cast<std::uint32_t>(stream >> 32)};
  std::uint32_t k0 = static_cast<std::uint32_t>(seed);
  std::uint32_t k1 = static_cast<std::uint32_t>(seed >> 32);
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t p0 = 0xD2511F53ull * c[0];
    const std::uint64_t p1 = 0xCD9E8D57ull * c[2];
    const std::uint32_t n0 = static_cast<std::uint32_t>(p1 >> 32) ^ c[1] ^ k0;
    const std::uint32_t n2 = static_cast<std::uint32_t>(p0 >> 32) ^ c[3] ^ k1;
    c[0] = n0;
    c[1] = static_cast<std::uint32_t>(p1);
    c[2] = n2;
    c[3] = static_cast<std::uint32_t>(p0);
    k0 += 0x9E3779B9u;
    k1 += 0xBB67AE85u;
  }
  return {{c[0], c[1], c[2], c[3]}};
}

/// A stream of numbers: seed and stream name it, the counter walks.
struct Random {
  std::uint64_t seed = 0;
  std::uint64_t stream = 0;
  std::uint64_t counter = 0;
};

/// Uniform in [0, 1), 53 bits.
double uniform(Random& random);

/// Uniform in [low, high).
double uniform(Random& random, double low, double high);

/// Uniform integer in [0, n), without bias. n > 0.
std::uint64_t uniform_index(Random& random, std::uint64_t n);

/// Standard normal (Box-Muller).
double normal(Random& random);

}  // namespace atelier
